// The bounds on work: ordinary work is done, and what is too much is refused, or stopped at the deadline with its slot free at once.
#include <chrono>
#include <csignal>
#include <map>
#include <string>

#include "io/image_io.hpp"
#include "server/client.hpp"
#include "server/program.hpp"

namespace penumbra::test {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::json;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

std::string file_of(const DepthMap& map) { return text_of(encode_image(image_of(map, 0, 1), {"pfm", 32})); }

// The scene with these maps and this light and technique.
std::string request_of(Json scene, const DepthMap& front, const DepthMap& floor, double half, const Json& technique)
{
    scene["light"]["half_u"] = {half, 0, 0};
    scene["light"]["half_v"] = {0, 0, -half};
    scene["technique"] = technique;
    return post(form({{"scene", scene.dump()}, {"front.exr", file_of(front)}, {"floor.exr", file_of(floor)}}));
}

// Every other texel: all edges that a map can have.
DepthMap checkers(int size)
{
    return map_of(size, size, [](int x, int y) { return (x + y) % 2 == 0 ? 1.0F : nothing_there; });
}

server::Options patient()
{
    server::Options options;
    options.deadline_s = 600;
    return options;
}

// --- What is answered ------------------------------------------------------------------------------------------------------------------

TEST(WorkBounds, AFullHdMaskOverALargeMapIsAnswered)
{
    const Running running{patient()};
    const DepthMap front = boxes(1024, 1024, 1, {{300, 700, 300, 700}});
    const Reply reply = ask(running.port, request_of(scene_json(), front, flat(1920, 1080, 2), 0.03125, {{"kind", "soft_shadow_map"}, {"sides", "front"}}));
    EXPECT_EQ(reply.status, 200) << reply.body.substr(0, 500);
}

TEST(WorkBounds, TheLargestSizesOfThePageAreAnswered)
{
    const Running running{patient()};
    Json scene = {{"penumbra", 1},
                  {"light", {{"kind", "rectangle"}, {"center", {0, 6, 0}}, {"half_u", {0.25, 0, 0}}, {"half_v", {0, 0, -0.25}}}},
                  {"objects",
                   {{{"quad", {{"center", {0, 2, 0}}, {"half_u", {0.5, 0, 0}}, {"half_v", {0, 0, -0.5}}}}},
                    {{"quad", {{"center", {0, 0, 0}}, {"half_u", {4, 0, 0}}, {"half_v", {0, 0, -4}}}}, {"casts", false}}}},
                  {"occluders", {{"resolution", {1024, 1024}}}},
                  {"receivers",
                   {{"camera", {{"kind", "pinhole"}, {"eye", {0, 8, 0}}, {"target", {0, 0, 0}}, {"up", {0, 0, -1}}, {"vertical_fov_deg", 50}}},
                    {"resolution", {1024, 1024}}}}};
    for (const char* kind : {"soft_shadow_map", "soft_shadow_volume", "smoothie", "occlusion_texture", "shadow_map"}) {
        scene["technique"] = {{"kind", kind}};
        const Reply reply = ask(running.port, post(form({{"scene", scene.dump()}})));
        EXPECT_EQ(reply.status, 200) << kind << ": " << reply.body.substr(0, 500);
    }
}

TEST(WorkBounds, APhotographAt64SamplesIsAnswered)
{
    const Running running{patient()};
    constexpr int width = 1282, height = 1110;
    const DepthMap depth = map_of(width, height, [](int x, int y) { return x > 500 && x < 700 && y > 400 && y < 700 ? 2.0F : 4.0F; });
    const Json camera = {{"kind", "pinhole"}, {"eye", {0, 0, 0}}, {"target", {0, 0, -1}}, {"vertical_fov_deg", 50}};
    const Json scene = {{"penumbra", 1},
                        {"light", {{"kind", "sphere"}, {"center", {1, 2, -1}}, {"direction", {0, -1, -1}}, {"radius", 0.1}}},
                        {"objects", {{{"depth", "view.pfm"}, {"camera", camera}, {"receives", false}}}},
                        {"receivers", {{"camera", camera}, {"depth", "view.pfm"}}},
                        {"technique", {{"kind", "depth_trace"}, {"samples", 64}}}};
    const Reply reply = ask(running.port, post(form({{"scene", scene.dump()}, {"view.pfm", file_of(depth)}})));
    EXPECT_EQ(reply.status, 200) << reply.body.substr(0, 500);
}

// --- What is not -----------------------------------------------------------------------------------------------------------------------

struct Expensive {
    const char* name;
    std::string request;
};

std::vector<Expensive> expensive()
{
    const DepthMap floor = flat(512, 512, 2), one = boxes(32, 32, 1, {{8, 24, 8, 24}});
    Json objects = scene_json();
    objects["objects"] = {{{"quad", {{"center", {0, -1, 0}}, {"half_u", {0.5, 0, 0}}, {"half_v", {0, 0, -0.5}}}}}};
    std::vector<Expensive> all;
    const auto add = [&](const char* name, const Json& scene, const DepthMap& front, const DepthMap& behind, double half, const Json& technique) {
        all.push_back({name, request_of(scene, front, behind, half, technique)});
    };
    add("soft_shadow_map", scene_json(), checkers(1024), floor, 8, {{"kind", "soft_shadow_map"}, {"preset", "paper"}, {"sides", "front"}});
    add("soft_shadow_map, union", scene_json(), checkers(1024), floor, 8, {{"kind", "soft_shadow_map"}, {"tolerance", 0}, {"sides", "front"}});
    add("soft_shadow_volume", scene_json(), checkers(256), floor, 8, {{"kind", "soft_shadow_volume"}});
    add("soft_shadow_volume, parts", scene_json(), checkers(128), floor, 8, {{"kind", "soft_shadow_volume"}, {"light_splits", 16}});
    add("smoothie", scene_json(), checkers(512), floor, 8, {{"kind", "smoothie"}});
    add("occlusion_texture", scene_json(), checkers(64), flat(2048, 2048, 2), 1,
        {{"kind", "occlusion_texture"}, {"light_splits", 16}, {"slices", 64}, {"resolution", 16}});
    add("shadow_map", scene_json(), one, flat(2048, 2048, 2), 1, {{"kind", "shadow_map"}, {"filter", "percentage_closer"}, {"taps", 63}});
    add("ray_traced", objects, one, floor, 0.25, {{"kind", "ray_traced"}, {"samples", 65536}});
    add("depth_trace", scene_json(), checkers(256), floor, 0.25, {{"kind", "depth_trace"}, {"samples", 16384}});
    return all;
}

// The deadline is 2 s from the connection. Everything is over, and the slot free for the next, when it has passed: what these ask for takes minutes.
TEST(WorkBounds, WhatIsTooMuchIsRefusedOrStopped)
{
    server::Options options;
    options.deadline_s = 2;
    options.slots = 1;
    options.queue = 0;
    const Running running{options};
    for (const Expensive& each : expensive()) {
        const auto begin = Clock::now();
        const Reply reply = ask(running.port, each.request);
        const double took = seconds_since(begin);
        std::printf("%s: %d after %.2f s\n", each.name, reply.status, took);
        EXPECT_TRUE(reply.status == 413 || reply.status == 504) << each.name << ": " << reply.status << ' ' << reply.body.substr(0, 300);
        EXPECT_LT(took, 20) << each.name;
        // The only place is free again.
        EXPECT_EQ(ask_in_time(running.port, post(form(parts()))).status, 200) << each.name;
    }
}

TEST(WorkBounds, WhatCertainlyDoesNotEndIsRefusedAtOnce)
{
    server::Options options;
    options.deadline_s = 6;
    const Running running{options};
    const std::map<std::string, std::string> keys{
        {"soft_shadow_map", "receivers.resolution"}, {"ray_traced", "technique.samples"}};
    std::size_t asked = 0;
    for (const Expensive& each : expensive()) {
        const auto key = keys.find(each.name);
        if (key == keys.end()) continue;
        ++asked;
        const Reply reply = ask(running.port, each.request);
        EXPECT_EQ(reply.status, 413) << each.name << ": " << reply.body;
        EXPECT_TRUE(holds(reply.detail(), key->second + ": would take about")) << reply.detail();
    }
    EXPECT_EQ(asked, keys.size());
}

TEST(WorkBounds, SigtermEndsWhatTakesLonger)
{
    const Program program({"--port", "0", "--deadline-s", "600", "--pairs", "1152921504606846976"});
    const int port = program.port_when_ready();
    ASSERT_NE(port, 0);
    Json scene = scene_json();
    scene["objects"] = {{{"quad", {{"center", {0, -1, 0}}, {"half_u", {0.5, 0, 0}}, {"half_v", {0, 0, -0.5}}}}}};
    Socket rays(port), body(port), idle(port);
    rays.send(request_of(scene, boxes(32, 32, 1, {{8, 24, 8, 24}}), flat(512, 512, 2), 0.25, {{"kind", "depth_trace"}, {"samples", 16384}}));
    body.send(head("Content-Length: 1000\r\n") + "--B");
    wait_for_metric(port, "penumbra_requests_computing 1");
    const auto asked = Clock::now();
    kill(program.process, SIGTERM);
    const Reply reply(rays.receive());
    EXPECT_EQ(reply.status, 503) << reply.body;
    EXPECT_TRUE(holds(reply.body, "\"ending\"")) << reply.body;
    EXPECT_EQ(program.wait(), 0);
    EXPECT_LT(seconds_since(asked), 60) << "the deadline is 600 s";
}

} // namespace
} // namespace penumbra::test
