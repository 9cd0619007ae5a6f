#include <algorithm>
#include <map>

#include <Imath/ImathBox.h>

#include "io/mesh_io.hpp"
#include "io/ply.hpp"
#include "io/support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

const std::string models = PENUMBRA_TEST_MODELS;

TriangleMesh read(const std::string& path) { return read_mesh(path, path); }

// Signed volume: positive when triangles are counter-clockwise seen from outside.
double volume(const TriangleMesh& mesh)
{
    double six = 0;
    for (const auto& [a, b, c] : mesh.triangles) six += Vec3(mesh.positions[a]).dot(Vec3(mesh.positions[b]).cross(Vec3(mesh.positions[c])));
    return six / 6;
}

// Each directed edge once, and once the other way: closed and consistently oriented.
bool is_closed(const TriangleMesh& mesh)
{
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    return std::ranges::all_of(edges, [&](const auto& edge) {
        const auto back = edges.find({edge.first.second, edge.first.first});
        return edge.second == 1 && back != edges.end() && back->second == 1;
    });
}

} // namespace

TEST(Mesh, BunnyIsAClosedMesh)
{
    const TriangleMesh mesh = read(PENUMBRA_BUNNY);
    EXPECT_EQ(mesh.triangles.size(), 69666u);
    EXPECT_EQ(mesh.positions.size(), 34835u) << "Euler: V = F / 2 + 2 for one closed surface";
    EXPECT_TRUE(is_closed(mesh));
    EXPECT_GT(volume(mesh), 0);
}

TEST(Mesh, BoxesOfEveryFormatAreWelded)
{
    for (const char* name :
         {"OBJ/box.obj", "PLY/cube.ply", "PLY/cube_binary.ply", "3DS/RotatingCube.3DS", "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb",
          "glTF2/BoxTextured-glTF/BoxTextured.gltf", "glTF2/BoxTextured-glTF-Embedded/BoxTextured.gltf"}) {
        SCOPED_TRACE(name);
        const TriangleMesh mesh = read(models + "/" + name);
        EXPECT_EQ(mesh.positions.size(), 8u);
        EXPECT_EQ(mesh.triangles.size(), 12u);
        EXPECT_TRUE(is_closed(mesh));
    }
}

TEST(Mesh, StlIsJoinedFromLooseTriangles)
{
    const TriangleMesh ascii = read(models + "/STL/Spider_ascii.stl"), binary = read(models + "/STL/Spider_binary.stl");
    EXPECT_EQ(ascii.triangles.size(), 1312u);
    EXPECT_EQ(binary.triangles.size(), 1312u);
    EXPECT_LT(binary.positions.size(), 3 * binary.triangles.size() / 2);
}

TEST(Mesh, StlAsTextInAnyCase)
{
    const Folder folder;
    const std::string loop = "OUTER LOOP\r\nVERTEX 0 0 0\r\nVERTEX 1 0 0\r\nVertex 0 1 0\r\nENDLOOP\r\nENDFACET\r\n";
    const std::string text = "\xef\xbb\xbfSOLID a thing\r\nFACET NORMAL 0 0 1\r\n" + loop + "ENDSOLID vertex\r\nsolid second\r\nfacet normal 0 0 1\r\n" + loop;
    EXPECT_EQ(read(folder.write("a.stl", text)).triangles.size(), 2u);
    EXPECT_EQ(error_of([&] { read(folder.write("a.stl", "solid\nfacet\nouter loop\nvertex 1 2\nendloop")); }).code(), ErrorCode::invalid_input);
    EXPECT_EQ(error_of([&] { read(folder.write("a.stl", "solid\nouter loop\nvertex 1 2 3\nendloop")); }).code(), ErrorCode::invalid_input);
    EXPECT_EQ(error_of([&] { read(folder.write("a.stl", "nothing")); }).code(), ErrorCode::invalid_input);
}

