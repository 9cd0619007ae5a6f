// Scenes with several lights and with sequences: what mask, batch, depth and --server write.
#include <filesystem>

#include <nlohmann/json.hpp>

#include <penumbra/image.hpp>

#include "clients/server_program.hpp"
#include "command.hpp"

namespace penumbra::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using Names = std::vector<std::string>;

class LightsCommand : public CommandTest {
protected:
    // A quad over a floor under these lights, seen by a camera of its own.
    std::string write_lights(const std::string& name, const Json& lights, const std::string& technique = "soft_shadow_volume")
    {
        const auto quad = [](double y, double half) {
            return Json{{"center", {0, y, 0}}, {"half_u", {half, 0, 0}}, {"half_v", {0, 0, -half}}};
        };
        Json scene = {
            {"penumbra", 1},
            {"objects", {{{"quad", quad(2, 0.5)}, {"receives", false}}, {{"quad", quad(0, 4)}, {"casts", false}}}},
            {"occluders", {{"resolution", {32, 32}}}},
            {"receivers",
             {{"camera", {{"kind", "pinhole"}, {"eye", {0, 8, 0}}, {"target", {0, 0, 0}}, {"up", {0, 0, -1}}, {"vertical_fov_deg", 50}}},
              {"resolution", {24, 20}}}},
            {"technique", {{"kind", technique}}}};
        if (technique == "soft_shadow_volume") scene["technique"]["coverage"] = "texture";
        scene[lights.is_array() ? "lights" : "light"] = lights;
        write_text(path(name), scene.dump());
        return path(name);
    }

    static Json panel(double x, const Json& more = Json::object())
    {
        Json light = {{"kind", "rectangle"}, {"center", {x, 6, 0}}, {"half_u", {0.5, 0, 0}}, {"half_v", {0, 0, -0.5}}};
        light.update(more);
        return light;
    }

    // Images of one bright texel each, at another place.
    Json write_frames(int count)
    {
        Json names = Json::array();
        for (int i = 0; i < count; ++i) {
            Image image{.width = 2, .height = 2, .channels = 3, .pixels = std::vector<float>(12, 0.125F)};
            image.at(i % 2, i / 2, i % 3) = 1;
            names.push_back("frame" + std::to_string(i + 1) + ".pfm");
            write_image(path(names.back()), image);
        }
        return names;
    }

    Image image(const std::string& name) const { return read_image(path(name)); }
    void expect_done(const Ran& ran)
    {
        EXPECT_EQ(ran.code, 0) << ran.err;
        EXPECT_EQ(ran.out, "");
    }
};

const Environment with_token{{"PENUMBRA_SERVER_TOKEN", server_token}};

TEST_F(LightsCommand, AFileForEachLightAndOneForAll)
{
    const std::string scene = write_lights("s.json", {panel(-1, {{"name", "lamp"}}), panel(1, {{"weight", 3}})});
    expect_done(penumbra({"mask", scene, "-o", path("m.pfm"), "--report", path("r.json")}));
    EXPECT_EQ(files(), (Names{"m.2.pfm", "m.lamp.pfm", "m.pfm", "r.json", "s.json"}));
    const Image lamp = image("m.lamp.pfm"), other = image("m.2.pfm"), all = image("m.pfm");
    EXPECT_NE(lamp.pixels, other.pixels);
    for (std::size_t i = 0; i < all.pixels.size(); ++i)
        EXPECT_EQ(all.pixels[i], static_cast<float>((1.0 * lamp.pixels[i] + 3.0 * other.pixels[i]) / 4.0));

    const Json masks = Json::parse(text_of(path("r.json"))).at("masks");
    ASSERT_EQ(masks.size(), 3u);
    EXPECT_EQ(masks[0].at("light"), "lamp");
    EXPECT_EQ(masks[0].at("file"), path("m.lamp.pfm"));
    EXPECT_TRUE(masks[0].at("frame").is_null());
    EXPECT_TRUE(masks[2].at("light").is_null());
    EXPECT_EQ(masks[2].at("file"), path("m.pfm"));
    EXPECT_EQ(masks[2].at("technique"), "soft_shadow_volume");
}

