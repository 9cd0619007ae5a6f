// Meshes that name other files, computed by a service.
#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>

#include <nlohmann/json.hpp>

#include <penumbra/image.hpp>

#include "clients/server_program.hpp"
#include "command.hpp"

namespace penumbra::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const Environment with_token{{"PENUMBRA_SERVER_TOKEN", server_token}};

// A square of side 1 at height 2, or what a picture leaves of it.
class RemoteMeshes : public CommandTest {
protected:
    std::string write_scene_of(const Json& objects) const
    {
        Json all = objects;
        all.push_back({{"quad", {{"center", {0, 0, 0}}, {"half_u", {2, 0, 0}}, {"half_v", {0, 0, -2}}}}, {"casts", false}});
        const Json scene = {{"penumbra", 1},
                            {"light", {{"kind", "point"}, {"center", {0, 4, 0}}}},
                            {"objects", all},
                            {"receivers", {{"camera", {{"kind", "light"}, {"tan_half_fov", {0.5, 0.5}}}}, {"resolution", {64, 61}}}},
                            {"technique", {{"kind", "ray_traced"}, {"samples", 1}}}};
        write_text(path("scene.json"), scene.dump());
        return path("scene.json");
    }
    // A picture with a hole, the left or the right half.
    void write_picture(const std::string& name, bool left) const
    {
        Image picture{.width = 8, .height = 8, .channels = 4, .pixels = {}};
        for (int i = 0; i < 64; ++i) picture.pixels.insert(picture.pixels.end(), {1, 1, 1, (i % 8 < 4) == left ? 0.0f : 1.0f});
        write_image(path(name), picture, {"png", 8});
    }
    void write_obj(const std::string& name, const std::string& library) const
    {
        fs::create_directories(fs::path(path(name)).parent_path());
        write_text(path(name), "mtllib " + library + "\nv -.5 2 .5\nv .5 2 .5\nv .5 2 -.5\nv -.5 2 -.5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                                                     "usemtl pane\nf 1/1 2/2 3/3 4/4\n");
    }
    void write_gltf(const std::string& name, const std::string& bin, const std::string& image) const
    {
        const std::array<float, 20> numbers{-.5f, 2, .5f, .5f, 2, .5f, .5f, 2, -.5f, -.5f, 2, -.5f, 0, 1, 1, 1, 1, 0, 0, 0};
        const std::array<unsigned char, 6> corners{0, 1, 2, 0, 2, 3};
        std::string bytes(sizeof(numbers) + sizeof(corners), '\0');
        std::memcpy(bytes.data(), numbers.data(), sizeof(numbers));
        std::memcpy(bytes.data() + sizeof(numbers), corners.data(), sizeof(corners));
        write_text(path("my mesh.bin"), bytes);
        Json gltf = Json::parse(R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "buffers": [{"byteLength": 86}],
            "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
                            {"buffer": 0, "byteOffset": 80, "byteLength": 6}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                          {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
                          {"bufferView": 2, "componentType": 5121, "count": 6, "type": "SCALAR"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 1}]}],
            "materials": [{"normalTexture": {"index": 1}},
                          {"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 1}, {"source": 0}], "images": [{"uri": "no shadow depends on it.png"}, {}]})");
        gltf["buffers"][0]["uri"] = bin;
        gltf["images"][1]["uri"] = image;
        write_text(path(name), gltf.dump());
    }
    Ran remote(const std::string& scene, const std::vector<std::string>& options = {"--allow-meshes"})
    {
        return penumbra({"mask", scene, "-o", path("remote.pfm"), "--server", shared_server(options)}, with_token);
    }
    // The service computes what is computed here. Returns how much of the floor is in shadow.
    double expect_same(const std::string& scene)
    {
        const Ran local = penumbra({"mask", scene, "-o", path("local.pfm")}), ran = remote(scene);
        EXPECT_EQ(local.code, 0) << local.err;
        EXPECT_EQ(ran.code, 0) << ran.err;
        EXPECT_EQ(std::ranges::count(ran.err, '\n'), std::ranges::count(local.err, '\n')) << ran.err << local.err; // the same warnings
        expect_same_bytes(path("local.pfm"), path("remote.pfm"));
        double dark = 0;
        const Image mask = read_image(path("remote.pfm"));
        for (const float v : mask.pixels) dark += 1 - v;
        return 16 * dark / static_cast<double>(mask.pixels.size());
    }
};

constexpr double square = 4, half = 2, pixel_rows = 0.2;

TEST_F(RemoteMeshes, AnObjWithItsLibraryAndCutOut)
{
    write_obj("window.obj", "window.mtl");
    write_text(path("window.mtl"), "newmtl pane\nmap_d -clamp on a window.png\n");
    write_picture("a window.png", true);
    EXPECT_NEAR(expect_same(write_scene_of({{{"mesh", "window.obj"}, {"receives", false}}})), half, pixel_rows);
}

TEST_F(RemoteMeshes, AGltfWithSpacesInItsNames)
{
    fs::create_directory(path("tex"));
    write_picture("tex/my leaf.png", true);
    write_gltf("square.gltf", "my%20mesh.bin", "tex/my%20leaf.png");
    EXPECT_NEAR(expect_same(write_scene_of({{{"mesh", "square.gltf"}, {"receives", false}}})), half, pixel_rows);
}

// Each has the half that the other leaves: together they are the square, and would not be with one picture for both.
TEST_F(RemoteMeshes, MeshesThatNameDifferentFilesAlike)
{
    for (const std::string folder : {"a", "b"}) {
        write_obj(folder + "/window.obj", "window.mtl");
        write_text(path(folder + "/window.mtl"), "newmtl pane\nmap_d pane.png\n");
        write_picture(folder + "/pane.png", folder == "a");
    }
    const Json a = {{"mesh", "a/window.obj"}, {"receives", false}}, b = {{"mesh", "b/window.obj"}, {"receives", false}};
    EXPECT_NEAR(expect_same(write_scene_of({a, b})), square, pixel_rows);

    // One that has no library does not get the other's.
    fs::remove(path("b/window.mtl"));
    EXPECT_NEAR(expect_same(write_scene_of({a, a})), half, pixel_rows);
    EXPECT_NEAR(expect_same(write_scene_of({a, b})), square, pixel_rows);
    EXPECT_NEAR(expect_same(write_scene_of({b, a})), square, pixel_rows);
}

TEST_F(RemoteMeshes, FilesThatTheSceneSaysItself)
{
    write_gltf("square.gltf", "elsewhere.bin", "leaf.png");
    write_picture("a leaf.png", true);
    const Json files = {{"elsewhere.bin", "my mesh.bin"}, {"leaf.png", "a leaf.png"}};
    EXPECT_NEAR(expect_same(write_scene_of({{{"mesh", "square.gltf"}, {"files", files}, {"receives", false}}})), half, pixel_rows);
    const std::string scene = write_scene_of({{{"mesh", "square.gltf"}, {"files", Json::object()}}});
    for (const Ran& ran : {penumbra({"mask", scene, "-o", path("local.pfm")}), remote(scene)})
        expect_one_error(ran, 2, {"objects[0].mesh", "square.gltf names \"elsewhere.bin\"", "files"});
}

TEST_F(RemoteMeshes, WhatIsMissing)
{
    const std::string scene = write_scene_of({{{"mesh", "square.gltf"}, {"receives", false}}});
    for (const auto& [bin, image, missing] : {std::array{"gone%20bin", "leaf.png", "gone bin"}, std::array{"my mesh.bin", "gone.png", "gone.png"}}) {
        write_picture("leaf.png", true);
        write_gltf("square.gltf", bin, image);
        expect_one_error(remote(scene), 2, {"scene.json", "square.gltf names \"" + std::string(missing) + "\"", "No such file"});
    }
    // An OBJ goes without its materials, as it does here.
    write_obj("window.obj", "gone.mtl");
    EXPECT_NEAR(expect_same(write_scene_of({{{"mesh", "window.obj"}, {"receives", false}}})), square, pixel_rows);
    EXPECT_NE(remote(path("scene.json")).err.find("gone.mtl"), std::string::npos);
}

TEST_F(RemoteMeshes, AServiceThatTakesNoneSaysSo)
{
    write_gltf("square.gltf", "my%20mesh.bin", "leaf.png");
    write_picture("leaf.png", true);
    expect_one_error(remote(write_scene_of({{{"mesh", "square.gltf"}, {"receives", false}}}), {}), 2, {"scene.json", "--allow-meshes"});
}

} // namespace
} // namespace penumbra::test
