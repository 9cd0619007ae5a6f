// penumbra mask --server, against the real service and one that answers by script.
#include <algorithm>

#include <nlohmann/json.hpp>

#include <penumbra/image.hpp>

#include "clients/fake_service.hpp"
#include "clients/server_program.hpp"
#include "command.hpp"

namespace penumbra::test {
namespace {

const Environment with_token{{"PENUMBRA_SERVER_TOKEN", server_token}};

class RemoteMaskCommand : public CommandTest {
protected:
    static Ran remote(Arguments arguments, const Environment& environment = with_token, const std::vector<std::string>& options = {})
    {
        arguments.insert(arguments.end(), {"--server", shared_server(options)});
        return penumbra(arguments, environment);
    }
    // write_scene's, through depth images in a folder: what a service takes.
    std::string write_depth_scene(const std::string& technique = R"({"kind": "soft_shadow_map"})")
    {
        const Ran ran = penumbra({"depth", write_scene("objects.json", technique), "--out", path("depth")});
        EXPECT_EQ(ran.code, 0) << ran.err;
        return path("depth/scene.json");
    }
    // A camera's depth image under another light, of 256 x 256 pixels, and a picture of that size.
    std::string write_relit_scene()
    {
        const Ran ran = penumbra({"depth", PENUMBRA_EXAMPLES "/04_relight_depth_view.json", "--out", path("view")});
        EXPECT_EQ(ran.code, 0) << ran.err;
        write_text(path("scene.json"), text_of(PENUMBRA_EXAMPLES "/04_relight_depth.json"));
        return path("scene.json");
    }
    std::string write_picture()
    {
        Image picture{.width = 256, .height = 256, .channels = 3, .pixels = {}};
        for (int i = 0; i < 256 * 256 * 3; ++i) picture.pixels.push_back(static_cast<float>(i % 251) / 250);
        write_image(path("picture.png"), picture, {.format = "png", .bits = 8});
        return path("picture.png");
    }
};

TEST_F(RemoteMaskCommand, TheSameBytesAsHere)
{
    for (const std::string& scene : {write_scene("scene.json"), write_depth_scene()}) {
        const Ran local = penumbra({"mask", scene, "-o", path("local.pfm")});
        EXPECT_EQ(local.code, 0) << local.err;
        const Ran ran = remote({"mask", scene, "-o", path("remote.pfm")});
        EXPECT_EQ(ran.code, 0) << ran.err;
        EXPECT_EQ(ran.out, "");
        EXPECT_EQ(ran.err, local.err); // the same warnings
        expect_same_bytes(path("local.pfm"), path("remote.pfm"));
    }
    EXPECT_LT(std::ranges::min(read_image(path("remote.pfm")).pixels), 0.5f); // there is a shadow
}

TEST_F(RemoteMaskCommand, OtherFormatsHoldTheSamePixels)
{
    const std::string scene = write_scene("scene.json", R"({"kind": "soft_shadow_map"})", R"(, "output": {"format": "png", "bits": 8})");
    for (const std::string name : {"mask.exr", "mask.tif", "mask.png"}) {
        EXPECT_EQ(penumbra({"mask", scene, "-o", path("local-" + name)}).code, 0);
        EXPECT_EQ(remote({"mask", scene, "-o", path(name)}).code, 0);
        EXPECT_EQ(read_image(path(name)).pixels, read_image(path("local-" + name)).pixels) << name;
    }
    EXPECT_EQ(text_of(path("mask.png")).at(24), 8); // the scene's bits
}

TEST_F(RemoteMaskCommand, FlagsReplaceTheScenes)
{
    const std::string scene = write_scene("scene.json", R"({"kind": "soft_shadow_map", "sides": "front", "bias": 2})");
    const Arguments flags{"--set", "sides=both", "--set", "resolution=32"};
    Arguments here{"mask", scene, "-o", path("local.pfm")}, there{"mask", scene, "-o", path("remote.pfm"), "--report", path("report.json")};
    here.insert(here.end(), flags.begin(), flags.end());
    there.insert(there.end(), flags.begin(), flags.end());
    EXPECT_EQ(penumbra(here).code, 0);
    EXPECT_EQ(remote(there).code, 0);
    expect_same_bytes(path("local.pfm"), path("remote.pfm"));

    const auto report = nlohmann::json::parse(text_of(path("report.json")));
    EXPECT_EQ(report.at("technique"), "soft_shadow_map");
    EXPECT_EQ(report.at("settings"), (nlohmann::json{{"sides", "both"}, {"resolution", 32}, {"bias", 2}}));
    EXPECT_EQ(report.at("resolution"), (std::vector<int>{40, 31}));
    EXPECT_FALSE(report.at("device").at("name").get<std::string>().empty());
    EXPECT_FALSE(report.at("stages").empty());
    EXPECT_GT(report.at("round_trip_ms").get<double>(), 0);

    const Ran other = remote({"mask", scene, "-o", path("other.pfm"), "--technique", "shadow_map"});
    EXPECT_EQ(other.code, 0);
    EXPECT_TRUE(other.err.starts_with("penumbra: warning: ")) << other.err; // the light's extent is ignored
    EXPECT_NE(text_of(path("other.pfm")), text_of(path("remote.pfm")));
}

TEST_F(RemoteMaskCommand, FilesOfOneName)
{
    const std::string scene = write_depth_scene();
    nlohmann::json json = nlohmann::json::parse(text_of(scene));
    for (nlohmann::json* name : {&json["occluders"]["depth"]["front"], &json["receivers"]["depth"]}) {
        const std::string folder = path(name == &json["receivers"]["depth"] ? "r" : "o");
        ASSERT_EQ(std::system(("mkdir " + folder).c_str()), 0);
        write_text(folder + "/depth.exr", text_of(path("depth/" + name->get<std::string>())));
        *name = folder + "/depth.exr";
    }
    json["occluders"]["depth"]["back"] = "depth/" + json["occluders"]["depth"]["back"].get<std::string>();
    write_text(path("moved.json"), json.dump());
    EXPECT_EQ(penumbra({"mask", path("moved.json"), "-o", path("local.pfm")}).code, 0);
    const Ran ran = remote({"mask", path("moved.json"), "-o", path("remote.pfm")});
    EXPECT_EQ(ran.code, 0) << ran.err;
    expect_same_bytes(path("local.pfm"), path("remote.pfm"));
}

TEST_F(RemoteMaskCommand, BoundAndPreviewAsHere)
{
    const std::string scene = write_relit_scene();
    const auto with_all = [&](const std::string& name) {
        return Arguments{"mask",   scene,           "-o",        path(name + ".pfm"),     "--bound", path(name + "-bound.exr"),
                         "--over", write_picture(), "--preview", path(name + "-over.png")};
    };
    const Ran local = penumbra(with_all("local"));
    EXPECT_EQ(local.code, 0) << local.err;
    const Ran ran = remote(with_all("remote"));
    EXPECT_EQ(ran.code, 0) << ran.err;
    for (const std::string name : {".pfm", "-bound.exr", "-over.png"}) expect_same_bytes(path("local" + name), path("remote" + name));
    const Image bound = read_image(path("remote-bound.exr"));
    EXPECT_EQ(bound.channels, 2);
    EXPECT_LT(std::ranges::min(bound.pixels), 0.5f);
}

TEST_F(RemoteMaskCommand, NothingIsWrittenWhereBoundOrPreviewFail)
{
    const std::string scene = write_relit_scene();
    const auto none_written = [&] {
        return std::ranges::none_of(files(), [](const std::string& name) { return name.starts_with("mask") || name.starts_with("b."); });
    };
    // The library's words, here and there.
    for (const bool there : {false, true}) {
        const Arguments unbounded{"mask", scene, "-o", path("mask.pfm"), "--bound", path("b.exr"), "--technique", "soft_shadow_map"};
        expect_one_error(there ? remote(unbounded) : penumbra(unbounded), 2, {"scene.json", "soft_shadow_map has no bounds"});
        write_image(path("small.png"), Image{.width = 3, .height = 2, .channels = 3, .pixels = std::vector<float>(18, 1.f)},
                    {.format = "png", .bits = 8});
        const Arguments small{"mask", scene, "-o", path("mask.pfm"), "--over", path("small.png"), "--preview", path("mask.png")};
        expect_one_error(there ? remote(small) : penumbra(small), 2, {"small.png: is 3 x 2", "256 x 256"});
        const Arguments lost{"mask", scene, "-o", path("mask.pfm"), "--over", path("none.png"), "--preview", path("mask.png")};
        expect_one_error(there ? remote(lost) : penumbra(lost), 2, {"none.png"});
        EXPECT_TRUE(none_written());
    }
    // A service from before it had bounds.
    FakeService old({problem(400, "query")});
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.pfm"), "--bound", path("b.exr"), "--server", old.url}), 2, {"the detail"});
    EXPECT_TRUE(none_written());
}

TEST_F(RemoteMaskCommand, WhatTheServiceRefuses)
{
    const std::string scene = write_scene("scene.json");
    expect_one_error(remote({"mask", scene, "-o", path("mask.pfm")}, {}), 2, {"--server http://", "PENUMBRA_SERVER_TOKEN"});
    expect_one_error(remote({"mask", scene, "-o", path("mask.pfm")}, {{"PENUMBRA_SERVER_TOKEN", "another-secret-1"}}), 2, {"token"});

    write_text(path("t.obj"), "v -1 2 -1\nv 1 2 -1\nv 0 2 1\nf 1 2 3\n");
    std::string text = text_of(scene);
    text.replace(text.find("\"quad\": { \"center\": [0.25"), 1, "\"mesh\": \"t.obj\", \"");
    text.erase(text.find("\"quad\""), text.find(", \"casts\": true") - text.find("\"quad\"") + 2);
    write_text(path("mesh.json"), text);
    EXPECT_EQ(penumbra({"mask", path("mesh.json"), "-o", path("local.pfm")}).code, 0);
    expect_one_error(remote({"mask", path("mesh.json"), "-o", path("mask.pfm")}), 2, {"mesh.json", "--allow-meshes"});

    write_text(path("bad.json"), R"({"penumbra": 1, "light": {"kind": "cube"}})");
    expect_one_error(remote({"mask", path("bad.json"), "-o", path("mask.pfm")}), 2, {"bad.json: light.kind"});
    write_text(path("mask.pfm"), "from before");
    expect_one_error(remote({"mask", path("bad.json"), "-o", path("mask.pfm")}), 2, {});
    EXPECT_EQ(text_of(path("mask.pfm")), "from before");
}

TEST_F(RemoteMaskCommand, MeshesWhereTheServiceTakesThem)
{
    write_text(path("t.obj"), "v -1 2 -1\nv 1 2 -1\nv 0 2 1\nf 1 2 3\n");
    write_text(path("scene.json"), R"({"penumbra": 1,
        "light": {"kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5]},
        "objects": [{"mesh": "t.obj", "receives": false},
                    {"quad": {"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]}, "casts": false}],
        "receivers": {"resolution": [40, 31]}})");
    EXPECT_EQ(penumbra({"mask", path("scene.json"), "-o", path("local.pfm")}).code, 0);
    const Ran ran = remote({"mask", path("scene.json"), "-o", path("remote.pfm")}, with_token, {"--allow-meshes"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    expect_same_bytes(path("local.pfm"), path("remote.pfm"));
}

TEST_F(RemoteMaskCommand, WrongUsageIsFoundBeforeAnythingIsSent)
{
    const std::string scene = write_scene("scene.json");
    const auto at = [&](const std::string& url, const std::string& mask, const Arguments& more = {}) {
        Arguments arguments{"mask", scene, "-o", path(mask), "--server", url};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return penumbra(arguments);
    };
    const std::string nobody = "http://127.0.0.1:1";
    expect_one_error(at("127.0.0.1:1", "mask.pfm"), 2, {"--server", "http://HOST"});
    expect_one_error(at(nobody, "mask.hdr"), 2, {"mask.hdr", ".exr"});
    expect_one_error(at(nobody, "mask.jpg"), 2, {"mask.jpg"});
    expect_one_error(at(nobody, "mask.pfm", {"--device", "0"}), 2, {"--device", "--server"});
    expect_one_error(at(nobody, "mask.pfm", {"--set", "sides=top"}), 2, {"--set sides=top"});
    expect_one_error(at(nobody, "mask.pfm", {"--technique", "magic"}), 2, {"magic"});
    expect_one_error(penumbra({"mask", path("none.json"), "-o", path("mask.pfm"), "--server", nobody}), 2, {"none.json"});
    write_text(path("lost.json"), R"({"penumbra": 1, "receivers": {"depth": "lost.exr"}})");
    expect_one_error(penumbra({"mask", path("lost.json"), "-o", path("mask.pfm"), "--server", nobody}), 2, {"lost.json", "lost.exr"});
    write_text(path("twice.json"), R"({"penumbra": 1, "penumbra": 1})");
    expect_one_error(penumbra({"mask", path("twice.json"), "-o", path("mask.pfm"), "--server", nobody}), 2, {"twice.json", "penumbra"});
}

TEST_F(RemoteMaskCommand, WorkThatFails)
{
    const std::string scene = write_scene("scene.json");
    const auto expect_failure = [&](const std::string& reply, const std::vector<std::string>& said, int asked = 1) {
        FakeService fake(std::vector<FakeService::Answer>(static_cast<std::size_t>(asked), reply));
        std::vector<std::string> parts{"--server " + fake.url};
        parts.insert(parts.end(), said.begin(), said.end());
        expect_one_error(penumbra({"mask", scene, "-o", path("mask.pfm"), "--server", fake.url}), 1, parts);
    };
    expect_failure(problem(500, "internal"), {"500: the detail"});
    expect_failure(problem(504, "deadline"), {"504: the detail"});
    expect_failure("", {"connection broke"}, 2);
    expect_failure(answer(200, "<html>", "Content-Type: text/html\r\n"), {"text/html"});
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.pfm"), "--server", "http://127.0.0.1:1"}), 1, {"nobody answers"});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));
}

TEST_F(RemoteMaskCommand, AsksOnceMoreWhereTheConnectionBroke)
{
    const std::string scene = write_scene("scene.json");
    FakeService fake({std::string(), mask_answer()});
    const Ran ran = penumbra({"mask", scene, "-o", path("mask.pfm"), "--server", fake.url});
    EXPECT_EQ(ran.code, 0) << ran.err;
    fake.finish();
    EXPECT_EQ(fake.requests.size(), 2U);
    EXPECT_EQ(read_image(path("mask.pfm")).pixels, (std::vector<float>{0.25F, 1}));
}

} // namespace
} // namespace penumbra::test
