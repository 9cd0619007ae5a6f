#include <algorithm>
#include <map>

#include <Imath/ImathBox.h>

#include "io/mesh_io.hpp"
#include "io/ply.hpp"
#include "io/polygon.hpp"
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

double area(const std::vector<std::array<std::uint32_t, 3>>& triangles, const std::vector<Imath::V3f>& p)
{
    double twice = 0;
    for (const auto& [a, b, c] : triangles) twice += (Vec3(p[b]) - Vec3(p[a])).cross(Vec3(p[c]) - Vec3(p[a])).z;
    return twice / 2;
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
          "glTF2/MissingBin/BoxTextured.gltf", "glTF2/RecursiveNodes/RecursiveNodes.gltf",
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
        EXPECT_EQ(soup.positions, (std::vector<Imath::V3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
        EXPECT_EQ(soup.corners, (std::vector<std::uint32_t>{0, 1, 2}));
        EXPECT_EQ(soup.sizes, (std::vector<std::uint32_t>{3}));
    }
    const std::string one = "\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    const PolygonSoup big =
        decode_ply(bytes_of("ply\nformat binary_big_endian 1.0" + one + std::string("\x3f\x80\0\0\x40\0\0\0\0\0\0\0", 12)), "x");
    EXPECT_EQ(big.positions, (std::vector<Imath::V3f>{{1, 2, 0}}));
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
          "ply\nformat ascii 1.0\nelement vertex x\nend_header\n", "ply\nformat ascii 1.0\nproperty float x\nend_header\n"})
        EXPECT_EQ(error_of([&] { decode_ply(bytes_of(text), "x"); }).code(), ErrorCode::invalid_input) << text;
}

TEST(Polygon, ConcaveOnesKeepTheirAreaAndSense)
{
    const std::vector<std::vector<Imath::V3f>> polygons{
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},                                             // square
        {{0, 0, 0}, {2, -1, 0}, {0.5f, 0, 0}, {2, 1, 0}},                                         // arrow head
        {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {3, 3, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}}, // U
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}},                                             // a corner in a line
    };
    const double areas[] = {1, 0.5, 8, 1};
    for (std::size_t i = 0; i < polygons.size(); ++i)
        for (std::size_t turn = 0; turn < polygons[i].size(); ++turn) {
            std::vector<std::uint32_t> corners;
            for (std::size_t k = 0; k < polygons[i].size(); ++k)
                corners.push_back(static_cast<std::uint32_t>((k + turn) % polygons[i].size()));
            std::vector<std::array<std::uint32_t, 3>> triangles;
            triangulate(corners, polygons[i], triangles);
            EXPECT_EQ(triangles.size(), corners.size() - 2);
            for (const auto& triangle : triangles)
                EXPECT_GE(area({triangle}, polygons[i]), 0) << "polygon " << i << " from corner " << turn;
            EXPECT_EQ(area(triangles, polygons[i]), areas[i]) << "polygon " << i << " from corner " << turn;
            std::ranges::reverse(corners);
            triangles.clear();
            triangulate(corners, polygons[i], triangles);
            EXPECT_EQ(area(triangles, polygons[i]), -areas[i]);
        }
}