TEST_F(LightsCommand, OneLightAlone)
{
    const std::string scene = write_lights("s.json", {panel(-1, {{"name", "lamp"}}), panel(1)});
    expect_done(penumbra({"mask", scene, "-o", path("m.pfm")}));
    expect_done(penumbra({"mask", scene, "-o", path("one.pfm"), "--light", "lamp", "--report", path("r.json")}));
    EXPECT_EQ(image("one.pfm").pixels, image("m.lamp.pfm").pixels);
    EXPECT_FALSE(fs::exists(path("one.lamp.pfm")));
    EXPECT_FALSE(Json::parse(text_of(path("r.json"))).contains("masks")); // a report as of any scene
    expect_one_error(penumbra({"mask", scene, "-o", path("x.pfm"), "--light", "lamb"}), 2, {"--light", "lamb", "there are: lamp, 2"});
    expect_one_error(penumbra({"mask", scene, "-o", path("x.pfm"), "--frame", "1"}), 2, {"--frame", "no sequence"});
    expect_one_error(penumbra({"mask", write_scene("plain.json"), "-o", path("x.pfm"), "--light", "lamp"}), 2,
                     {"--light", "without a name"});
    EXPECT_FALSE(fs::exists(path("x.pfm")));
}

TEST_F(LightsCommand, AFileForEachFrame)
{
    const std::string scene = write_lights("s.json", panel(0, {{"emission", write_frames(3)}}));
    expect_done(penumbra({"mask", scene, "-o", path("m.pfm"), "--report", path("r.json")}));
    EXPECT_FALSE(fs::exists(path("m.pfm")));
    EXPECT_EQ(Json::parse(text_of(path("r.json"))).at("masks").at(2).at("frame"), 3);
    for (int frame = 1; frame <= 3; ++frame) {
        const std::string number = std::to_string(frame);
        expect_done(penumbra({"mask", scene, "-o", path("one.pfm"), "--frame", number}));
        EXPECT_EQ(image("one.pfm").pixels, image("m.000" + number + ".pfm").pixels);
        EXPECT_EQ(image("one.pfm").channels, 3);
    }
    EXPECT_NE(image("m.0001.pfm").pixels, image("m.0002.pfm").pixels);
    expect_one_error(penumbra({"mask", scene, "-o", path("x.pfm"), "--frame", "4"}), 2, {"--frame", "no frame 4", "1 to 3"});
    EXPECT_EQ(penumbra({"mask", scene, "-o", path("x.pfm"), "--frame", "0"}).code, 2);
}

TEST_F(LightsCommand, LightsAndFrames)
{
    const std::string scene =
        write_lights("s.json", {panel(-1, {{"name", "fire"}, {"emission", write_frames(2)}}), panel(1, {{"name", "lamp"}})});
    expect_done(penumbra({"mask", scene, "-o", path("m.pfm")}));
    for (const std::string frame : {"0001", "0002"})
        for (const std::string light : {".", ".fire.", ".lamp."})
            EXPECT_TRUE(fs::exists(path("m" + light + frame + ".pfm"))) << light << frame;
    EXPECT_EQ(image("m.lamp.0001.pfm").pixels, image("m.lamp.0002.pfm").pixels);
    EXPECT_NE(image("m.0001.pfm").pixels, image("m.0002.pfm").pixels);

    expect_done(penumbra({"mask", scene, "-o", path("f.pfm"), "--frame", "2"}));
    EXPECT_EQ(image("f.pfm").pixels, image("m.0002.pfm").pixels);
    EXPECT_EQ(image("f.fire.pfm").pixels, image("m.fire.0002.pfm").pixels);
    expect_done(penumbra({"mask", scene, "-o", path("g.pfm"), "--frame", "2", "--light", "fire"}));
    EXPECT_EQ(image("g.pfm").pixels, image("m.fire.0002.pfm").pixels);
    expect_done(penumbra({"mask", scene, "-o", path("h.pfm"), "--light", "fire"}));
    EXPECT_EQ(image("h.0002.pfm").pixels, image("m.fire.0002.pfm").pixels);
}

TEST_F(LightsCommand, NoMaskReplacesWhatTheSceneIsMadeFrom)
{
    write_frames(2);
    fs::rename(path("frame2.pfm"), path("m.lamp.pfm"));
    const std::string scene =
        write_lights("s.json", {panel(-1, {{"name", "lamp"}}), panel(1, {{"emission", Json::array({"m.lamp.pfm"})}, {"name", "tv"}})});
    // Of one frame alone the lamp's mask is m.lamp.pfm.
    expect_one_error(penumbra({"mask", scene, "-o", path("m.pfm"), "--frame", "1"}, no_device), 2, {"would replace", "m.lamp.pfm"});
    expect_one_error(penumbra({"mask", scene, "-o", path("n.pfm"), "--report", path("n.tv.0001.pfm")}, no_device), 2,
                     {"--report", "same file"});
}

