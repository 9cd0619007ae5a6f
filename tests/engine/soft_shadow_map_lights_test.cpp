// soft_shadow_map under lights that its publication does not have: a directional light's disc of directions, and textures.
#include <cmath>
#include <cstring>
#include <numbers>

#include <gtest/gtest.h>

#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>

#include "support/maps.hpp"

namespace penumbra::test {
namespace {

Object quad(const Vec3& center, const Vec3& half_u, const Vec3& half_v, bool casts, bool receives)
{
    Object object;
    object.name = "quad";
    for (const Vec3& corner : {center - half_u - half_v, center + half_u - half_v, center + half_u + half_v, center - half_u + half_v}) object.mesh.positions.emplace_back(corner);
    object.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    object.casts = casts;
    object.receives = receives;
    return object;
}

Object floor_quad(bool casts = false) { return quad({0, 0, 0}, {4, 0, 0}, {0, 0, -4}, casts, true); }

DirectionalLight sun(double diameter_deg, const Vec3& direction = {0, -1, 0}) { return {.direction = direction, .angular_diameter_deg = diameter_deg, .up = {}}; }

constexpr int side = 64;

Scene scene_of(const Light& light, std::vector<Object> objects)
{
    Scene scene;
    scene.light = light;
    scene.objects = std::move(objects);
    scene.occluders.width = scene.occluders.height = 128;
    scene.receivers.camera = PinholeCamera{.frame = {.origin = {0, 6, 0}, .x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}}, .tan_half_fov = {0.4, 0.4}, .shift = {}};
    scene.receivers.width = scene.receivers.height = side;
    return scene;
}

Mask mask_of(const Scene& scene, const Technique& technique = SoftShadowMap{})
{
    static const Engine engine;
    return engine.mask(scene, technique);
}

// The share of a disc beyond a chord at `s` radii from its middle.
double beyond(double s)
{
    if (s >= 1) return 0;
    if (s <= -1) return 1;
    return (std::acos(s) - s * std::sqrt(1 - s * s)) / std::numbers::pi;
}

// Mean over shadow samples.
double mean_difference(const Image& a, const Image& b)
{
    double sum = 0;
    int shadow = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        if (std::min(a.pixels[i], b.pixels[i]) >= 0.999f) continue;
        sum += std::abs(static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i]));
        ++shadow;
    }
    EXPECT_GT(shadow, 100) << "hardly a shadow";
    return sum / std::max(shadow, 1);
}

// A half-plane under a sun overhead: the segment of the disc of tangents that its edge leaves. 32 x 32 samples tell a straight edge to 7.6/1024 of the square
// around the disc, which has pi/4 of that; interpolation may add a tolerance of .02 more.
TEST(SoftShadowMapLights, TheEdgeOfAHalfPlaneUnderASun)
{
    for (const double diameter : {5., 10., 40.}) {
        Scene scene = scene_of(sun(diameter), {quad({-3, 1, 0}, {3, 0, 0}, {0, 0, -6}, true, false), floor_quad()});
        scene.occluders.camera = LightCamera{.tan_half_fov = {}, .half_extent = Vec2(8, 8), .center = Vec3(0, 3, 0)}; // the edge lies between two texels
        const double tangent = std::tan(diameter / 2 * std::numbers::pi / 180);
        for (const double tolerance : {0., 0.02}) {
            const Mask mask = mask_of(scene, SoftShadowMap{.tolerance = tolerance});
            int penumbra = 0;
            for (int y = 0; y < side; ++y)
                for (int x = 0; x < side; ++x) {
                    const double place = ((x + 0.5) * 2 / side - 1) * 0.4 * 6; // of the floor, which the camera sees from straight above
                    const double expected = 1 - beyond(place / tangent);
                    penumbra += expected > 0 && expected < 1;
                    ASSERT_NEAR(mask.visibility.at(x, y, 0), expected, 7.6 / 1024 * 4 / std::numbers::pi + tolerance) << diameter << " degrees, pixel " << x << ", " << y;
                }
            EXPECT_GT(penumbra, side) << diameter;
        }
    }
}

