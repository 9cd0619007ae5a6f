// image=bound: the lowest and the highest visibility of each pixel, over HTTP.
#include <algorithm>
#include <span>

#include <penumbra/mask_job.hpp>
#include <penumbra/scene_file.hpp>

#include "server/client.hpp"

namespace penumbra::test {
namespace {

using Json = nlohmann::json;

constexpr const char* exr = "Accept: image/x-exr\r\n";

// A wall at depth 2 with a square before it at depth 1, as one camera sees them, under a lamp beside that camera.
Parts seen(const Json& technique = {{"kind", "depth_trace"}, {"samples", 16}})
{
    DepthMap depth = flat(side, side, 2);
    for (std::size_t y = 10; y < 20; ++y)
        for (std::size_t x = 12; x < 22; ++x) depth.depth[y * side + x] = 1;
    const Json camera = {{"kind", "pinhole"}, {"eye", {0, 0, 0}}, {"target", {0, 0, -1}}, {"up", {0, 1, 0}}, {"vertical_fov_deg", 60}};
    const Json scene = {{"penumbra", 1},
                        {"light", {{"kind", "sphere"}, {"center", {-1, 0.5, -0.25}}, {"direction", {0.5, -0.25, -1}}, {"radius", 0.125}}},
                        {"objects", {{{"depth", "view.exr"}, {"camera", camera}}}},
                        {"receivers", {{"camera", camera}, {"depth", "view.exr"}}},
                        {"technique", technique}};
    return {{"scene", scene.dump()}, {"view.exr", text_of(encode_depth(depth))}};
}

std::string library_bound(const Parts& all)
{
    const Engine engine;
    const Scene scene = parse_scene(all.front().second, PartResources(all));
    MaskJob job = job_of(scene, technique_from(scene.technique));
    job.bound = true;
    Image bound;
    engine.masks(job, {}, [&](NamedMask&& named) { bound = std::move(named.mask.bound); });
    return text_of(encode_image(bound, {.format = "exr", .bits = 32, .channels = {"low", "high"}}));
}

Reply ask_at(const std::string& path, const std::string& request, int port = shared_port())
{
    return ask(port, "POST " + path + request.substr(request.find(" HTTP/1.1")));
}

Reply ask_image(const std::string& image, const Parts& all, const std::string& headers = exr, int port = shared_port())
{
    return ask_at("/v1/masks?image=" + image, post(form(all), headers), port);
}

TEST(BoundOverHttp, TheLibrarysBytesInEveryWay)
{
    const Parts all = seen();
    const std::string expected = library_bound(all);
    for (const char* accept : {exr, "", "Accept: */*\r\n", "Accept: image/png, image/*;q=0.5\r\n"}) {
        const Reply reply = ask_image("bound", all, accept);
        ASSERT_EQ(reply.status, 200) << accept << reply.body;
        EXPECT_EQ(reply.header("Content-Type"), "image/x-exr");
        EXPECT_TRUE(reply.body == expected) << accept;
        EXPECT_TRUE(holds(reply.header("Server-Timing"), "bound;dur=")) << reply.header("Server-Timing");
    }
    // Somewhere nobody knows, and nowhere is the lowest above the highest. An EXR file has its channels by name: high, low.
    const Image bound = decode_image(std::as_bytes(std::span(expected)), "bound");
    ASSERT_EQ(bound.channels, 2);
    double unknown = 0;
    for (std::size_t i = 0; i < bound.pixel_count(); ++i) {
        EXPECT_LE(bound.pixels[2 * i + 1], bound.pixels[2 * i]);
        unknown += bound.pixels[2 * i] - bound.pixels[2 * i + 1];
    }
    EXPECT_GT(unknown, 0);

    // A kept scene has the same, and image=mask is what comes without it.
    const std::string id = Json::parse(ask_at("/v1/scenes", post(form(all))).body).at("id");
    const std::string kept = "/v1/scenes/" + id + "/masks", empty = head("Content-Length: 0\r\n" + std::string(exr), "application/json");
    EXPECT_TRUE(ask_at(kept + "?image=bound", empty).body == expected);
    const Reply mask = ask_at(kept, empty);
    EXPECT_EQ(mask.status, 200) << mask.body;
    EXPECT_TRUE(ask_at(kept + "?image=mask", empty).body == mask.body);
    EXPECT_TRUE(ask_image("mask", all).body == mask.body);
}

// error_estimate=true: the library's, as a header; the mask stays the same.
TEST(BoundOverHttp, AndTheErrorEstimate)
{
    const Parts all = seen();
    const Reply mask = ask_at("/v1/masks", post(form(all), exr)), estimated = ask_at("/v1/masks?error_estimate=true", post(form(all), exr));
    ASSERT_EQ(estimated.status, 200) << estimated.body;
    EXPECT_TRUE(estimated.body == mask.body);
    EXPECT_EQ(mask.header("Penumbra-Error-Estimate"), "");
    EXPECT_NE(mask.header("ETag"), estimated.header("ETag"));
    const Json found = Json::parse(estimated.header("Penumbra-Error-Estimate"));
    EXPECT_EQ(found.at("by"), "rays");
    EXPECT_GT(found.at("mean").get<double>(), 0);
    EXPECT_GE(found.at("p99").get<double>(), found.at("mean").get<double>());
    EXPECT_EQ(ask_at("/v1/masks?error_estimate=1", post(form(all), exr)).status, 400);
}

TEST(BoundOverHttp, WhatIsRefused)
{
    const auto expect_refused = [](const Reply& reply, int status, const std::string& reason, const std::string& part) {
        EXPECT_EQ(reply.status, status) << reply.body;
        EXPECT_EQ(reply.header("Content-Type"), "application/problem+json");
        EXPECT_EQ(Json::parse(reply.body).value("reason", ""), reason);
        EXPECT_TRUE(holds(reply.detail(), part)) << reply.detail();
    };
    for (const std::string image : {"", "Bound", "bounds", "low", "mask%20"})
        expect_refused(ask_image(image, seen()), 400, "no_image", "expected mask or bound");
    expect_refused(ask_image("bound&image=mask", seen()), 400, "query", "twice");
    expect_refused(ask_image("bound&imagine=1", seen()), 400, "query", "known: light, frame, image, error_estimate");
    for (const char* accept : {"Accept: image/png\r\n", "Accept: image/x-portable-floatmap, image/x-exr;q=0\r\n"})
        expect_refused(ask_image("bound", seen(), accept), 406, "not_acceptable", "image/x-exr");
    // As the library says it, before anything is computed.
    expect_refused(ask_image("bound", seen({{"kind", "soft_shadow_map"}, {"sides", "front"}})), 422, "unsupported",
                   "soft_shadow_map has no bounds");
}

TEST(BoundOverHttp, ItHasATagOfItsOwn)
{
    const std::string mask = ask_image("mask", seen()).header("ETag"), bound = ask_image("bound", seen()).header("ETag");
    EXPECT_NE(mask, bound);
    EXPECT_EQ(ask_image("bound", seen(), exr + ("If-None-Match: " + bound + "\r\n")).status, 304);
    EXPECT_EQ(ask_image("bound", seen(), exr + ("If-None-Match: " + mask + "\r\n")).status, 200);
}

TEST(BoundOverHttp, ItCountsAsMoreWork)
{
    server::Options options;
    options.rays = side * side * 16;
    const Running running{options};
    EXPECT_EQ(ask_image("mask", seen(), exr, running.port).status, 200);
    const Reply refused = ask_image("bound", seen(), exr, running.port);
    EXPECT_EQ(refused.status, 413) << refused.body;
    EXPECT_TRUE(holds(refused.detail(), "technique.samples")) << refused.detail();
}

TEST(BoundOverHttp, TheDescriptionHasIt)
{
    const Json document = Json::parse(get(shared_port(), "/openapi.json").body);
    for (const std::string path : {"/v1/masks", "/v1/scenes/{id}/masks"}) {
        const Json& parameters = document.at("paths").at(path).at("post").at("parameters");
        const auto found = std::ranges::find_if(parameters, [](const Json& each) { return each["name"] == "image"; });
        ASSERT_NE(found, parameters.end()) << path;
        EXPECT_EQ(found->at("schema").at("enum"), (Json{"mask", "bound"}));
    }
    const Json techniques = Json::parse(get(shared_port(), "/v1/techniques").body).at("techniques");
    for (const Json& technique : techniques) {
        const bool traced = technique["kind"] == "depth_trace" || technique["kind"] == "ray_traced";
        EXPECT_EQ(technique.at("bounds"), traced) << technique["kind"];
    }
}

} // namespace
} // namespace penumbra::test
