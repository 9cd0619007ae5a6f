// Masks as a whole: warnings, the report's figures, projection, odd depths, memory and large maps.
#include <algorithm>
#include <cmath>
#include <set>

#include "support/maps.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

const SoftShadowMap front{.sides = Sides::front};

Scene scene_of(const Light& light, const Occluders& o, const Receivers& r)
{
    return {.light = light, .objects = {}, .occluders = o, .receivers = r, .technique = {}, .output = {}, .warnings = {}};
}

std::string warnings_of(const Light& light, const Occluders& o, const Receivers& r, const Technique& technique)
{
    std::string all;
    for (const std::string& warning : engine().mask(scene_of(light, o, r), technique).report.warnings) all += warning + "\n";
    return all;
}

// --- Warnings ----------------------------------------------------------------------------------------------------------------------

TEST(Warnings, ReceiversThatSeePastTheMap)
{
    const Occluders o = occluders(light_view(0.5), boxes(64, 64, 4, {{24, 40, 24, 40}}));
    const SoftShadowMap whole{.sides = Sides::front, .tolerance = 0};
    // The whole penumbra lies inside a view of a sixteenth of the map's.
    EXPECT_EQ(warnings_of(rectangle_light(0.1, 0.1), o, receivers(light_view(0.03), flat(16, 16, 8)), front), "");
    // The receivers' view is twice as wide as the map's: those outside it see the light past its border, and some of those inside.
    const std::string warning = warnings_of(rectangle_light(0.1, 0.1), o, receivers(light_view(1), flat(16, 16, 8)), whole);
    const int count = std::stoi(warning);
    EXPECT_TRUE(holds(warning, "of 256 receivers")) << warning;
    // The light's image at depth 4 is 0.1 / 2 wide each way, in a map of 2 each way: all pixels with a centre beyond 0.475 of the view.
    // Centres are at (2 i + 1) / 16: 3.8 columns and rows of 8 on either side are inside, so 8 x 8 of 256.
    EXPECT_EQ(count, 256 - 8 * 8) << warning;
    EXPECT_TRUE(holds(warnings_of(rectangle_light(0.1, 0.1), o, receivers(light_view(1), flat(16, 16, 8)), front), "receivers that were computed see part"));
    // With nothing between them and the light there is nothing to miss.
    EXPECT_EQ(warnings_of(rectangle_light(0.1, 0.1), o, receivers(light_view(1), flat(16, 16, 3)), front), "");
}

TEST(Warnings, EmptyMap)
{
    const Receivers r = receivers(light_view(), flat(8, 8, 8));
    EXPECT_TRUE(
        holds(warnings_of(rectangle_light(1, 1), occluders(light_view(), flat(8, 8, nothing_there)), r, front), "occluder map is empty"));
    EXPECT_TRUE(
        holds(warnings_of(point_light(), occluders(light_view(), flat(8, 8, nothing_there)), r, ShadowMap{}), "occluder map is empty"));
}

TEST(Warnings, ShadowMapIgnoresTheLightsExtent)
{
    const Occluders o = occluders(light_view(), boxes(8, 8, 4, {{3, 5, 3, 5}}));
    const Receivers r = receivers(light_view(), flat(8, 8, 8));
    EXPECT_TRUE(holds(warnings_of(rectangle_light(1, 1), o, r, ShadowMap{}), "extent is ignored"));
    EXPECT_EQ(warnings_of(point_light(), o, r, ShadowMap{}), "");
}

TEST(Warnings, TheScenesComeFirst)
{
    Scene scene = scene_of(rectangle_light(1, 1), occluders(light_view(), flat(8, 8, 4)), receivers(light_view(), flat(8, 8, 8)));
    scene.warnings = {"said by the scene"};
    const auto warnings = engine().mask(scene, ShadowMap{}).report.warnings;
    ASSERT_EQ(warnings.size(), 2u);
    EXPECT_EQ(warnings[0], "said by the scene");
}

// --- The report ---------------------------------------------------------------------------------------------------------------------