TEST(SoftShadowMapLights, SunsAgreeWithRays)
{
    const std::vector<Object> objects{quad({0.3, 1.2, 0.2}, {0.7, 0.3, 0}, {0, 0.2, -0.6}, true, true), quad({-0.6, 0.6, -0.4}, {0.4, 0, 0}, {0, 0.3, -0.4}, true, true), floor_quad(true)};
    for (const Vec3& direction : {Vec3(0, -1, 0), Vec3(0.4, -1, 0.3)})
        for (const auto& [diameter, most] : {std::pair{0.53, 0.02}, std::pair{8., 0.006}, std::pair{30., 0.006}}) {
            Scene scene = scene_of(sun(diameter, direction), objects);
            scene.receivers.camera = PinholeCamera{.frame = {.origin = {0, 3, 4}, .x = {1, 0, 0}, .y = {0, 0.8, -0.6}, .z = {0, 0.6, 0.8}}, .tan_half_fov = {0.4, 0.4}, .shift = {}};
            EXPECT_LT(mean_difference(mask_of(scene).visibility, mask_of(scene, RayTraced{.samples = 4096}).visibility), most) << diameter << " degrees; the smallest sun's penumbra is narrower than a texel of the map";
        }
}

// A plane that casts, tilted, and nothing else: nothing darkens it.
TEST(SoftShadowMapLights, ALitPlaneIsCleanUnderASun)
{
    for (const double tilt : {0., 0.3, 1., 3.}) {
        const Object plane = quad({0, 0, 0}, {2, tilt, 0}, {0, 0, -2}, true, true);
        for (const Vec3& direction : {Vec3(0, -1, 0), Vec3(-0.5, -1, 0.2)}) {
            const Mask mask = mask_of(scene_of(sun(1, direction), {plane}));
            const Mask rays = mask_of(scene_of(sun(1, direction), {plane}), RayTraced{.samples = 64});
            for (std::size_t i = 0; i < mask.visibility.pixels.size(); ++i) ASSERT_EQ(mask.visibility.pixels[i], rays.visibility.pixels[i]) << "tilt " << tilt << ", pixel " << i;
        }
    }
}

// However far the scene's origin lies above what casts, and beyond the farthest caster.
TEST(SoftShadowMapLights, ReceiversFarBehindWhatCasts)
{
    const Object caster = quad({0, 0.02, 0}, {0.5, 0, 0}, {0, 0, -0.5}, true, false);
    Scene scene = scene_of(sun(10), {caster, floor_quad()});
    scene.objects[1].mesh = quad({0, -20, 0}, {9, 0, 0}, {0, 0, -9}, false, true).mesh;
    EXPECT_LT(mean_difference(mask_of(scene).visibility, mask_of(scene, RayTraced{.samples = 4096}).visibility), 0.006);
}