TEST(Mesh, CracksAreWarnedOfAndWelded)
{
    // Two squares side by side as loose triangles, corners a millionth apart.
    const Folder folder;
    const std::string path = folder.write("soup.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nv 0.000001 0 0\nv 1 1.000001 0\nv 0 1 0\nf 4 5 6\n");
    MeshOptions options;
    std::vector<std::string> warnings;
    options.warnings = &warnings;
    EXPECT_EQ(read_mesh(path, "soup.obj", options).positions.size(), 6u);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("4 vertices of open edges lie within 1e-06"), std::string::npos) << warnings[0];
    // With the length that the warning gives.
    options.weld = std::stod(warnings[0].substr(warnings[0].find("\"weld\": ") + 8));
    EXPECT_LT(options.weld, 1.3e-6);
    warnings.clear();
    const TriangleMesh welded = read_mesh(path, "soup.obj", options);
    EXPECT_EQ(welded.positions.size(), 4u);
    EXPECT_EQ(welded.triangles.size(), 2u);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("2 vertices that were joined"), std::string::npos) << warnings[0];
}

TEST(Mesh, PointsAndLinesAreWarnedOf)
{
    const Folder folder;
    MeshOptions options;
    std::vector<std::string> warnings;
    options.warnings = &warnings;
    read_mesh(folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\nf 1 2\n"), "a.obj", options);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("2 points and lines"), std::string::npos) << warnings[0];
}

TEST(Mesh, NodeTransformsAreApplied)
{
    const Folder folder;
    // One triangle in the plane z = 0, under a node that doubles it and one that mirrors and moves it.
    const std::string gltf = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "scale": [2, 2, 2]}, {"children": [2], "translation": [10, 0, 0]}, {"mesh": 0, "scale": [-1, 1, 1]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,)"
                             "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}";
    const TriangleMesh mesh = read(folder.write("two.gltf", gltf));
    ASSERT_EQ(mesh.triangles.size(), 2u);
    Imath::Box3f box;
    for (const auto& p : mesh.positions) box.extendBy(p);
    EXPECT_EQ(box.min, Imath::V3f(0, 0, 0));
    EXPECT_EQ(box.max, Imath::V3f(10, 2, 0));
    for (const auto& [a, b, c] : mesh.triangles)
        EXPECT_GT((mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]).z, 0)
            << "mirrored triangles keep facing +z";
}

TEST(Mesh, BrokenFilesAreErrors)
{
    for (const char* name :
         {"invalid/empty.obj", "invalid/empty.ply", "invalid/empty.3ds", "invalid/malformed.obj", "OBJ/point_cloud.obj", "OBJ/testline.obj",
          "OBJ/testpoints.obj", "PLY/points.ply", "PLY/pond.0.ply", "glTF2/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb",
          "glTF2/RecursiveNodes/RecursiveNodes.gltf",
          "glTF2/IndexOutOfRange/AllIndicesOutOfRange.gltf", "glTF2/TestNoRootNode/NoScene.gltf",
          "glTF2/TestNoRootNode/SceneWithoutNodes.gltf", "glTF2/wrongTypes/badArray.gltf", "glTF/TwoBoxes/TwoBoxes.gltf"}) {
        SCOPED_TRACE(name);
        ASSERT_TRUE(std::filesystem::exists(models + "/" + name));
        EXPECT_EQ(error_of([&] { read_mesh(models + "/" + name, "objects[0].mesh: a"); }).code(), ErrorCode::invalid_input);
    }
}

TEST(Mesh, MissingAndForeignFiles)
{
    EXPECT_EQ(error_of([] { read("none.obj"); }).code(), ErrorCode::not_found);
    const Error missing = error_of([] { read(models + "/glTF2/MissingBin/BoxTextured.gltf"); });
    EXPECT_EQ(missing.code(), ErrorCode::not_found);
    EXPECT_NE(missing.message().find(".bin"), std::string::npos) << missing.message();
    EXPECT_EQ(error_of([] { read(models + "/Collada/duck.dae"); }).code(), ErrorCode::unsupported);
    EXPECT_EQ(error_of([] { read(models + "/OFF/Cube.off"); }).code(), ErrorCode::unsupported);
    const Folder folder;
    std::filesystem::create_directory(folder / "a.obj");
    EXPECT_EQ(error_of([&] { read(folder / "a.obj"); }).code(), ErrorCode::invalid_input);
    // The extension decides: nothing else gets a look at the bytes.
    EXPECT_EQ(error_of([&] { read(folder.write("xml.3ds", "<?xml version=\"1.0\"?><COLLADA/>")); }).code(), ErrorCode::invalid_input);
    EXPECT_EQ(error_of([&] { read(folder.write("nan.obj", "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n")); }).code(), ErrorCode::invalid_input);
}

