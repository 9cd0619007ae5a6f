#include "io/gltf_support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

void expect_box(const PolygonSoup& soup, const Vec3& low, const Vec3& high, double tolerance = 1e-12)
{
    const Imath::Box3d box = box_of(soup);
    EXPECT_LE((box.min - low).length(), tolerance) << box.min;
    EXPECT_LE((box.max - high).length(), tolerance) << box.max;
}

// One triangle in the plane z = 0 under one node.
Gltf one_triangle(const json& node = {})
{
    Gltf gltf;
    json whole = {{"mesh", gltf.mesh({{"attributes", {{"POSITION", gltf.accessor(corner_triangle, "VEC3")}}}})}};
    whole.update(node.is_null() ? json::object() : node);
    gltf.node(whole);
    return gltf;
}

} // namespace

TEST(Gltf, BuffersAreBesideInsideOrInTheText)
{
    const Gltf gltf = one_triangle();
    EXPECT_EQ(gltf.read().sizes.size(), 1u);

    const Folder folder;
    folder.write("my mesh.bin", gltf.bytes());
    EXPECT_EQ(read_mesh(folder.write("a.gltf", gltf.text("my%20mesh.bin")), "a").triangles.size(), 1u);
    EXPECT_EQ(read_mesh(folder.write("a.glb", gltf.glb()), "a").triangles.size(), 1u);
    // 36 bytes, whatever the type that the URI gives.
    const std::string base64 = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    for (const char* type : {"application/octet-stream", "application/gltf-buffer", "application/x-other", ""})
        EXPECT_EQ(read_mesh(folder.write("a.gltf", gltf.text("data:" + std::string(type) + ";base64," + base64)), "a").triangles.size(),
                  1u);
    // A file may be longer than its buffer.
    folder.write("mesh.bin", gltf.bytes() + "more");
    EXPECT_EQ(read_mesh(folder.write("a.gltf", "\xef\xbb\xbf" + gltf.text("mesh.bin")), "a").triangles.size(), 1u);
}

TEST(Gltf, RequiredExtensionsThatAreNotReadAreRefusedByName)
{
    for (const char* name : {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "VENDOR_unheard_of"}) {
        Gltf gltf = one_triangle();
        gltf.root["extensionsUsed"] = {name};
        EXPECT_EQ(gltf.read().sizes.size(), 1u) << "used, not required";
        gltf.root["extensionsRequired"] = {name};
        const Error error = error_of([&] { gltf.read(); });
        EXPECT_EQ(error.code(), ErrorCode::unsupported);
        EXPECT_NE(error.message().find(name), std::string::npos) << error.message();
    }
    Gltf gltf = one_triangle();
    gltf.root["extensionsRequired"] = {"KHR_mesh_quantization", "KHR_texture_transform", "EXT_mesh_gpu_instancing", "KHR_materials_unlit"};
    EXPECT_EQ(gltf.read().sizes.size(), 1u);
}

TEST(Gltf, QuantisedPositions)
{
    Gltf gltf;
    gltf.root["extensionsRequired"] = {"KHR_mesh_quantization"};
    const int whole = gltf.accessor(std::vector<std::int16_t>{0, 0, 0, 300, 0, 0, 0, 200, -5}, "VEC3");
    const int shares = gltf.accessor(std::vector<std::int8_t>{-128, 0, 0, 127, 0, 0, 0, 127, 64}, "VEC3", true);
    gltf.node({{"mesh", gltf.mesh({{"attributes", {{"POSITION", whole}}}})}, {"scale", {0.01, 0.01, 0.01}}});
    expect_box(gltf.read(), {0, 0, -0.05}, {3, 2, 0});
    gltf.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = shares;
    expect_box(gltf.read(), {-0.01, 0, 0}, {0.01, 0.01, 0.01 * 64 / 127});
    // Shorts in steps of eight bytes, as they are aligned.
    const int padded = gltf.view(std::vector<std::uint16_t>{0, 0, 0, 9, 65535, 0, 0, 9, 0, 65535, 0, 9}, 8);
    gltf.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] =
        gltf.push("accessors", {{"bufferView", padded}, {"componentType", 5123}, {"count", 3}, {"type", "VEC3"}, {"normalized", true}});
    expect_box(gltf.read(), {0, 0, 0}, {0.01, 0.01, 0});
}

