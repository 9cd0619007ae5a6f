// Files that meshes name: they become parts, found by the mesh's own names for them.
#include <cstdlib>

#include <gtest/gtest.h>

#include <penumbra/client.hpp>

#include "clients/scene_folder.hpp"
#include "clients/server_program.hpp"

namespace penumbra::test {
namespace {

using client::Images;
using Json = nlohmann::json;

const std::string square = "v -.5 2 .5\nv .5 2 .5\nv .5 2 -.5\nv -.5 2 -.5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl pane\nf 1/1 2/2 3/3 4/4\n";

class MeshFiles : public SceneFolder {
protected:
    client::SceneFile load(const Json& objects) const { return client::load_scene_file(write("scene.json", Json{{"objects", objects}}.dump())); }
    std::vector<std::string> parts_of(const std::string& mesh) const
    {
        std::vector<std::string> names;
        for (const auto& [name, bytes] : load({{{"mesh", mesh}}}).images) names.push_back(name);
        return names;
    }
};
using Names = std::vector<std::string>;

TEST_F(MeshFiles, PartsOfTheirOwnNamesNeedNoTable)
{
    write("t/a.obj", "mtllib a.mtl\n" + square);
    write("t/a.mtl", "newmtl pane\nmap_d a.png\n");
    write("t/a.png", "a picture");
    const client::SceneFile file = load({{{"mesh", "t/a.obj"}}});
    EXPECT_EQ(file.scene, Json::parse(R"({"objects": [{"mesh": "a.obj"}]})"));
    EXPECT_EQ(file.images, (Images{{"a.obj", "mtllib a.mtl\n" + square}, {"a.mtl", "newmtl pane\nmap_d a.png\n"}, {"a.png", "a picture"}}));
}

TEST_F(MeshFiles, OthersHaveOne)
{
    write("a.gltf", R"({"buffers": [{"uri": "my%20mesh.bin"}, {"uri": "b/x.bin"}, {"uri": "data:,x"}, {}, {"uri": "%zz%4"}]})");
    for (const std::string name : {"my mesh.bin", "b/x.bin", "%zz%4"}) write(name, name);
    const client::SceneFile file = load({{{"mesh", "a.gltf"}}, {{"mesh", "./a.gltf"}}});
    const Json files = {{"my mesh.bin", "my_mesh.bin"}, {"b/x.bin", "x.bin"}, {"%zz%4", "_zz_4"}};
    for (const Json& object : file.scene.at("objects")) EXPECT_EQ(object, (Json{{"mesh", "a.gltf"}, {"files", files}}));
    EXPECT_EQ(file.images.size(), 4u);
    EXPECT_EQ(file.images.at("my_mesh.bin"), "my mesh.bin");
}

TEST_F(MeshFiles, AGlbToo)
{
    const std::string json = R"({"buffers": [{}, {"uri": "x.bin"}]})";
    write("x.bin", "x");
    write("a.GLB", std::string("glTF\2\0\0\0\0\0\0\0", 12) + static_cast<char>(json.size()) + std::string("\0\0\0JSON", 7) + json + std::string(8, '\0'));
    EXPECT_EQ(parts_of("a.GLB"), (Names{"a.GLB", "x.bin"}));
}

TEST_F(MeshFiles, OfAGltfTheCutOutsThatItDraws)
{
    write("a.gltf", R"({"images": [{"uri": "no.png"}, {"uri": "leaf.png"}, {"uri": "no.png"}], "textures": [{"source": 1}, {"source": 0}, {}],
        "materials": [{"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
                      {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}},
                      {"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}},
                      {"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 2}}}, {"alphaMode": "MASK"}],
        "meshes": [{"primitives": [{"material": 0}, {"material": 1}, {"material": 3}, {"material": 4}, {"material": 9}, {}]}, 3]})");
    write("leaf.png", "x");
    EXPECT_EQ(parts_of("a.gltf"), (Names{"a.gltf", "leaf.png"}));
}

TEST_F(MeshFiles, OfAnObjTheCutOutsThatItUses)
{
    write("a.obj", "\xef\xbb\xbfmtllib two words.mtl # mtllib c.mtl\r\nmtllib \\\na.mtl b.mtl\n# \\\nusemtl  pane \nusemtl bark\nmtllib\n");
    write("two words.mtl", "newmtl pane\n\tMAP_D -clamp on -o 1 +2 -mm 0 1 -s 1 tex\\a leaf.png\nmap_Kd no.png\nnewmtl other\nmap_d no.png\n");
    write("b.mtl", "newmtl bark\rmap_d -imfchan l b.png");
    for (const std::string name : {"a.mtl", "c.mtl", "no.png", "b.png", "tex/a leaf.png"}) write(name, "x");
    EXPECT_EQ(parts_of("a.obj"), (Names{"a.mtl", "a.obj", "a_leaf.png", "b.mtl", "b.png", "two_words.mtl"}));
}

TEST_F(MeshFiles, MeshesThatNameDifferentFilesAlike)
{
    for (const std::string below : {"a/", "b/", "c/"}) write(below + "m.obj", "mtllib m.mtl\n");
    write("b/m.mtl", "b");
    write("c/m.mtl", "c");
    const client::SceneFile file = load({{{"mesh", "a/m.obj"}}, {{"mesh", "b/m.obj"}}, {{"mesh", "c/m.obj"}}});
    // The first has none: no part has the name.
    EXPECT_EQ(file.scene.at("objects"), Json::parse(R"([{"mesh": "m.obj"}, {"mesh": "m-2.obj", "files": {"m.mtl": "m-2.mtl"}},
                                                        {"mesh": "m-3.obj", "files": {"m.mtl": "m-3.mtl"}}])"));
    EXPECT_EQ(file.images.at("m-2.mtl"), "b");
    EXPECT_EQ(load({{{"mesh", "b/m.obj"}}, {{"mesh", "a/m.obj"}}}).scene.at("objects"),
              Json::parse(R"([{"mesh": "m.obj"}, {"mesh": "m-2.obj", "files": {}}])"));
}

TEST_F(MeshFiles, WhatIsMissing)
{
    for (const auto& [uri, name] : {std::pair{"gone%20too.bin", "gone too.bin"}, std::pair{"%ff.bin", "\\ufffd.bin"}, std::pair{".", "."}}) {
        write("a.gltf", Json{{"buffers", {{{"uri", uri}}}}}.dump());
        write("\xff.bin", "no name in JSON");
        try {
            (void)load({{{"mesh", "a.gltf"}}});
            ADD_FAILURE() << uri;
        } catch (const std::system_error& error) {
            EXPECT_NE(std::string(error.what()).find("a.gltf names \"" + std::string(name) + "\": "), std::string::npos) << error.what();
        }
    }
    write("a.obj", "mtllib gone.mtl \xff.bin empty.mtl\nusemtl x\n");
    write("empty.mtl", "");
    EXPECT_EQ(parts_of("a.obj"), Names{"a.obj"});
}

TEST_F(MeshFiles, BrokenMeshesAreForTheServiceToRefuse)
{
    for (const std::string& text : {std::string("{"), std::string("[]"), std::string("3"), std::string("glTF"), std::string("glTF") + std::string(16, '\xff'),
                                    std::string(100000, '['), std::string(R"({"buffers": {"uri": 3}, "meshes": "x", "images": [3]})")}) {
        write("a.gltf", text);
        EXPECT_EQ(parts_of("a.gltf"), Names{"a.gltf"});
    }
}

// 2 x 1 pixels, black and white.
std::string tiff()
{
    std::string bytes("II*\0\10\0\0\0\11\0", 10);
    const auto entry = [&](int tag, int type, int value) {
        for (const int part : {tag & 255, tag >> 8, type, 0, 1, 0, 0, 0, value, 0, 0, 0}) bytes.push_back(static_cast<char>(part));
    };
    const int data = 10 + 9 * 12 + 4, word = 3, number = 4;
    entry(256, number, 2), entry(257, number, 1), entry(258, word, 8), entry(259, word, 1), entry(262, word, 1);
    entry(273, number, data), entry(277, word, 1), entry(278, number, 1), entry(279, number, 2);
    return bytes + std::string("\0\0\0\0\0\xff", 6);
}

TEST_F(MeshFiles, GiveTheSameMaskAsHere)
{
    write("a.obj", "mtllib my a.mtl\n" + square);
    write("my a.mtl", "newmtl pane\nmap_d half a pane.tif\n");
    write("half a pane.tif", tiff());
    const std::string scene = write("scene.json", R"({"penumbra": 1, "light": {"kind": "point", "center": [0, 4, 0]},
        "objects": [{"mesh": "a.obj", "receives": false}, {"quad": {"center": [0, 0, 0], "half_u": [2, 0, 0], "half_v": [0, 0, -2]}, "casts": false}],
        "receivers": {"camera": {"kind": "light", "tan_half_fov": 0.5}, "resolution": [64, 64]}, "technique": {"kind": "ray_traced", "samples": 1}})");
    const std::string local = (folder / "local.pfm").string();
    ASSERT_EQ(std::system((std::string(PENUMBRA_CLI) + " mask " + scene + " -o " + local).c_str()), 0);
    const ServerProgram server{{"--allow-meshes"}};
    const client::SceneFile file = client::load_scene_file(scene);
    const client::Mask mask = client::Client(server.url, {.token = server_token, .traceparent = {}}).mask(file.scene, file.images);
    const bool same = mask.bytes == client::file_bytes(local);
    EXPECT_TRUE(same);
    EXPECT_TRUE(mask.warnings.empty());
    // The square's shadow is a quarter of the floor, and half of it is cut out.
    EXPECT_NEAR(static_cast<double>(std::ranges::count(mask.visibility.pixels, 0.0f)), 64 * 64 / 8, 64);
}

} // namespace
} // namespace penumbra::test
