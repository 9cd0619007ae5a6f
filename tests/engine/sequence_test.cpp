// A sequence of emission images: a mask for each, with all that does not depend on emission made once.
#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "engine/state.hpp"
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

// Unlike in every frame, channel and texel; channel 2 is black in frame 2.
Image frame_of(int number, int channels)
{
    Image image{.width = 3 + number, .height = 4, .channels = channels, .pixels = {}};
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < channels; ++c)
                image.pixels.push_back(number == 2 && c == 2 ? 0 : static_cast<float>((x * 7 + y * 3 + c * 5 + number * 11) % 13));
    return image;
}

RectangleLight moving(int frames, int channels)
{
    RectangleLight light = rectangle_light(0.25, 0.25);
    for (int i = 1; i <= frames; ++i) light.frames.push_back(frame_of(i, channels));
    return light;
}

Object sheet(float x0, float x1, float y0, float y1, float z)
{
    Object object{.name = "sheet", .mesh = {}, .casts = true, .receives = false};
    object.mesh.positions = {{x0, y0, -z}, {x1, y0, -z}, {x1, y1, -z}, {x0, y1, -z}};
    object.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return object;
}

Scene scene_of(const Light& light)
{
    Scene scene;
    scene.light = light;
    scene.objects = {sheet(-0.3F, 0.2F, -0.15F, 0.35F, 1), sheet(0.1F, 0.6F, -0.5F, 0.1F, 1.25F)};
    scene.receivers = receivers(light_view(), flat(40, 24, 2));
    return scene;
}

SoftShadowVolume by_table(int splits = 1)
{
    SoftShadowVolume settings;
    settings.coverage = Coverage::texture;
    settings.table = 16;
    settings.light_splits = splits;
    return settings;
}

bool has_stage(const Report& report, const std::string& name)
{
    return std::ranges::any_of(report.stages, [&](const Stage& stage) { return stage.name == name; });
}

TEST(Sequence, EachFrameHasTheBitsOfPreparingFromNothing)
{
    for (const int channels : {1, 3})
        for (const Technique& technique : {Technique(by_table()), Technique(by_table(2)), Technique(RayTraced{.samples = 64})}) {
            const Scene scene = scene_of(moving(3, channels));
            const std::vector<NamedMask> masks = engine().masks(scene, technique);
            ASSERT_EQ(masks.size(), 3u);
            for (int i = 0; i < 3; ++i) {
                const NamedMask& mask = masks[static_cast<std::size_t>(i)];
                EXPECT_EQ(mask.frame, i + 1);
                EXPECT_EQ(mask.light, "");
                EXPECT_EQ(mask.mask.visibility.channels, 3);
                EXPECT_EQ(mask.mask.visibility.pixels, engine().mask(only_frame(scene, i + 1), technique).visibility.pixels) << i;
            }
            // They show what they should: no two alike, and a shadow in each.
            EXPECT_NE(masks[0].mask.visibility.pixels, masks[1].mask.visibility.pixels);
            EXPECT_NE(masks[1].mask.visibility.pixels, masks[2].mask.visibility.pixels);
            for (const NamedMask& mask : masks) EXPECT_LT(*std::ranges::min_element(mask.mask.visibility.pixels), 0.5F);
        }
}

TEST(Sequence, SilhouettesAreMadeOnce)
{
    const Scene scene = scene_of(moving(2, 3));
    const Prepared first = engine().prepare(only_frame(scene, 1), by_table());
    const Prepared second = engine().with_emission(first, frame_of(2, 3));
    const auto& a = std::get<PreparedSoftShadowVolume>(first.state().data).parts.front();
    const auto& b = std::get<PreparedSoftShadowVolume>(second.state().data).parts.front();
    // The very buffers on the device, all but the table.
    EXPECT_EQ(a.sheets.memory()(), b.sheets.memory()());
    EXPECT_EQ(a.edges.memory()(), b.edges.memory()());
    EXPECT_EQ(a.edge_ends.memory()(), b.edge_ends.memory()());
    EXPECT_EQ(a.edge_boxes.memory()(), b.edge_boxes.memory()());
    EXPECT_EQ(a.triangle_groups.memory()(), b.triangle_groups.memory()());
    EXPECT_EQ(std::get<PreparedSoftShadowVolume>(first.state().data).triangle_rows.memory()(),
              std::get<PreparedSoftShadowVolume>(second.state().data).triangle_rows.memory()());
    EXPECT_NE(a.coverage.memory()(), b.coverage.memory()());
    for (const Stage& stage : second.state().stages) EXPECT_TRUE(stage.name == "prepare" || stage.name == "compile") << stage.name;
}

