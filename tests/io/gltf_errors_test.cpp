// Broken glTF: one clear error each.
#include <random>

#include "io/gltf_support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

Gltf sound()
{
    Gltf gltf;
    const int positions = gltf.accessor(corner_triangle, "VEC3"), indices = gltf.accessor(std::vector<std::uint16_t>{0, 1, 2}, "SCALAR");
    gltf.node({{"mesh", gltf.mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}})}});
    return gltf;
}

void expect_broken(const Gltf& gltf, const std::string& says)
{
    SCOPED_TRACE(says);
    const Error error = error_of([&] { gltf.read(); });
    EXPECT_EQ(error.code(), ErrorCode::invalid_input) << error.what();
    EXPECT_NE(error.message().find(says), std::string::npos) << error.message();
    EXPECT_TRUE(error.message().starts_with("x.gltf ")) << error.message();
    EXPECT_EQ(error.message().find('\n'), std::string::npos);
}

} // namespace

TEST(GltfErrors, NameWhatIsWrong)
{
    const auto with = [](const char* pointer, const json& value) {
        Gltf gltf = sound();
        gltf.root[json::json_pointer(pointer)] = value;
        return gltf;
    };
    expect_broken(with("/accessors/0/count", 4), "accessors[0] that reaches beyond");
    expect_broken(with("/accessors/0/count", 1000000000000000ull), "accessors[0] that reaches beyond");
    expect_broken(with("/accessors/0/byteOffset", 18446744073709551615ull), "accessors[0] that reaches beyond");
    expect_broken(with("/accessors/0/type", "VEC2"), "has 2 numbers an element, expected 3");
    expect_broken(with("/accessors/0/componentType", 5130), "componentType 5130");
    expect_broken(with("/accessors/0/bufferView", 9), "bufferViews[9] of 2");
    expect_broken(with("/accessors/1/componentType", 5122), "indices of componentType 5122");
    expect_broken(with("/bufferViews/0/byteLength", 1000), "bufferViews[0] of 1000 bytes");
    expect_broken(with("/bufferViews/0/buffer", 3), "buffers[3] of 1");
    expect_broken(with("/bufferViews/0/byteStride", 8), "elements of 12 bytes, 8 apart");
    expect_broken(with("/meshes/0/primitives/0/attributes", json::object()), "without POSITION");
    expect_broken(with("/meshes/0/primitives/0/attributes/POSITION", 7), "accessors[7] of 2");
    expect_broken(with("/meshes/0/primitives/0/mode", 7), "unknown mode 7");
    expect_broken(with("/meshes/0/primitives/0/material", 0), "materials[0] of 0");
    expect_broken(with("/nodes/0/mesh", 2), "meshes[2] of 1");
    expect_broken(with("/nodes/0/skin", 2), "skins[2] of 0");
    expect_broken(with("/nodes/0/children", {0}), "their own ancestors");
    expect_broken(with("/nodes/0/children", {5}), "nodes[5] of 1");
    expect_broken(with("/nodes/0/translation", {1, 2}), "nodes[0].translation of 2 numbers");
    expect_broken(with("/scene", 4), "scenes[4] of 1");
    expect_broken(with("/scenes/0/nodes", {0, 0}), "nodes[0] twice");
    expect_broken(with("/asset/version", 2), "no asset.version");
    expect_broken(with("/asset/version", "1.0"), "is glTF \"1.0\"");
    expect_broken(with("/nodes/0/extensions/EXT_mesh_gpu_instancing", {{"attributes", 3}}), "EXT_mesh_gpu_instancing without attributes");
    expect_broken(with("/meshes/0/primitives/0/indices", 0), "indices of componentType 5126");
    json zeros = {{"componentType", 5126}, {"count", 4000000000u}, {"type", "VEC3"}};
    expect_broken(with("/accessors/0", zeros), "4000000000 elements and no bufferView");

    Gltf far = sound();
    far.root["accessors"][1]["bufferView"] = far.view(std::vector<std::uint16_t>{0, 1, 3});
    expect_broken(far, "vertex 3 of 3");
    Gltf shared = sound();
    shared.push("nodes", {{"mesh", 0}});
    shared.node({{"children", {1}}});
    shared.node({{"children", {1}}});
    expect_broken(shared, "two parents");
    json deep;
    for (int i = 0; i < 200; ++i) deep = json::array({deep});
    expect_broken(with("/extras", deep), "nested deeper");
}

