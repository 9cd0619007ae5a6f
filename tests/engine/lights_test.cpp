// Several lights in one scene: each one's mask, and that of all together.
#include <algorithm>
#include <cmath>

#include "engine/weighted_mean.hpp"
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

// Its centre is a multiple of 1/8, as all coordinates here.
RectangleLight panel(double x, double half = 0.5)
{
    return {.center = {x, 6, 0}, .half_u = {half, 0, 0}, .half_v = {0, 0, -half}, .emission = {}};
}

SceneLight named(const std::string& name, const Light& light, double weight = 1)
{
    return {.name = name, .weight = weight, .light = light};
}

Object quad(double y, double half, bool casts)
{
    Object object{.name = "quad", .mesh = {}, .casts = casts, .receives = !casts};
    const auto h = static_cast<float>(half), at = static_cast<float>(y);
    object.mesh.positions = {{-h, at, h}, {h, at, h}, {h, at, -h}, {-h, at, -h}};
    object.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return object;
}

// A quad over a floor, seen from above and aside.
Scene scene_of(const std::vector<SceneLight>& lights)
{
    Scene scene;
    scene.lights = lights;
    scene.objects = {quad(2, 1, true), quad(0, 4, false)};
    const double a = std::sqrt(0.5);
    const Frame frame{.origin = {0, 5, 5}, .x = {1, 0, 0}, .y = {0, a, -a}, .z = {0, a, a}};
    scene.receivers = {.camera = PinholeCamera{.frame = frame, .tan_half_fov = {0.5, 0.5}}, .width = 48, .height = 32, .depth = {}};
    return scene;
}

// The receivers' depth in place: what is left of the objects are silhouettes, which no hierarchy rounds.
Scene with_receivers(Scene scene)
{
    scene.receivers = with_depth(scene, ShadowMap{}).receivers;
    return scene;
}

Image image_of(const std::vector<float>& pixels, int channels = 1)
{
    return {.width = static_cast<int>(pixels.size()) / channels, .height = 1, .channels = channels, .pixels = pixels};
}

// --- The mean ------------------------------------------------------------------------------------------------------------------------

TEST(WeightedMeanOfMasks, ByHand)
{
    WeightedMean mean;
    mean.add(image_of({1, 0, 0.5F}), 1);
    mean.add(image_of({1, 1, 0.25F}), 3);
    EXPECT_EQ(mean.take().pixels, (std::vector<float>{1, 0.75F, 0.3125F}));
}

TEST(WeightedMeanOfMasks, GreyStandsForThreeChannels)
{
    const Image grey = image_of({0.5F, 1}), colour = image_of({0, 0.5F, 1, 1, 1, 0}, 3);
    WeightedMean before, after;
    before.add(grey, 1);
    before.add(colour, 1);
    after.add(colour, 1);
    after.add(grey, 1);
    const std::vector<float> expected{0.25F, 0.5F, 0.75F, 1, 1, 0.5F};
    EXPECT_EQ(before.take().pixels, expected);
    EXPECT_EQ(before.take().channels, 3);
    EXPECT_EQ(after.take().pixels, expected);
}

TEST(WeightedMeanOfMasks, OneLightIsItselfAndWhatIsLitStaysLit)
{
    // 0.1 is no float and no double: nothing here is exact by luck.
    std::vector<float> values;
    for (int i = 0; i < 1000; ++i) values.push_back(static_cast<float>(i) / 999.0F);
    WeightedMean one, lit;
    one.add(image_of(values), 0.1);
    EXPECT_EQ(one.take().pixels, values);
    for (const double weight : {0.1, 0.7, 1e-9, 3e5}) lit.add(image_of({1, 1, 1}), weight);
    EXPECT_EQ(lit.take().pixels, (std::vector<float>{1, 1, 1}));
}

// --- Masks ---------------------------------------------------------------------------------------------------------------------------

TEST(Lights, EachInOrderThenAllTogether)
{
    const std::vector<NamedMask> masks = engine().masks(scene_of({named("a", panel(-1)), named("b", panel(1), 3)}), SoftShadowVolume{});
    ASSERT_EQ(masks.size(), 3u);
    EXPECT_EQ(masks[0].light, "a");
    EXPECT_EQ(masks[1].light, "b");
    EXPECT_EQ(masks[2].light, "");
    for (const NamedMask& mask : masks) EXPECT_EQ(mask.frame, 0);
    EXPECT_NE(masks[0].mask.visibility.pixels, masks[1].mask.visibility.pixels);
    const std::vector<float>&a = masks[0].mask.visibility.pixels, &b = masks[1].mask.visibility.pixels;
    for (std::size_t i = 0; i < a.size(); ++i)
        EXPECT_EQ(masks[2].mask.visibility.pixels[i], static_cast<float>((1.0 * a[i] + 3.0 * b[i]) / 4.0)) << i;
    // The caster hides some of either light.
    EXPECT_LT(*std::ranges::min_element(a), 0.5F);
    EXPECT_LT(*std::ranges::min_element(b), 0.5F);
}