TEST(Gltf, NodesHangUnderEachOtherAndMirroredOnesTurnTriangles)
{
    Gltf gltf = one_triangle({{"scale", {2, 2, 2}}});
    const int child = gltf.push("nodes", {{"mesh", 0}, {"scale", {-1, 1, 1}}});
    const int middle =
        gltf.push("nodes", {{"children", {child}}, {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}}); // 90 degrees about z
    gltf.node({{"children", {middle}}, {"translation", {10, 0, 0}}});
    const PolygonSoup soup = gltf.read();
    ASSERT_EQ(soup.sizes.size(), 2u);
    // (-1, 0) turned is (0, -1), (0, 1) is (-1, 0); then 10 to the right.
    expect_box(soup, {0, -1, 0}, {10, 2, 0});
    EXPECT_NEAR(turn_z(soup, 0), 4, 1e-12);
    EXPECT_NEAR(turn_z(soup, 1), 1, 1e-12) << "mirrored triangles keep facing +z";

    // Column by column.
    gltf = one_triangle({{"matrix", {0, 3, 0, 0, -2, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}}});
    expect_box(gltf.read(), {3, 6, 7}, {5, 9, 7});
}

TEST(Gltf, TheDefaultSceneAloneCasts)
{
    Gltf gltf = one_triangle();
    gltf.push("nodes", {{"mesh", 0}, {"translation", {100, 0, 0}}});
    gltf.push("nodes", {{"mesh", 0}, {"translation", {200, 0, 0}}});
    expect_box(gltf.read(), {0, 0, 0}, {1, 1, 0});
    gltf.push("scenes", {{"nodes", {1}}});
    gltf.root["scene"] = 1;
    expect_box(gltf.read(), {100, 0, 0}, {101, 1, 0});
    gltf.root["nodes"][1]["extensions"] = {{"KHR_node_visibility", {{"visible", false}}}};
    EXPECT_TRUE(gltf.read().sizes.empty());
    gltf.root.erase("scene");
    gltf.root.erase("scenes");
    EXPECT_EQ(gltf.read().sizes.size(), 2u) << "without scenes all that is visible";
}

