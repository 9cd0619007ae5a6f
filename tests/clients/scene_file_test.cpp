// Scene files: names become parts.
#include <algorithm>
#include <chrono>

#include <gtest/gtest.h>

#include <penumbra/client/scene_file.hpp>

#include "clients/scene_folder.hpp"

namespace penumbra::test {
namespace {

using Json = nlohmann::json;

using SceneFiles = SceneFolder;

TEST_F(SceneFiles, EveryPlaceThatNamesAFile)
{
    client::Images expected;
    for (const std::string name : {"e.exr", "f.exr", "b.exr", "l0.exr", "l1.exr", "r.exr", "m.obj", "d.exr"}) {
        expected[name] = "of " + name;
        write(name, "of " + name);
    }
    const Json scene = Json::parse(R"({"light": {"emission": "e.exr"},
        "occluders": {"depth": {"front": "f.exr", "back": "b.exr", "layers": ["l0.exr", "l1.exr"]}}, "receivers": {"depth": "r.exr"},
        "objects": [{"mesh": "m.obj"}, {"depth": "d.exr"}, {"quad": {}}]})");
    const client::SceneFile file = client::load_scene_file(write("scene.json", scene.dump()));
    EXPECT_EQ(file.scene, scene);
    EXPECT_EQ(file.images, expected);
}

TEST_F(SceneFiles, LightsAndFramesNameFilesToo)
{
    client::Images expected;
    for (const std::string name : {"1.exr", "2.exr", "e.exr", "f.exr", "l.exr", "s.exr"}) {
        expected[name] = "of " + name;
        write(name, "of " + name);
    }
    const Json scene = Json::parse(R"({"lights": [{"emission": ["1.exr", "2.exr", "1.exr"]},
        {"emission": "e.exr", "occluders": {"depth": {"front": "f.exr", "layers": ["l.exr"]}}}, 3],
        "occluders": {"depth": {"front": "s.exr"}}})");
    const client::SceneFile file = client::load_scene_file(write("scene.json", scene.dump()));
    EXPECT_EQ(file.scene, scene);
    EXPECT_EQ(file.images, expected);
}

TEST_F(SceneFiles, NamesThatClashAreToldApart)
{
    for (const std::string name : {"a/x.exr", "b/x.exr", "scene", "c/x-2.exr"}) write(name, name);
    const Json scene = client::load_scene_file(write("scene.json", R"({"light": {"emission": "a/x.exr"}, "receivers": {"depth": "b/x.exr"},
        "objects": [{"mesh": "./a/../a/x.exr"}, {"mesh": "scene"}, {"mesh": "c/x-2.exr"}]})"))
                           .scene;
    const client::Images images = client::load_scene_file(folder / "scene.json").images;
    EXPECT_EQ(images.size(), 4u); // the first and the third are one file
    EXPECT_EQ(images.at(scene.at("/light/emission"_json_pointer)), "a/x.exr");
    EXPECT_EQ(images.at(scene.at("/receivers/depth"_json_pointer)), "b/x.exr");
    EXPECT_EQ(images.at(scene.at("/objects/0/mesh"_json_pointer)), "a/x.exr");
    EXPECT_EQ(images.at(scene.at("/objects/1/mesh"_json_pointer)), "scene");
    EXPECT_EQ(images.at(scene.at("/objects/2/mesh"_json_pointer)), "c/x-2.exr");
    for (const auto& [name, bytes] : images) EXPECT_TRUE(client::is_part_name(name)) << name;
}

TEST_F(SceneFiles, NamesThatTheServiceDoesNotAllow)
{
    const std::string rest = std::string(200, 'n') + ".exr";
    const std::vector<std::pair<std::string, std::string>> cases{
        {"my depth (1).exr", "my_depth__1_.exr"}, {".hidden.exr", "hidden.exr"}, {rest, rest.substr(rest.size() - 120)}};
    for (const auto& [name, expected] : cases) {
        write(name, "x");
        const client::SceneFile file = client::load_scene_file(write("scene.json", Json{{"receivers", {{"depth", name}}}}.dump()));
        EXPECT_EQ(file.scene.at("receivers").at("depth"), expected);
        EXPECT_EQ(file.images, (client::Images{{expected, "x"}}));
    }
}

TEST_F(SceneFiles, WhatIsNoNameStays)
{
    const Json scene = Json::parse(
        R"({"light": [], "occluders": {"depth": "front.exr"}, "receivers": {"depth": 3}, "objects": {"mesh": "m.obj"}, "unknown": null})");
    const client::SceneFile file = client::load_scene_file(write("scene.json", scene.dump()));
    EXPECT_EQ(file.scene, scene);
    EXPECT_TRUE(file.images.empty());
}

TEST_F(SceneFiles, Refusals)
{
    for (const std::string& text : {std::string(), std::string("{"), std::string(R"({"a": 1, "a": 2})"), std::string(R"({"a": NaN})"),
                                    std::string(R"([{"b": {"a": 1}, "b": 2}])"), std::string("\xff{}")})
        EXPECT_THROW((void)client::load_scene_file(write("scene.json", text)), std::invalid_argument) << text;
    EXPECT_NO_THROW((void)client::load_scene_file(write("scene.json", R"([{"a": 1}, {"a": {"a": 2}}])")));
    EXPECT_THROW((void)client::load_scene_file(folder / "none.json"), std::system_error);
    EXPECT_THROW((void)client::load_scene_file(folder), std::system_error);
    EXPECT_THROW((void)client::load_scene_file(write("scene.json", R"({"receivers": {"depth": "none.exr"}})")), std::system_error);
}

TEST_F(SceneFiles, FilesOfMeshesThatTheSceneNames)
{
    write("m.gltf", R"({"buffers": [{"uri": "not looked for.bin"}]})");
    write("a b.bin", "x");
    const client::SceneFile file = client::load_scene_file(
        write("scene.json", R"({"objects": [{"mesh": "m.gltf", "files": {"n.bin": "a b.bin", "m.bin": "./a b.bin", "k": 3}}, {"files": []}]})"));
    EXPECT_EQ(file.scene, Json::parse(R"({"objects": [{"mesh": "m.gltf", "files": {"n.bin": "a_b.bin", "m.bin": "a_b.bin", "k": 3}}, {"files": []}]})"));
    EXPECT_EQ(file.images.at("a_b.bin"), "x");
}

// As long as the parser takes without looking at keys: five times leave room for that. Quadratic it took a thousand times as long.
TEST_F(SceneFiles, TakeTimeInProportionToTheText)
{
    std::string text = "[{}";
    for (int i = 1; i < 300000; ++i) text += ",{}";
    const std::filesystem::path path = write("scene.json", text += "]");
    const auto seconds = [&](const auto& read) {
        double least = 1e9;
        for (int run = 0; run < 3; ++run) {
            const auto begin = std::chrono::steady_clock::now();
            EXPECT_EQ(read().size(), 300000u);
            least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
        }
        return least;
    };
    EXPECT_LT(seconds([&] { return client::load_scene_file(path).scene; }), 5 * seconds([&] { return Json::parse(client::file_bytes(path)); }));
}

} // namespace
} // namespace penumbra::test
