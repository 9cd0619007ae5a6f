// What a mask is estimated to take before most of it is computed, against what was counted: within a factor of ten, either way.
#include <cstdio>

#include <penumbra/mask_job.hpp>
#include <penumbra/stop.hpp>

#include "support/casters.hpp"
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

// A light of half-extent `half` over a map of `side` texels, and receivers behind it.
Scene scene_of_maps(double half, DepthMap front, DepthMap behind)
{
    Scene scene;
    scene.light = rectangle_light(half, half);
    scene.receivers = {.camera = light_view(), .width = behind.width, .height = behind.height, .depth = {}};
    scene.receivers.depth = std::move(behind);
    scene.occluders = occluders(light_view(), front);
    scene.occluders.back = std::move(front);
    return scene;
}

// One texel of `step` x `step`.
DepthMap sparse(int side, int step, float depth)
{
    return map_of(side, side, [=](int x, int y) { return x % step == 0 && y % step == 0 ? depth : nothing_there; });
}

// A fence of posts before the light, one texel wide.
DepthMap fence(int side, int step, float depth)
{
    return map_of(side, side, [=](int x, int) { return x % step == 0 ? depth : nothing_there; });
}

DepthMap half_empty(int side, float depth)
{
    return map_of(side, side, [=](int x, int y) { return x + y < side ? depth : nothing_there; });
}

// Receivers on a slope.
DepthMap slope(int width, int height, float near, float far)
{
    return map_of(width, height, [=](int, int y) { return near + (far - near) * static_cast<float>(y) / static_cast<float>(height); });
}

Scene scene_of_boxes(int count, double half, int side)
{
    Scene scene = scene_of_maps(half, flat(4, 4, 1), slope(side, side, 3, 6));
    scene.occluders = {.camera = light_view(), .width = 256, .height = 256, .front = {}, .back = {}, .layers = {}};
    for (int i = 0; i < count; ++i) {
        const double x = -1.4 + 2.8 * (i % 7) / 6, y = -1.4 + 2.8 * (i / 7) / 6, size = 0.02 + 0.02 * (i % 3);
        scene.objects.push_back({.name = "box", .mesh = closed_box({x - size, y - size, 1.9}, {x + size, y + size, 2.1}), .casts = true, .receives = false});
    }
    return scene;
}

struct Case {
    const char* name;
    Scene scene;
    Technique technique;
};

std::vector<Case> cases()
{
    const auto map = [](Sides sides) { return SoftShadowMap{.sides = sides}; };
    std::vector<Case> all;
    const Scene spread = scene_of_maps(0.3, boxes(256, 256, 1, {{60, 180, 90, 200}}), flat(320, 200, 2));
    const Scene small = scene_of_maps(0.05, boxes(256, 256, 1, {{100, 140, 100, 140}}), flat(480, 270, 2));
    const Scene dots = scene_of_maps(0.5, sparse(256, 8, 1), flat(240, 240, 3));
    const Scene posts = scene_of_maps(0.4, fence(192, 6, 1), slope(256, 200, 1.5, 5));
    const Scene noise = scene_of_maps(0.4, random_map(128, 128, 0.8, 4, 0.3, 7), flat(256, 256, 3));
    const Scene holes = scene_of_maps(0.3, boxes(128, 128, 1, {{30, 90, 30, 90}}), half_empty(256, 2));
    const Scene full = scene_of_maps(0.03125, boxes(1024, 1024, 1, {{300, 700, 300, 700}}), flat(1920, 1080, 2));
    const Scene quiet = scene_of_maps(0.3, flat(128, 128, 4), flat(256, 256, 2));
    const Scene few = scene_of_boxes(3, 0.2, 256), many = scene_of_boxes(49, 0.4, 256), huge = scene_of_boxes(49, 2, 160);
    all.push_back({"a square, soft", spread, map(Sides::front)});
    all.push_back({"a square, both sides", spread, map(Sides::both)});
    all.push_back({"a small square", small, map(Sides::front)});
    all.push_back({"dots", dots, map(Sides::front)});
    all.push_back({"a fence", posts, map(Sides::front)});
    all.push_back({"noise", noise, map(Sides::front)});
    all.push_back({"receivers in half", holes, map(Sides::front)});
    all.push_back({"full HD, map of 1024", full, map(Sides::front)});
    all.push_back({"all behind", quiet, map(Sides::front)});
    all.push_back({"49 boxes", many, map(Sides::front)});
    all.push_back({"3 boxes", few, SoftShadowVolume{}});
    all.push_back({"49 boxes", many, SoftShadowVolume{}});
    all.push_back({"49 boxes, 9 parts", many, SoftShadowVolume{.light_splits = 3}});
    all.push_back({"a huge light", huge, SoftShadowVolume{}});
    all.push_back({"dots as casters", dots, SoftShadowVolume{}});
    all.push_back({"49 boxes", many, Smoothie{}});
    all.push_back({"a huge light", huge, Smoothie{}});
    all.push_back({"dots as casters", dots, Smoothie{}});
    all.push_back({"49 boxes", many, OcclusionTexture{.resolution = 64}});
    all.push_back({"a square", spread, OcclusionTexture{.slices = 16, .resolution = 64}});
    all.push_back({"49 boxes", many, ShadowMap{.filter = ShadowFilter::percentage_closer, .taps = 5}});
    all.push_back({"49 boxes", many, RayTraced{.samples = 16}});
    all.push_back({"49 boxes, adaptive", many, RayTraced{.samples = 64, .adaptive = true, .first_samples = 4}});
    all.push_back({"receivers in half", holes, DepthTrace{.samples = 16}});
    return all;
}