TEST_F(LightsCommand, BatchNamesAndResumesThemAll)
{
    fs::create_directory(path("scenes"));
    write_lights("scenes/a.json", {panel(-1, {{"name", "lamp"}}), panel(1)});
    write_scene("scenes/b.json");
    const Arguments batch{"batch", path("scenes"), "--out", path("out"), "--format", "pfm", "--resume"};
    EXPECT_EQ(penumbra(batch).code, 0);
    EXPECT_EQ(files("out"), (Names{"a.2.pfm", "a.lamp.pfm", "a.pfm", "b.pfm", "manifest.jsonl"}));
    const Json first = Json::parse(text_of(path("out/manifest.jsonl")).substr(0, text_of(path("out/manifest.jsonl")).find('\n')));
    EXPECT_EQ(first.at("outputs"), (Json{path("out/a.lamp.pfm"), path("out/a.2.pfm"), path("out/a.pfm")}));

    // One of its masks is gone: the scene is not done.
    fs::remove(path("out/a.2.pfm"));
    EXPECT_EQ(penumbra(batch).code, 0);
    EXPECT_TRUE(fs::exists(path("out/a.2.pfm")));
    const std::string manifest = text_of(path("out/manifest.jsonl"));
    EXPECT_NE(manifest.find("\"done\""), std::string::npos) << manifest;
    EXPECT_NE(manifest.find("\"skipped\""), std::string::npos) << manifest;
    EXPECT_EQ(penumbra(batch).code, 0);
    EXPECT_EQ(text_of(path("out/manifest.jsonl")).find("\"done\""), std::string::npos);

    // Another scene's mask under the name of a light's.
    write_scene("scenes/a.lamp.json");
    expect_one_error(penumbra(batch), 2, {"would both write", "a.lamp.pfm"});
}

TEST_F(LightsCommand, DepthOfEachLightGivesTheSameMasks)
{
    const std::string scene = write_lights("s.json", {panel(-1, {{"name", "lamp"}}), panel(1)}, "soft_shadow_map");
    expect_done(penumbra({"depth", scene, "--out", path("d")}));
    EXPECT_EQ(files("d"), (Names{"back.2.exr", "back.lamp.exr", "front.2.exr", "front.lamp.exr", "receiver.exr", "scene.json"}));
    expect_done(penumbra({"mask", scene, "-o", path("m.pfm")}));
    expect_done(penumbra({"mask", path("d/scene.json"), "-o", path("n.pfm")}));
    for (const std::string of : {"", ".lamp", ".2"}) expect_alike(path("m" + of + ".pfm"), path("n" + of + ".pfm"));
}

TEST_F(LightsCommand, TheServiceGivesTheSameBytes)
{
    const ServerProgram server;
    const std::string scene =
        write_lights("s.json", {panel(-1, {{"name", "fire"}, {"emission", write_frames(2)}}), panel(1, {{"name", "lamp"}})});
    expect_done(penumbra({"mask", scene, "-o", path("m.pfm")}));
    expect_done(penumbra({"mask", scene, "-o", path("r.pfm"), "--server", server.url, "--report", path("r.json")}, with_token));
    for (const std::string of : {".0001", ".fire.0001", ".lamp.0001", ".0002", ".fire.0002", ".lamp.0002"})
        expect_same_bytes(path("m" + of + ".pfm"), path("r" + of + ".pfm"));
    EXPECT_EQ(Json::parse(text_of(path("r.json"))).at("masks").size(), 6u);
    expect_done(penumbra({"mask", scene, "-o", path("o.pfm"), "--server", server.url, "--light", "fire", "--frame", "2"}, with_token));
    expect_same_bytes(path("m.fire.0002.pfm"), path("o.pfm"));
    expect_one_error(penumbra({"mask", scene, "-o", path("x.pfm"), "--server", server.url, "--light", "sun"}, with_token), 2,
                     {"none named sun", "fire, lamp"});
}

} // namespace
} // namespace penumbra::test