// What tinygltf takes for missing would be a mesh that stands elsewhere.
TEST(GltfErrors, NameKeysOfAnotherType)
{
    const auto with = [](const char* pointer, const json& value) {
        Gltf gltf = sound();
        gltf.root[json::json_pointer(pointer)] = value;
        return gltf;
    };
    expect_broken(with("/nodes/0/translation", "far"), "has nodes[0].translation that is not a list of numbers");
    expect_broken(with("/nodes/0/scale", {1, 2, "3"}), "has nodes[0].scale that is not a list of numbers");
    expect_broken(with("/nodes/0/mesh", 4294967296), "has nodes[0].mesh that is not a number from 0");
    expect_broken(with("/nodes/0/mesh", 0.5), "has nodes[0].mesh");
    expect_broken(with("/nodes", {1}), "has nodes that is not a list of objects");
    expect_broken(with("/scene", "first"), "has scene that is not");
    expect_broken(with("/meshes/0/primitives", 3), "has meshes[0].primitives that is not a list of objects");
    expect_broken(with("/meshes/0/primitives/0/mode", "4"), "has meshes[0].primitives[0].mode that is not");
    expect_broken(with("/meshes/0/primitives/0/attributes/POSITION", -1), "has meshes[0].primitives[0].attributes that is not");
    expect_broken(with("/meshes/0/primitives/0/targets", {{{"POSITION", true}}}),
                  "has meshes[0].primitives[0].targets[0].POSITION that is not");
    expect_broken(with("/accessors/0/count", -1), "has accessors[0].count that is not");
    expect_broken(with("/accessors/0/sparse", {{"count", 1}, {"indices", 3}, {"values", 4}}),
                  "has accessors[0].sparse.indices that is not an object");
    expect_broken(with("/accessors/0/normalized", 1), "has accessors[0].normalized that is not true or false");
    expect_broken(with("/materials", {{{"alphaMode", 1}}}), "has materials[0].alphaMode that is not a text");
}

TEST(GltfErrors, BrokenContainers)
{
    const auto code = [](const std::string& text) {
        const Error error = error_of([&] { decode_gltf(bytes_of(text), {.where = "x", .companion = {}}); });
        EXPECT_EQ(error.message().find('\n'), std::string::npos);
        return error.code();
    };
    const std::string glb = sound().glb();
    for (std::size_t size = 0; size < glb.size(); size += 7) EXPECT_EQ(code(glb.substr(0, size)), ErrorCode::invalid_input) << size;
    for (const char* text :
         {"", "{", "[]", "null", "{}", R"({"asset": 1})", R"({"asset": []})", R"({"asset": {"version": "2.0"}, "buffers": 3})",
          R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4}]})",
          R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "data:;base64,AAA="}]})",
          R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 3, "uri": "data:;base64,A*=="}]})",
          R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": -3, "uri": "data:;base64,AAAA"}]})"})
        EXPECT_EQ(code(text), ErrorCode::invalid_input) << text;
    std::string version = glb;
    version[4] = 1;
    EXPECT_EQ(code(version), ErrorCode::unsupported);
    EXPECT_EQ(error_of([] {
                  Gltf missing = sound();
                  decode_gltf(bytes_of(missing.text("gone.bin")), {.where = "x", .companion = [](const std::string& name) -> Bytes {
                                                                       throw Error(ErrorCode::not_found, name);
                                                                   }});
              }).code(),
              ErrorCode::not_found);
}

// A few triangles and many places: what grows is refused before it is made.
TEST(GltfErrors, FewBytesMakeNoBillionsOfTriangles)
{
    Gltf gltf = sound();
    gltf.root["accessors"][0] = {{"componentType", 5126}, {"count", 10000000}, {"type", "VEC3"}};
    gltf.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
        gltf.push("accessors", {{"componentType", 5126}, {"count", 1000000}, {"type", "VEC3"}});
    EXPECT_EQ(error_of([&] { gltf.read(); }).code(), ErrorCode::too_large);
}

TEST(GltfErrors, ChangedFilesNeverCrash)
{
    const std::string glb = sound().glb();
    std::mt19937 random(7);
    for (int round = 0; round < 20000; ++round) {
        std::string changed = glb;
        for (int i = 0; i < 1 + round % 4; ++i) changed[random() % changed.size()] = static_cast<char>(random());
        try {
            decode_gltf(bytes_of(changed), {.where = "x", .companion = {}});
        } catch (const Error&) {
        } catch (const std::exception&) { // read_mesh makes errors of them
        }
    }
}