RectangleLight textured(int width, int height, int channels, const std::function<float(int, int, int)>& emitted)
{
    Image image{.width = width, .height = height, .channels = channels, .pixels = {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c) image.pixels.push_back(emitted(x, y, c));
    return {.center = {0.2, 3, 0.1}, .half_u = {0.5, 0, 0}, .half_v = {0, 0, -0.3}, .emission = image};
}

std::vector<Object> casters() { return {quad({0.1, 1, 0}, {0.4, 0.1, 0}, {0, 0, -0.3}, true, false), quad({0, 0, 0}, {4, 0, 0}, {0, 0, -4}, false, true)}; }

// To the bit where nothing rounds: each of the 1024 samples is a share of 2^-10 then.
TEST(SoftShadowMapLights, AWhiteTextureIsNone)
{
    RectangleLight plain = textured(4, 2, 1, [](int, int, int) { return 1.f; });
    const Mask white = mask_of(scene_of(plain, casters()));
    ASSERT_EQ(white.visibility.channels, 3);
    plain.emission.reset();
    const Mask none = mask_of(scene_of(plain, casters()));
    for (std::size_t i = 0; i < none.visibility.pixels.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(white.visibility.pixels[3 * i + c], none.visibility.pixels[i]) << i;
}

// Light that two textures give together is what each gives alone. A mask is 32 sums of 32 shares, added up: 64 roundings of at most 2^-24, of three masks 1.2e-5.
TEST(SoftShadowMapLights, MasksAreLinearInTheTexture)
{
    const auto left = [](int x, int, int) { return x < 3 ? 2.f : 0.f; };
    const auto lower = [](int, int y, int) { return y > 1 ? 1.f : 0.25f; };
    const SoftShadowMap exact{.tolerance = 0};
    const auto total = [](const RectangleLight& light) {
        double sum = 0;
        for (const float e : light.emission->pixels) sum += static_cast<double>(e);
        return sum;
    };
    const RectangleLight a = textured(6, 4, 1, left), b = textured(6, 4, 1, lower), both = textured(6, 4, 1, [&](int x, int y, int c) { return left(x, y, c) + lower(x, y, c); });
    const Mask of_a = mask_of(scene_of(a, casters()), exact), of_b = mask_of(scene_of(b, casters()), exact), of_both = mask_of(scene_of(both, casters()), exact);
    for (std::size_t i = 0; i < of_a.visibility.pixels.size(); ++i)
        ASSERT_NEAR(of_both.visibility.pixels[i], (static_cast<double>(of_a.visibility.pixels[i]) * total(a) + static_cast<double>(of_b.visibility.pixels[i]) * total(b)) / total(both), 3 * 64 * 0x1p-24) << i;
}

// Each channel by itself, with the texture the right way up: rays see the same. The pattern is off by 5/1024 of the light at a straight edge on average, the rays by
// less than 1/1024.
TEST(SoftShadowMapLights, ColouredTexturesAgreeWithRays)
{
    const RectangleLight light = textured(8, 4, 3, [](int x, int y, int c) { return c == 0 ? static_cast<float>(x) : c == 1 ? static_cast<float>(3 - y) : x == 6 && y == 1 ? 1.f : 0.1f; });
    const Scene scene = scene_of(light, casters());
    EXPECT_LT(mean_difference(mask_of(scene).visibility, mask_of(scene, RayTraced{.samples = 4096}).visibility), 0.006);
}

TEST(SoftShadowMapLights, AnotherEmissionNeedsNoNewPreparation)
{
    const Engine engine;
    const RectangleLight first = textured(4, 4, 3, [](int x, int y, int c) { return static_cast<float>(x + y * c); });
    const RectangleLight second = textured(2, 3, 1, [](int x, int y, int) { return static_cast<float>(1 + x + y); });
    const Scene scene = scene_of(first, casters()), other = scene_of(second, casters());
    const Mask again = engine.shade(engine.with_emission(engine.prepare(scene, SoftShadowMap{}), *second.emission), with_depth(scene, SoftShadowMap{}).receivers);
    const Mask anew = mask_of(other);
    ASSERT_EQ(again.visibility.channels, anew.visibility.channels);
    EXPECT_EQ(std::memcmp(again.visibility.pixels.data(), anew.visibility.pixels.data(), anew.visibility.pixels.size() * sizeof(float)), 0);
}

TEST(SoftShadowMapLights, WhatASumCannotTakeIsSaid)
{
    const SoftShadowMap sum{.visibility = PatchVisibility::sum, .layers = 0};
    const auto message = [&](const Light& light, const SoftShadowMap& settings) {
        try {
            (void)mask_of(scene_of(light, casters()), settings);
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const RectangleLight light = textured(2, 2, 1, [](int, int, int) { return 1.f; });
    EXPECT_NE(message(sun(5), sum).find("technique.visibility: is sum and the light directional"), std::string::npos) << message(sun(5), sum);
    EXPECT_NE(message(light, sum).find("technique.visibility: is sum and the light textured"), std::string::npos) << message(light, sum);
    EXPECT_NE(message(light, {.project = true}).find("technique.project: is true and the light textured"), std::string::npos) << message(light, {.project = true});
}

} // namespace
} // namespace penumbra::test