TEST(Sequence, LaterFramesReportNoTopologyAndNoDepth)
{
    const Scene objects = [] {
        Scene scene = scene_of(moving(3, 1));
        scene.receivers.depth.reset();
        Object wall = sheet(-4, 4, -4, 4, 2);
        wall.casts = false;
        wall.receives = true;
        scene.objects.push_back(wall);
        return scene;
    }();
    const std::vector<NamedMask> masks = engine().masks(objects, by_table());
    for (const char* once : {"topology", "render depth"}) {
        EXPECT_TRUE(has_stage(masks[0].mask.report, once)) << once;
        EXPECT_FALSE(has_stage(masks[1].mask.report, once)) << once;
        EXPECT_FALSE(has_stage(masks[2].mask.report, once)) << once;
    }
    for (const NamedMask& mask : masks) {
        EXPECT_TRUE(has_stage(mask.mask.report, "prepare"));
        EXPECT_GT(mask.mask.report.prepare_ms, 0);
        // What they share is counted for each.
        EXPECT_GE(mask.mask.report.peak_device_bytes, masks[0].mask.report.peak_device_bytes / 2);
    }
}

TEST(Sequence, SharedStateOutlivesTheOneItCameFrom)
{
    const Scene scene = scene_of(moving(3, 3));
    std::vector<Image> masks;
    {
        Prepared prepared = engine().prepare(only_frame(scene, 1), by_table());
        prepared = engine().with_emission(prepared, frame_of(2, 3));
        prepared = engine().with_emission(prepared, frame_of(3, 3));
        masks.push_back(engine().shade(prepared, scene.receivers).visibility);
    }
    EXPECT_EQ(masks[0].pixels, engine().mask(only_frame(scene, 3), by_table()).visibility.pixels);
}

TEST(Sequence, GreyAndColourMayFollowEachOther)
{
    const Scene scene = scene_of(moving(1, 3));
    const Prepared colour = engine().prepare(only_frame(scene, 1), by_table());
    RectangleLight grey = rectangle_light(0.25, 0.25);
    grey.emission = frame_of(3, 1);
    const Prepared then_grey = engine().with_emission(colour, *grey.emission);
    EXPECT_EQ(engine().shade(then_grey, scene.receivers).visibility.pixels, engine().mask(scene_of(grey), by_table()).visibility.pixels);
    const Prepared again = engine().with_emission(then_grey, frame_of(1, 3));
    EXPECT_EQ(engine().shade(again, scene.receivers).visibility.pixels, engine().shade(colour, scene.receivers).visibility.pixels);
}

TEST(Sequence, OfSeveralLights)
{
    Scene scene = scene_of({});
    RectangleLight still = rectangle_light(0.125, 0.125);
    still.center = {0.25, 0, 0};
    scene.lights = {{.name = "fire", .weight = 2, .light = moving(3, 3)}, {.name = "lamp", .weight = 1, .light = still}};
    scene.receivers.camera = PinholeCamera{.frame = {}, .tan_half_fov = {1, 1}};
    const std::vector<NamedMask> masks = engine().masks(scene, by_table());
    ASSERT_EQ(masks.size(), 9u);
    for (int frame = 1; frame <= 3; ++frame) {
        const NamedMask* of = &masks[static_cast<std::size_t>(frame - 1) * 3];
        EXPECT_EQ(of[0].light, "fire");
        EXPECT_EQ(of[1].light, "lamp");
        EXPECT_EQ(of[2].light, "");
        for (int i = 0; i < 3; ++i) EXPECT_EQ(of[i].frame, frame);
        EXPECT_EQ(of[1].mask.visibility.pixels, masks[1].mask.visibility.pixels); // it does not change
        EXPECT_EQ(of[0].mask.visibility.pixels, engine().mask(only_light(only_frame(scene, frame), "fire"), by_table()).visibility.pixels);
        EXPECT_EQ(of[2].mask.visibility.pixels, engine().mask(only_frame(scene, frame), by_table()).visibility.pixels);
    }
    EXPECT_GT(masks[1].mask.report.total_ms, 0);
    EXPECT_EQ(masks[4].mask.report.total_ms, 0); // given again
    EXPECT_TRUE(masks[4].mask.report.stages.empty());
}

