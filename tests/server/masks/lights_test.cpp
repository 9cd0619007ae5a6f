// Masks of scenes with several lights and with sequences: one an answer, chosen by the query.
#include <algorithm>

#include "server/client.hpp"

namespace penumbra::test {
namespace {

using Json = nlohmann::json;

constexpr const char* pfm = "Accept: image/x-portable-floatmap\r\n";

Json panel(double x, const Json& more = Json::object())
{
    Json light = {{"kind", "rectangle"}, {"center", {x, 6, 0}}, {"half_u", {0.5, 0, 0}}, {"half_v", {0, 0, -0.5}}};
    light.update(more);
    return light;
}

Json quad(double y, double half) { return {{"center", {0, y, 0}}, {"half_u", {half, 0, 0}}, {"half_v", {0, 0, -half}}}; }

// A quad over a floor under these lights, seen by a camera of its own.
Json scene_of(const Json& lights)
{
    return {{"penumbra", 1},
            {lights.is_array() ? "lights" : "light", lights},
            {"objects", {{{"quad", quad(2, 0.5)}, {"receives", false}}, {{"quad", quad(0, 4)}, {"casts", false}}}},
            {"receivers",
             {{"camera", {{"kind", "pinhole"}, {"eye", {0, 8, 0}}, {"target", {0, 0, 0}}, {"up", {0, 0, -1}}, {"vertical_fov_deg", 50}}},
              {"resolution", {24, 20}}}},
            {"technique", {{"kind", "soft_shadow_volume"}, {"coverage", "texture"}}}};
}

Parts form_of(const Json& scene)
{
    Parts parts{{"scene", scene.dump()}};
    for (int i = 0; i < 3; ++i) {
        Image image{.width = 2, .height = 2, .channels = 3, .pixels = std::vector<float>(12, 0.125F)};
        image.at(i % 2, i / 2, i) = 1;
        parts.emplace_back("f" + std::to_string(i + 1) + ".exr", text_of(encode_image(image, {"exr", 32})));
    }
    return parts;
}

const Json frames = {"f1.exr", "f2.exr", "f3.exr"};

// POST PATH with the query, the form and PFM back.
Reply ask_mask(int port, const std::string& query, const Json& scene, const std::string& headers = {},
               const std::string& path = "/v1/masks")
{
    const std::string request = post(form(form_of(scene)), pfm + headers);
    return ask(port, "POST " + path + query + request.substr(request.find(" HTTP/1.1")));
}

std::string mask_of(int port, const std::string& query, const Json& scene)
{
    const Reply reply = ask_mask(port, query, scene);
    EXPECT_EQ(reply.status, 200) << query << ": " << reply.body;
    return reply.body;
}

std::string keep(int port, const Json& scene) { return Json::parse(ask_mask(port, "", scene, {}, "/v1/scenes").body).at("id"); }

Reply kept_mask(int port, const std::string& id, const std::string& query, const Json& patch = Json::object())
{
    const std::string body = patch.dump();
    return ask(port, "POST /v1/scenes/" + id + "/masks" + query + " HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" +
                         pfm + length_of(body) + "\r\n" + body);
}

void expect_refused(const Reply& reply, const std::string& reason, const std::string& part)
{
    EXPECT_EQ(reply.status, 400) << reply.body;
    EXPECT_EQ(Json::parse(reply.body).value("reason", ""), reason);
    EXPECT_NE(reply.detail().find(part), std::string::npos) << reply.detail();
}

TEST(LightsOverHttp, AllTogetherOrOne)
{
    const int port = shared_port();
    const Json scene = scene_of({panel(-1, {{"name", "lamp"}}), panel(1, {{"weight", 3}})});
    const std::string all = mask_of(port, "", scene), lamp = mask_of(port, "?light=lamp", scene), second = mask_of(port, "?light=2", scene);
    // A light by itself is as in a scene of its own: the first one to the bit.
    EXPECT_EQ(lamp, mask_of(port, "", scene_of(panel(-1))));
    const std::size_t pixels = 24 * 20 * sizeof(float);
    ASSERT_EQ(all.size(), lamp.size());
    const auto at = [&](const std::string& mask, std::size_t i) {
        float value = 0;
        std::memcpy(&value, mask.data() + mask.size() - pixels + i * sizeof(float), sizeof(float));
        return value;
    };
    for (std::size_t i = 0; i < 24 * 20; ++i)
        EXPECT_EQ(at(all, i), static_cast<float>((1.0 * at(lamp, i) + 3.0 * at(second, i)) / 4.0)) << i;
    EXPECT_NE(all, lamp);
    EXPECT_NE(lamp, second);
}

TEST(LightsOverHttp, WhatThereIsNot)
{
    const int port = shared_port();
    const Json two = scene_of({panel(-1, {{"name", "lamp"}}), panel(1)}), one = scene_of(panel(0)),
               moving = scene_of(panel(0, {{"emission", frames}}));
    expect_refused(ask_mask(port, "?light=sun", two), "no_light", "expected one of lamp, 2");
    expect_refused(ask_mask(port, "?light=lamp", one), "no_light", "its only one has no name");
    expect_refused(ask_mask(port, "?light=a%20b", two), "no_light", "is no name");
    expect_refused(ask_mask(port, "?light=", two), "no_light", "is no name");
    expect_refused(ask_mask(port, "?light=lamp&light=2", two), "query", "twice");
    expect_refused(ask_mask(port, "?lihgt=lamp", two), "query", "known: light, frame");
    expect_refused(ask_mask(port, "?frame=1", two), "no_frame", "has no sequence");
    expect_refused(ask_mask(port, "", moving), "no_frame", "sequence of 3 images");
    for (const std::string frame : {"0", "-1", "x", "1.5", "", "4097", "99999999999999999999", "1e0"})
        expect_refused(ask_mask(port, "?frame=" + frame, moving), "no_frame", "expected 1 to 4096");
    expect_refused(ask_mask(port, "?frame=4", moving), "no_frame", "sequence of 3 images");
    // Of the scene itself: as on the command line.
    const Reply both = ask_mask(port, "", [&] {
        Json scene = two;
        scene["light"] = panel(0);
        return scene;
    }());
    EXPECT_EQ(both.status, 422);
    EXPECT_NE(both.detail().find("lights: stands beside light"), std::string::npos) << both.detail();
}

TEST(LightsOverHttp, AFrameOfASequence)
{
    const int port = shared_port();
    const Json moving = scene_of(panel(0, {{"emission", frames}}));
    std::string before;
    for (int frame = 1; frame <= 3; ++frame) {
        const std::string mask = mask_of(port, "?frame=" + std::to_string(frame), moving);
        EXPECT_EQ(mask, mask_of(port, "", scene_of(panel(0, {{"emission", frames[static_cast<std::size_t>(frame - 1)]}}))));
        EXPECT_NE(mask, before);
        before = mask;
    }
    // A light that does not change needs no frame.
    const Json with_lamp = scene_of({panel(0, {{"name", "fire"}, {"emission", frames}}), panel(1, {{"name", "lamp"}})});
    EXPECT_EQ(mask_of(port, "?light=lamp", with_lamp), mask_of(port, "?light=lamp&frame=2", with_lamp));
    expect_refused(ask_mask(port, "?light=fire", with_lamp), "no_frame", "sequence of 3 images");
}

TEST(LightsOverHttp, TagsTellThemApart)
{
    const int port = shared_port();
    const Json scene = scene_of({panel(-1, {{"name", "fire"}, {"emission", frames}}), panel(1, {{"name", "lamp"}})});
    std::vector<std::string> tags;
    for (const std::string query : {"?frame=1", "?frame=2", "?light=fire&frame=1", "?light=fire&frame=2", "?light=lamp"})
        tags.push_back(ask_mask(port, query, scene).header("ETag"));
    for (const std::string& tag : tags) EXPECT_EQ(std::ranges::count(tags, tag), 1) << tag;
    EXPECT_EQ(ask_mask(port, "?light=lamp", scene, "If-None-Match: " + tags[4] + "\r\n").status, 304);
    EXPECT_EQ(ask_mask(port, "?frame=2", scene, "If-None-Match: " + tags[0] + "\r\n").status, 200);
}

TEST(LightsOverHttp, KeptScenesGiveTheSame)
{
    const int port = shared_port();
    const Json scene = scene_of({panel(-1, {{"name", "fire"}, {"emission", frames}}), panel(1, {{"name", "lamp"}})});
    const std::string id = keep(port, scene);
    // In any order, and again: prepared frames and lights are not taken for each other.
    for (const std::string query :
         {"?frame=2", "?frame=1", "?light=fire&frame=3", "?light=lamp", "?light=fire&frame=1", "?frame=3", "?frame=2"})
        EXPECT_EQ(kept_mask(port, id, query).body, mask_of(port, query, scene)) << query;
    expect_refused(kept_mask(port, id, ""), "no_frame", "sequence of 3 images");
    expect_refused(kept_mask(port, id, "?light=sun&frame=1"), "no_light", "fire, lamp");

    // The silhouettes of a sequence are made once.
    const auto stages = [&](const std::string& query) { return kept_mask(port, id, query).header("Server-Timing"); };
    EXPECT_EQ(stages("?light=fire&frame=2").find("topology"), std::string::npos);
}

TEST(LightsOverHttp, PatchesReplaceTheList)
{
    const int port = shared_port();
    const Json scene = scene_of({panel(-1), panel(1)});
    const std::string id = keep(port, scene);
    const Json three = {panel(-1), panel(0, {{"name", "middle"}, {"weight", 0.5}}), panel(1, {{"name", "right"}})};
    EXPECT_EQ(kept_mask(port, id, "", {{"lights", three}}).body, mask_of(port, "", scene_of(three)));
    EXPECT_EQ(kept_mask(port, id, "?light=middle", {{"lights", three}}).body, mask_of(port, "?light=middle", scene_of(three)));
    EXPECT_EQ(kept_mask(port, id, "").body, mask_of(port, "", scene)); // for that request only
    // One light instead of a list, and the other way round.
    EXPECT_EQ(kept_mask(port, id, "", {{"lights", nullptr}, {"light", panel(-1)}}).body, mask_of(port, "", scene_of(panel(-1))));
    const std::string single = keep(port, scene_of(panel(-1)));
    EXPECT_EQ(kept_mask(port, single, "", {{"light", nullptr}, {"lights", scene["lights"]}}).body, mask_of(port, "", scene));
    EXPECT_EQ(kept_mask(port, single, "", {{"lights", scene["lights"]}}).status, 422); // beside light
    const Reply seen = kept_mask(port, id, "", {{"receivers", {{"camera", {{"kind", "light"}}}}}});
    EXPECT_EQ(seen.status, 422);
    EXPECT_NE(seen.detail().find("receivers.camera: is the light's own"), std::string::npos) << seen.detail();
    const Reply lengths =
        kept_mask(port, id, "?frame=1", {{"lights", {panel(-1, {{"emission", frames}}), panel(1, {{"emission", {"f1.exr"}}})}}});
    EXPECT_EQ(lengths.status, 422);
    EXPECT_NE(lengths.detail().find("lights[1].emission: has 1 frames"), std::string::npos) << lengths.detail();
}

TEST(LightsOverHttp, AllLightsCountAsWork)
{
    const auto status = [](server::Options options, const Json& scene, const std::string& query, const std::string& part) {
        const Running running{std::move(options)};
        const Reply reply = ask_mask(running.port, query, scene);
        EXPECT_NE(reply.body.find(part), std::string::npos) << reply.head;
        return reply.status;
    };
    Json scene = scene_of({panel(-1), panel(1)});
    server::Options pixels;
    pixels.receivers = 24 * 20;
    EXPECT_EQ(status(pixels, scene, "", "over all lights"), 413);
    EXPECT_EQ(status(pixels, scene, "?light=2", ""), 200);
    scene["technique"] = {{"kind", "ray_traced"}, {"samples", 4}};
    server::Options rays;
    rays.rays = 24 * 20 * 4;
    EXPECT_EQ(status(rays, scene, "", "technique.samples"), 413);
    EXPECT_EQ(status(rays, scene, "?light=2", ""), 200);
}

TEST(LightsOverHttp, TheDescriptionHasTheQuery)
{
    const Json document = Json::parse(get(shared_port(), "/openapi.json").body);
    for (const std::string path : {"/v1/masks", "/v1/scenes/{id}/masks"}) {
        const Json& parameters = document.at("paths").at(path).at("post").at("parameters");
        for (const std::string name : {"light", "frame"})
            EXPECT_TRUE(std::ranges::any_of(parameters, [&](const Json& each) { return each["name"] == name && each["in"] == "query"; }))
                << path;
    }
}

} // namespace
} // namespace penumbra::test