TEST(Mesh, TruncationNeverCrashes)
{
    const Folder folder;
    for (const char* name :
         {"OBJ/concave_polygon.obj", "PLY/cube.ply", "PLY/cube_binary.ply", "STL/triangle.stl", "STL/Spider_binary.stl",
          "3DS/RotatingCube.3DS", "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb", "glTF2/BoxTextured-glTF-Embedded/BoxTextured.gltf"}) {
        const std::vector<std::byte> whole = read_file(models + "/" + name, "");
        const std::string cut = folder / ("cut" + std::filesystem::path(name).extension().string());
        for (std::size_t part = 0; part < 20; ++part) {
            write_file(cut, std::span(whole).first(whole.size() * part / 20));
            try {
                EXPECT_FALSE(read(cut).triangles.empty()) << name; // text formats have no end to miss
            } catch (const Error& error) {
                EXPECT_EQ(error.code(), ErrorCode::invalid_input) << name << ": " << error.what();
            }
        }
    }
}

TEST(Ply, ReadsEveryLayout)
{
    const std::string head =
        "\ncomment made by hand\nelement vertex 3\nproperty double x\nproperty uchar red\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar short vertex_index\nend_header\n";
    const PolygonSoup ascii = decode_ply(bytes_of("ply\nformat ascii 1.0" + head + "0 9 0 0\n1 9 0 0\n0 9 +1e0 0\n3 0 1 2\n"), "x");
    std::string binary;
    for (const double x : {0.0, 1.0, 0.0}) {
        const float y = binary.size() > 30 ? 1.0f : 0.0f, z = 0;
        binary += std::string(reinterpret_cast<const char*>(&x), 8) + "R" + std::string(reinterpret_cast<const char*>(&y), 4) +
                  std::string(reinterpret_cast<const char*>(&z), 4);
    }
    binary += std::string("\x03\x00\x00\x01\x00\x02\x00", 7);
    const PolygonSoup little = decode_ply(bytes_of("ply\nformat binary_little_endian 1.0" + head + binary), "x");
    for (const PolygonSoup& soup : {ascii, little}) {
        EXPECT_EQ(soup.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
        EXPECT_EQ(soup.corners, (std::vector<std::uint32_t>{0, 1, 2}));
        EXPECT_EQ(soup.sizes, (std::vector<std::uint32_t>{3}));
    }
    const std::string one = "\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    const PolygonSoup big =
        decode_ply(bytes_of("ply\nformat binary_big_endian 1.0" + one + std::string("\x3f\x80\0\0\x40\0\0\0\0\0\0\0", 12)), "x");
    EXPECT_EQ(big.positions, (std::vector<Vec3>{{1, 2, 0}}));
}

TEST(Ply, TriangleStrips)
{
    // Two strips, -1 between them, as the Stanford scans have them.
    const PolygonSoup soup = decode_ply(bytes_of("ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
                                                 "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                                                 "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 0 0\n9 0 1 2 3 -1 1 4 3 -1\n"), "x");
    EXPECT_EQ(soup.sizes, (std::vector<std::uint32_t>{3, 3, 3}));
    EXPECT_EQ(soup.corners, (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 3, 1, 4, 3}));
    for (std::size_t t = 0; t < 3; ++t) {
        const auto at = [&](std::size_t k) { return soup.positions[soup.corners[3 * t + k]]; };
        EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).z, 0) << t;
    }
}

TEST(Ply, CountsThatLieCostNothing)
{
    for (const char* text :
         {"ply\nformat ascii 1.0\nelement vertex 18446744073709551615\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 "
          "0 0\n",
          "ply\nformat ascii 1.0\nelement face 1\nproperty list int int vertex_indices\nend_header\n4294967295 1 2 3\n",
          "ply\nformat ascii 1.0\nelement face 1\nproperty list int int vertex_indices\nend_header\n3 0 1 2\n",
          "ply\nformat ascii 1.0\nelement face 1\nproperty list int int vertex_indices\nend_header\n3 0 -1 2\n",
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n0 0\n", "ply\n", "ply",
          "ply\nformat ascii 1.0\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n3 0 -2 2\n",
          "ply\nformat ascii 1.0\nelement vertex x\nend_header\n", "ply\nformat ascii 1.0\nproperty float x\nend_header\n"})
        EXPECT_EQ(error_of([&] { decode_ply(bytes_of(text), "x"); }).code(), ErrorCode::invalid_input) << text;
}