TEST(Lights, MaskOfTheSceneIsTheOneTogether)
{
    const Scene scene = scene_of({named("a", panel(-1)), named("b", panel(1), 3)});
    for (const Technique& technique : {Technique(SoftShadowVolume{}), Technique(SoftShadowMap{}), Technique(RayTraced{.samples = 16})})
        EXPECT_EQ(engine().mask(scene, technique).visibility.pixels, engine().masks(scene, technique).back().mask.visibility.pixels);
}

TEST(Lights, EachHasTheBitsOfASceneOfItsOwn)
{
    const Scene scene = with_receivers(
        scene_of({named("a", panel(-1)), named("b", SphereLight{.center = {1, 5, 1}, .radius = 0.5, .direction = {0, -1, 0}, .up = {}}),
                  named("c", PointLight{.center = {0.5, 7, 0}, .direction = {0, -1, 0}, .up = {}})}));
    const std::vector<NamedMask> masks = engine().masks(scene, SoftShadowVolume{});
    for (std::size_t i = 0; i < scene.lights.size(); ++i)
        EXPECT_EQ(masks[i].mask.visibility.pixels,
                  engine().mask(only_light(scene, scene.lights[i].name), SoftShadowVolume{}).visibility.pixels)
            << scene.lights[i].name;
}

TEST(Lights, TheFirstHasTheBitsOfASceneOfItsOwnWithHierarchiesToo)
{
    const Scene scene = scene_of({named("a", panel(-1)), named("b", panel(1))});
    for (const Technique& technique : {Technique(SoftShadowMap{}), Technique(ShadowMap{}), Technique(RayTraced{.samples = 64})})
        EXPECT_EQ(engine().masks(scene, technique)[0].mask.visibility.pixels,
                  engine().mask(only_light(scene, "a"), technique).visibility.pixels);
}

TEST(Lights, MapsOfEachAreItsOwn)
{
    // Depth maps alone: one light's caster is none of the other's.
    const RectangleLight light = rectangle_light(0.25, 0.25);
    Scene scene;
    scene.lights = {named("a", light), named("b", light)};
    scene.lights[0].occluders = occluders(light_view(), boxes(16, 16, 2, {{4, 8, 4, 12}}));
    scene.lights[1].occluders = occluders(light_view(), boxes(16, 16, 2, {{8, 12, 4, 12}}));
    const SoftShadowMap front{.sides = Sides::front};
    scene.receivers = receivers(PinholeCamera{.frame = {}, .tan_half_fov = {0.5, 0.5}}, flat(16, 16, 4));
    const std::vector<NamedMask> masks = engine().masks(scene, front);
    for (std::size_t i = 0; i < 2; ++i) {
        Scene one = scene;
        one.lights.clear();
        one.light = light;
        one.occluders = *scene.lights[i].occluders;
        EXPECT_EQ(masks[i].mask.visibility.pixels, engine().mask(one, front).visibility.pixels) << i;
    }
    EXPECT_NE(masks[0].mask.visibility.pixels, masks[1].mask.visibility.pixels);
}

TEST(Lights, WeightZeroIsSeenAloneAndCountsNothing)
{
    const Scene scene = scene_of({named("a", panel(-1), 0), named("b", panel(1), 0.3)});
    const std::vector<NamedMask> masks = engine().masks(scene, SoftShadowVolume{});
    EXPECT_EQ(masks[2].mask.visibility.pixels, masks[1].mask.visibility.pixels);
    EXPECT_NE(masks[0].mask.visibility.pixels, masks[1].mask.visibility.pixels);
}

TEST(Lights, ATexturedOneMakesThreeChannelsTogether)
{
    RectangleLight fire = panel(1);
    fire.emission = image_of({1, 0, 0.5F, 0, 1, 0.5F}, 3);
    const std::vector<NamedMask> masks =
        engine().masks(scene_of({named("a", panel(-1)), named("b", fire)}), SoftShadowVolume{.coverage = Coverage::texture});
    EXPECT_EQ(masks[0].mask.visibility.channels, 1);
    EXPECT_EQ(masks[1].mask.visibility.channels, 3);
    ASSERT_EQ(masks[2].mask.visibility.channels, 3);
    for (std::size_t i = 0; i < masks[2].mask.visibility.pixels.size(); ++i)
        EXPECT_EQ(masks[2].mask.visibility.pixels[i],
                  static_cast<float>((1.0 * masks[0].mask.visibility.pixels[i / 3] + masks[1].mask.visibility.pixels[i]) / 2.0));
}