TEST(EngineReport, AddsUp)
{
    const Scene scene = scene_of(rectangle_light(1, 1), occluders(light_view(), flat(64, 64, 4)), receivers(light_view(), flat(48, 32, 8)));
    const Report report = engine().mask(scene, front).report;
    EXPECT_EQ(report.technique, "soft_shadow_map");
    EXPECT_EQ(report.width, 48);
    EXPECT_EQ(report.height, 32);
    EXPECT_EQ(report.device_name, engine().device().name);
    EXPECT_EQ(report.device_driver, engine().device().driver);
    EXPECT_NE(
        std::find(report.settings.begin(), report.settings.end(), std::pair{std::string("sides"), SettingValue{std::string("front")}}),
        report.settings.end());

    // prepare and shade are the stages but for compiling and rendering; no stage is told twice.
    double work = 0;
    std::vector<std::string> names;
    for (const Stage& stage : report.stages) {
        EXPECT_GE(stage.ms, 0) << stage.name;
        EXPECT_GE(stage.device_ms, 0) << stage.name;
        names.push_back(stage.name);
        if (stage.name != "compile" && stage.name != "render depth") work += stage.ms;
    }
    EXPECT_NEAR(report.prepare_ms + report.shade_ms, work, 1e-9 * work);
    EXPECT_GT(report.prepare_ms, 0);
    EXPECT_GT(report.shade_ms, 0);
    EXPECT_GE(report.total_ms, work);
    for (const char* name : {"upload occluders", "prepare", "upload receivers", "choose receivers", "shade"})
        EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());

    // A plane above all receivers: every receiver meets some texel, and no receiver more than all.
    EXPECT_GT(report.pairs, 0u);
    EXPECT_LE(report.pairs, std::uint64_t{64} * 64 * 48 * 32);
    EXPECT_GT(report.peak_device_bytes, 0u);
}

// 20 bytes a receiver (depth, place, visibility) and of the sum 20 a texel of each map (depth, texel, steps); of the union 32 (texel and steps, of the map and among all
// maps) and 4/3 of 68 (patches of every level). Their padding, and a 64th for tiles and pyramids.
TEST(EngineReport, MemoryGrowsWithTheMapsAndNoFaster)
{
    for (const auto& [texels, pixels] : {std::pair{64, 1024}, {1024, 64}, {512, 512}, {61, 93}}) {
        Occluders o = occluders(light_view(), flat(texels, texels, 4));
        o.back = o.front;
        const double padded = (pixels + 15.0) * (pixels + 7.0), map = static_cast<double>(texels) * texels;
        for (const auto& [visibility, bytes] : {std::pair{PatchVisibility::sum, 20.0}, {PatchVisibility::united, 32 + 68 * 4 / 3.0}}) {
            const SoftShadowMap technique{.visibility = visibility, .tolerance = 0};
            const Report report = engine().mask(scene_of(rectangle_light(0.01, 0.01), o, receivers(light_view(), flat(pixels, pixels, 8))), technique).report;
            EXPECT_LE(static_cast<double>(report.peak_device_bytes), (20 * padded + 2 * bytes * map) * (1 + 1.0 / 64) + 4096) << texels << ", " << pixels;
            EXPECT_GE(static_cast<double>(report.peak_device_bytes), 4.0 * pixels * pixels);
        }
    }
}

// --- Depth ---------------------------------------------------------------------------------------------------------------------------