TEST(WorkEstimate, IsWithinTenTimesOfWhatIsCounted)
{
    const Engine engine;
    std::printf("| technique | scene | at most | estimated | counted | estimated / counted |\n| --- | --- | --- | --- | --- | --- |\n");
    for (const Case& c : cases()) {
        const MaskJob job = job_of(c.scene, c.technique);
        double estimated = -1;
        std::string unit;
        std::uint64_t counted = 0;
        engine.masks(job, {.keeper = nullptr,
                           .before = {},
                           .estimated =
                               [&](const WorkAmount& work) {
                                   estimated = work.amount;
                                   unit = work.what;
                               }},
                     [&](NamedMask&& named) { counted = named.mask.report.pairs; });
        const double most = work_of(job).front().amount;
        std::printf("| `%s` | %s | %.2g | %.3g | %.3g | %.2f |\n", std::string(kind_of(c.technique)).c_str(), c.name, most, estimated,
                    static_cast<double>(counted), estimated / std::max(1.0, static_cast<double>(counted)));
        ASSERT_GE(estimated, 0) << c.name << ": nobody asked";
        // Where there is nothing to do, nothing is estimated.
        if (counted == 0) {
            EXPECT_EQ(estimated, 0) << c.name;
            continue;
        }
        EXPECT_LE(estimated, 10 * static_cast<double>(counted)) << c.name << ' ' << unit;
        EXPECT_GE(10 * estimated, static_cast<double>(counted)) << c.name << ' ' << unit;
        EXPECT_GE(most * 1.01, static_cast<double>(counted)) << c.name << ": more than at most";
    }
}

// The hook and the sample change no bit.
TEST(WorkEstimate, LeavesTheMaskAsItIs)
{
    const Engine engine;
    for (const Case& c : cases()) {
        const MaskJob job = job_of(c.scene, c.technique);
        std::vector<float> plain, watched, stoppable;
        engine.masks(job, {}, [&](NamedMask&& named) { plain = std::move(named.mask.visibility.pixels); });
        engine.masks(job, {.keeper = nullptr, .before = {}, .estimated = [](const WorkAmount&) {}},
                     [&](NamedMask&& named) { watched = std::move(named.mask.visibility.pixels); });
        const Stop stop;
        const StopScope scope(stop);
        engine.masks(job, {}, [&](NamedMask&& named) { stoppable = std::move(named.mask.visibility.pixels); });
        EXPECT_EQ(plain, watched) << c.name << ' ' << kind_of(c.technique);
        EXPECT_EQ(plain, stoppable) << c.name << ' ' << kind_of(c.technique);
    }
}

} // namespace
} // namespace penumbra::test