TEST(Lights, ReportsSayWhoseWarningAndWork)
{
    Scene scene = scene_of({named("a", panel(-1)), named("b", panel(1))});
    scene.warnings = {"of the file"};
    const std::vector<NamedMask> masks = engine().masks(scene, ShadowMap{});
    const std::string ignored = "shadow_map takes the light as a point at its centre: its extent is ignored";
    EXPECT_EQ(masks[0].mask.report.warnings, (std::vector<std::string>{"of the file", ignored}));
    EXPECT_EQ(masks[2].mask.report.warnings, (std::vector<std::string>{"of the file", "a: " + ignored, "b: " + ignored}));
    EXPECT_EQ(masks[2].mask.report.prepare_ms, masks[0].mask.report.prepare_ms + masks[1].mask.report.prepare_ms);
    EXPECT_EQ(masks[2].mask.report.technique, "shadow_map");
    EXPECT_EQ(masks[2].mask.report.stages.back().name, "combine");
}

TEST(Lights, DepthOfEach)
{
    const Scene complete = with_depth(scene_of({named("a", panel(-1)), named("b", panel(1))}), SoftShadowMap{});
    ASSERT_TRUE(complete.lights[1].occluders && complete.lights[1].occluders->front && complete.lights[1].occluders->back);
    EXPECT_NE(complete.lights[0].occluders->front->depth, complete.lights[1].occluders->front->depth);
    EXPECT_TRUE(complete.receivers.depth);
}

// --- Errors --------------------------------------------------------------------------------------------------------------------------

TEST(Lights, WhatDoesNotFitIsNamed)
{
    const auto fails = [](const Scene& scene, const Technique& technique, const std::string& start) {
        const Error error = error_of([&] { engine().masks(scene, technique); });
        EXPECT_EQ(exit_code(error.code()), 2) << error.what();
        EXPECT_EQ(std::string(error.what()).rfind(start, 0), 0u) << error.what();
        return error;
    };
    const std::vector<SceneLight> two{named("a", panel(-1)), named("b", panel(1))};
    Scene seen = scene_of(two);
    seen.receivers.camera = LightCamera{};
    fails(seen, SoftShadowVolume{}, "receivers.camera: is the light's own, and there are 2 lights");
    Scene shared = scene_of(two);
    shared.occluders = occluders(light_view(), flat(8, 8, 2));
    fails(shared, SoftShadowMap{}, "occluders.depth: is seen from one light, and 2 lights share it");
    for (const double weight : {-1.0, std::nan(""), HUGE_VAL})
        fails(scene_of({named("a", panel(0), weight)}), SoftShadowVolume{}, "lights[0].weight: is ");
    fails(scene_of({named("a", panel(0), 0)}), SoftShadowVolume{}, "lights: have weight 0");
    fails(scene_of({named("a", panel(0)), named("a", panel(1))}), SoftShadowVolume{}, "lights[1].name: a is");
    fails(scene_of({named("", panel(0))}), SoftShadowVolume{}, "lights[0].name: is no name");
    fails(scene_of({named("a", panel(0)),
                    named("b", RectangleLight{.center = {0, 6, 0}, .half_u = {1, 0, 0}, .half_v = {1, 0, 0}, .emission = {}})}),
          SoftShadowVolume{}, "lights[1].half_v: is not orthogonal");
    fails(scene_of({named("a", panel(0)), named("b", DirectionalLight{.direction = {0, -1, 0}, .angular_diameter_deg = 1, .up = {}})}),
          SoftShadowVolume{}, "lights[1].kind: soft_shadow_volume cannot take a directional light");
    Scene own = scene_of(two);
    own.objects.erase(own.objects.begin());
    own.lights[0].occluders = occluders(light_view(), flat(8, 8, 2));
    own.lights[1].occluders = Occluders{};
    fails(own, SoftShadowMap{.sides = Sides::front}, "lights[1].occluders.depth.front: is missing");
}

TEST(Lights, OneCanBePreparedAtATime)
{
    const Error error = error_of([] { engine().prepare(scene_of({named("a", panel(0))}), SoftShadowVolume{}); });
    EXPECT_EQ(error.code(), ErrorCode::usage);
    EXPECT_TRUE(holds(error.what(), "only_light")) << error.what();
}

} // namespace
} // namespace penumbra::test