TEST(Depth, WhatIsNoDepthIsNothing)
{
    const float odd[] = {std::numeric_limits<float>::quiet_NaN(), -1.0f, 0.0f, -0.0f, -nothing_there};
    DepthMap occluder = random_map(33, 33, 2, 4, 0.4, 1), receiver = random_map(33, 33, 3, 8, 0.4, 2), odd_occluder = occluder,
             odd_receiver = receiver;
    std::size_t n = 0;
    for (DepthMap* map : {&odd_occluder, &odd_receiver})
        for (float& depth : map->depth)
            if (!std::isfinite(depth)) depth = odd[n++ % 5];
    for (const Technique& technique :
         {Technique(front), Technique(SoftShadowMap{.sides = Sides::front, .resolution = 10}), Technique(ShadowMap{})}) {
        const Mask a =
            engine().mask(scene_of(rectangle_light(1, 1), occluders(light_view(), occluder), receivers(light_view(), receiver)), technique);
        const Mask b = engine().mask(
            scene_of(rectangle_light(1, 1), occluders(light_view(), odd_occluder), receivers(light_view(), odd_receiver)), technique);
        EXPECT_EQ(a.visibility.pixels, b.visibility.pixels);
        for (std::size_t i = 0; i < receiver.depth.size(); ++i)
            if (!std::isfinite(receiver.depth[i])) {
                EXPECT_EQ(a.visibility.pixels[i], 1.0f);
            }
    }
}

// --- Projection (3.1) -------------------------------------------------------------------------------------------------------------------

// The light-space mask, sampled from another camera, is the direct one but for the bilinear sampling: visibility has slopes of up to K per
// unit of xi and per axis, so a kink between two samples h apart is off by at most K h / 4 per axis.
TEST(Project, IsCloseToTheDirectMask)
{
    const Occluders o = occluders(light_view(), boxes(64, 64, 4, {{20, 44, 24, 40}}));
    const PinholeCamera camera{.frame = {.origin = {1, 0.5, 0}}, .tan_half_fov = {0.6, 0.6}};
    const Scene scene = scene_of(rectangle_light(1, 1), o, receivers(camera, flat(64, 64, 8)));
    const int resolution = 256;
    const Mask direct = engine().mask(scene, front);
    const Mask projected = engine().mask(scene, SoftShadowMap{.sides = Sides::front, .project = true, .project_resolution = resolution});
    const double K = 0.5 / (1 / 4.0 - 1 / 8.0), h = 2.0 / resolution;
    // The receivers' own depth, seen from the light, ends at its outermost pixels' centres.
    int penumbra = 0;
    for (int y = 3; y < 61; ++y)
        for (int x = 3; x < 61; ++x) {
            EXPECT_NEAR(projected.visibility.at(x, y), direct.visibility.at(x, y), 2 * K * h / 4 + 1e-4) << x << ", " << y;
            penumbra += direct.visibility.at(x, y) > 0 && direct.visibility.at(x, y) < 1;
        }
    EXPECT_GT(penumbra, 500);
    EXPECT_NE(projected.visibility.pixels, direct.visibility.pixels);
}

// --- Large maps -------------------------------------------------------------------------------------------------------------------------

TEST(LargeMaps, SixteenMillionReceiversAndFourMillionTexels)
{
    const int texels = 2048, pixels = 4096;
    const TexelBox box{500, 1500, 700, 1300};
    const Mask mask = engine().mask(scene_of(rectangle_light(0.002, 0.002), occluders(light_view(), boxes(texels, texels, 4, {box})),
                                             receivers(light_view(), flat(pixels, pixels, 8))),
                                    front);
    ASSERT_EQ(mask.visibility.pixels.size(), std::size_t{4096} * 4096);
    // Half a light's image (0.002 a side, at depth 4 of 4 across) is one texel, two pixels: beyond that it is umbra and lit.
    std::size_t wrong = 0;
    for (int y = 0; y < pixels; ++y)
        for (int x = 0; x < pixels; ++x) {
            const float v = mask.visibility.at(x, y);
            const bool in = x >= 2 * box.x0 + 3 && x < 2 * box.x1 - 3 && y >= 2 * box.y0 + 3 && y < 2 * box.y1 - 3;
            const bool out = x < 2 * box.x0 - 3 || x >= 2 * box.x1 + 3 || y < 2 * box.y0 - 3 || y >= 2 * box.y1 + 3;
            // Shares of some four patches round to within 2^-19 each.
            wrong += in ? v > 4 * 0x1p-19f : out && v != 1.0f;
        }
    EXPECT_EQ(wrong, 0u);
    EXPECT_LT(mask.report.peak_device_bytes, std::uint64_t{512} << 20);
}

} // namespace
} // namespace penumbra::test