TEST(Sequence, MasksComeOneByOne)
{
    int seen = 0;
    struct Stop {};
    EXPECT_THROW(engine().masks(scene_of(moving(3, 1)), by_table(),
                                [&](NamedMask&& mask) {
                                    EXPECT_EQ(mask.frame, ++seen);
                                    if (seen == 2) throw Stop{};
                                }),
                 Stop);
    EXPECT_EQ(seen, 2);
}

TEST(Sequence, ReportsOfAll)
{
    std::vector<FileReport> reports;
    engine().masks(scene_of(moving(2, 1)), by_table(), [&](NamedMask&& mask) {
        reports.push_back({mask.light, mask.frame, "out.exr", mask.mask.report});
    });
    reports[1].light = "lamp";
    const auto json = nlohmann::json::parse(reports_json(reports));
    ASSERT_EQ(json.at("masks").size(), 2u);
    EXPECT_TRUE(json["masks"][0].at("light").is_null());
    EXPECT_EQ(json["masks"][0].at("frame"), 1);
    EXPECT_EQ(json["masks"][1].at("light"), "lamp");
    EXPECT_EQ(json["masks"][1].at("file"), "out.exr");
    EXPECT_EQ(json["masks"][1].at("technique"), "soft_shadow_volume");
    EXPECT_TRUE(json["masks"][1].at("stages").is_array());
}

TEST(Sequence, WhatTakesOneImageSaysSo)
{
    const Scene scene = scene_of(moving(3, 1));
    for (const Error& error : {error_of([&] { engine().mask(scene, by_table()); }), error_of([&] { engine().prepare(scene, by_table()); }),
                               error_of([&] { engine().prepare(scene, RayTraced{}); })}) {
        EXPECT_EQ(error.code(), ErrorCode::usage);
        EXPECT_TRUE(holds(error.what(), "light.emission: is a sequence of 3 images, expected one")) << error.what();
    }
    const Error map = error_of([&] { engine().masks(scene, ShadowMap{}); });
    EXPECT_EQ(map.code(), ErrorCode::unsupported);
    EXPECT_TRUE(holds(map.what(), "light.emission: shadow_map cannot take a textured light")) << map.what();
    Scene both = scene;
    std::get<RectangleLight>(both.light).emission = frame_of(1, 1);
    EXPECT_TRUE(holds(error_of([&] { engine().masks(both, by_table()); }).what(), "is an image and a sequence"));
}

TEST(Sequence, EmissionNeedsWhatTakesIt)
{
    const Scene scene = scene_of(rectangle_light(0.25, 0.25));
    const Prepared analytic = engine().prepare(scene, SoftShadowVolume{});
    EXPECT_TRUE(holds(error_of([&] { engine().with_emission(analytic, frame_of(1, 1)); }).what(), "needs coverage texture"));
    const Prepared even = engine().prepare(scene, by_table()); // without a texture before
    RectangleLight lit = rectangle_light(0.25, 0.25);
    lit.emission = frame_of(1, 3);
    EXPECT_EQ(engine().shade(engine().with_emission(even, frame_of(1, 3)), scene.receivers).visibility.pixels,
              engine().mask(scene_of(lit), by_table()).visibility.pixels);
    Image black = frame_of(1, 1);
    std::ranges::fill(black.pixels, 0.0F);
    EXPECT_TRUE(holds(error_of([&] { engine().with_emission(even, black); }).what(), "light.emission: is black"));
    const Prepared ball =
        engine().prepare(scene_of(SphereLight{.center = {0, 0, 0}, .radius = 0.25, .direction = {0, 0, -1}, .up = {}}), SoftShadowVolume{});
    EXPECT_TRUE(holds(error_of([&] { engine().with_emission(ball, frame_of(1, 1)); }).what(), "expected a rectangle"));
    const Prepared map = engine().prepare(scene_of(point_light()), ShadowMap{});
    EXPECT_EQ(error_of([&] { engine().with_emission(map, frame_of(1, 1)); }).code(), ErrorCode::usage);
}

} // namespace
} // namespace penumbra::test