TEST(Gltf, StripsFansAndMissingIndices)
{
    const std::vector<float> square{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
    for (const int mode : {5, 6}) {
        Gltf gltf;
        const std::vector<std::uint8_t> fan{0, 1, 3, 2};
        json primitive = {{"attributes", {{"POSITION", gltf.accessor(square, "VEC3")}}}, {"mode", mode}};
        if (mode == 6) primitive["indices"] = gltf.accessor(fan, "SCALAR");
        gltf.node({{"mesh", gltf.mesh(primitive)}});
        const PolygonSoup soup = gltf.read();
        ASSERT_EQ(soup.sizes.size(), 2u);
        for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(turn_z(soup, i), 1) << "mode " << mode << " triangle " << i;
    }
    for (const int mode : {0, 1, 2, 3}) {
        Gltf gltf = one_triangle();
        json line = gltf.root["meshes"][0]["primitives"][0];
        line["mode"] = mode;
        gltf.root["meshes"][0]["primitives"].push_back(line);
        const PolygonSoup soup = gltf.read();
        EXPECT_EQ(soup.sizes.size(), 1u);
        EXPECT_EQ(soup.lines, 1u);
    }
}

TEST(Gltf, SparseAccessors)
{
    Gltf gltf = one_triangle();
    const json sparse = {{"count", 1},
                         {"indices", {{"bufferView", gltf.view(std::vector<std::uint8_t>{1})}, {"componentType", 5121}}},
                         {"values", {{"bufferView", gltf.view(std::vector<float>{7, 0, 0})}}}};
    gltf.root["accessors"][0]["sparse"] = sparse;
    expect_box(gltf.read(), {0, 0, 0}, {7, 1, 0});
    gltf.root["accessors"][0].erase("bufferView"); // zeros but for the one
    expect_box(gltf.read(), {0, 0, 0}, {7, 0, 0});
    gltf.root["accessors"][0]["sparse"]["indices"]["bufferView"] = gltf.view(std::vector<std::uint8_t>{3});
    EXPECT_EQ(error_of([&] { gltf.read(); }).code(), ErrorCode::invalid_input);
}

TEST(Gltf, MorphTargetsByTheirWeights)
{
    Gltf gltf = one_triangle();
    const int up = gltf.accessor(std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3"),
              right = gltf.accessor(std::vector<float>{4, 0, 0, 4, 0, 0, 4, 0, 0}, "VEC3");
    gltf.root["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", up}}, {{"POSITION", right}}};
    expect_box(gltf.read(), {0, 0, 0}, {1, 1, 0});
    gltf.root["meshes"][0]["weights"] = {0.5, 0.25};
    expect_box(gltf.read(), {1, 0, 0.5}, {2, 1, 0.5});
    gltf.root["nodes"][0]["weights"] = {2, 0};
    expect_box(gltf.read(), {0, 0, 2}, {1, 1, 2});
    gltf.root["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = gltf.accessor(std::vector<float>{0, 0, 1}, "VEC3");
    EXPECT_EQ(error_of([&] { gltf.read(); }).code(), ErrorCode::invalid_input);
}

TEST(Gltf, SkinsStandAsTheirJoints)
{
    Gltf gltf = one_triangle({{"skin", 0}, {"translation", {1000, 0, 0}}}); // a skinned mesh's own node moves nothing
    json& attributes = gltf.root["meshes"][0]["primitives"][0]["attributes"];
    // The first two corners hang on joint 0, the third half on each.
    attributes["JOINTS_0"] = gltf.accessor(std::vector<std::uint8_t>{0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0}, "VEC4");
    attributes["WEIGHTS_0"] = gltf.accessor(std::vector<std::uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 127, 127, 0, 0}, "VEC4", true);
    const int joint = gltf.node({{"translation", {0, 0, 3}}}), other = gltf.node({{"translation", {0, 10, 3}}});
    const std::vector<float> bind{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -1, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -1, 1};
    gltf.push("skins", {{"joints", {joint, other}}, {"inverseBindMatrices", gltf.accessor(bind, "MAT4")}});
    expect_box(gltf.read(), {0, 0, 2}, {1, 6, 2});
    // Joints that mirror turn triangles.
    for (const int node : {joint, other}) gltf.root["nodes"][static_cast<std::size_t>(node)]["scale"] = {-1, 1, 1};
    EXPECT_GT(turn_z(gltf.read(), 0), 0);
    attributes["WEIGHTS_0"] = gltf.accessor(std::vector<float>(12, 0.0f), "VEC4");
    EXPECT_EQ(error_of([&] { gltf.read(); }).code(), ErrorCode::invalid_input);
}

TEST(Gltf, InstancesOfANode)
{
    Gltf gltf = one_triangle({{"translation", {0, 0, 1}}});
    const int places = gltf.accessor(std::vector<float>{0, 0, 0, 5, 0, 0, 0, 5, 0}, "VEC3");
    const int sizes = gltf.accessor(std::vector<float>{1, 1, 1, 2, 2, 2, -1, 1, 1}, "VEC3");
    const int turns =
        gltf.accessor(std::vector<std::int8_t>{0, 0, 0, 127, 0, 0, 127, 0, 0, 0, 0, 127}, "VEC4", true); // the second half around
    gltf.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
        {"TRANSLATION", places}, {"SCALE", sizes}, {"ROTATION", turns}};
    const PolygonSoup soup = gltf.read();
    ASSERT_EQ(soup.sizes.size(), 3u);
    expect_box(soup, {-1, -2, 1}, {5, 6, 1}, 1e-9);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_GT(turn_z(soup, i), 0);
    gltf.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] =
        gltf.accessor(std::vector<float>{1, 1, 1}, "VEC3");
    EXPECT_EQ(error_of([&] { gltf.read(); }).code(), ErrorCode::invalid_input);
}
