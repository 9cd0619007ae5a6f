// Outlines that lie inside texels of maps that an Engine renders.
#include <cmath>

#include "support/maps.hpp"

namespace penumbra::test {
namespace {

constexpr int texels = 32, pixels = 48;
constexpr double tangent = 1, depth = 4, ground = 8, half_light = 1;
constexpr double texel = 2 * tangent * depth / texels;

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

// A light of 2 x 2 that shines down from the origin, a plate between low and high, and ground below.
Scene scene(const Vec2& low, const Vec2& high)
{
    Scene result;
    result.light = rectangle_light(half_light, half_light);
    const Vec3 origin = std::get<RectangleLight>(result.light).center, u = std::get<RectangleLight>(result.light).half_u, v = std::get<RectangleLight>(result.light).half_v;
    const Vec3 right = u.normalized(), up = v.normalized(), away = right.cross(up) * -1;
    TriangleMesh plate;
    for (const auto& [x, y] : {std::pair(low.x, low.y), {high.x, low.y}, {high.x, high.y}, {low.x, high.y}}) plate.positions.push_back(Imath::V3f(origin + right * x + up * y + away * depth));
    plate.triangles = {{0, 1, 2}, {0, 2, 3}};
    result.objects.push_back({.name = "plate", .mesh = plate, .casts = true, .receives = false});
    result.occluders = {.camera = light_view(tangent), .width = texels, .height = texels, .front = {}, .back = {}, .layers = {}};
    result.receivers = receivers(light_view(tangent), flat(pixels, pixels, static_cast<float>(ground)));
    return result;
}

// The largest difference from what the plate leaves of the light (closed_form_test.cpp).
double worst(const Mask& mask, const Vec2& low, const Vec2& high)
{
    const auto overlap = [](double from, double to, double p) {
        const double l0 = (from * ground - p * depth) / (ground - depth), l1 = (to * ground - p * depth) / (ground - depth);
        return std::max(0.0, std::min(l1, half_light) - std::max(l0, -half_light)) / (2 * half_light);
    };
    double most = 0;
    for (int y = 0; y < pixels; ++y)
        for (int x = 0; x < pixels; ++x) {
            const double p_x = ((2 * x + 1.0) / pixels - 1) * tangent * ground, p_y = (1 - (2 * y + 1.0) / pixels) * tangent * ground;
            most = std::max(most, std::abs(mask.visibility.at(x, y) - (1 - overlap(low.x, high.x, p_x) * overlap(low.y, high.y, p_y))));
        }
    return most;
}

Scene without_samples(Scene scene)
{
    scene.occluders.front->fine = scene.occluders.back->fine = nullptr;
    for (DepthMap& layer : scene.occluders.layers) layer.fine = nullptr;
    return scene;
}

// An edge that is off by e at `depth` is off by e ground / (ground - depth) on the light, which is 2 wide: e of what it hides. Samples place an edge to an eighth
// of a texel, centres to a half; two edges meet at a corner; the pattern adds 1/512 an edge.
TEST(FineDepth, PlacesOutlinesInsideTexels)
{
    double without = 0;
    for (const double off : {0.1, 0.35, 0.6, 0.85}) {
        const Vec2 low((-9 + off) * texel, (-7 + 0.9 * off) * texel), high((8 + 0.8 * off) * texel, (6 + off) * texel);
        const SoftShadowMap settings{.tolerance = 0};
        const Scene rendered = with_depth(scene(low, high), settings);
        ASSERT_TRUE(rendered.occluders.front->fine) << off;
        EXPECT_LE(worst(engine().mask(rendered, settings), low, high), 2 * (texel / 8 + 1.0 / 512)) << off;
        without = std::max(without, worst(engine().mask(without_samples(rendered), settings), low, high));
    }
    EXPECT_GT(without, 2.5 * texel / 8);
}

// What is rendered for a mask is what with_depth renders.
TEST(FineDepth, IsWhatAMaskIsMadeFrom)
{
    const Scene given = scene({-1.1, -0.9}, {1.03, 1.2});
    EXPECT_EQ(engine().mask(given, SoftShadowMap{}).visibility.pixels, engine().mask(with_depth(given, SoftShadowMap{}), SoftShadowMap{}).visibility.pixels);
}

// A map that is reduced, or given in part, has none.
TEST(FineDepth, OnlyOfMapsThatAreShadedWith)
{
    const Scene given = scene({-1.1, -0.9}, {1.03, 1.2});
    EXPECT_FALSE(with_depth(given, SoftShadowMap{.resolution = 16}).occluders.front->fine);
    EXPECT_FALSE(with_depth(given, SoftShadowMap{.visibility = PatchVisibility::sum}).occluders.front->fine);
    Scene part = given;
    part.occluders.front = without_samples(with_depth(given, SoftShadowMap{})).occluders.front;
    EXPECT_FALSE(with_depth(part, SoftShadowMap{}).occluders.back->fine);
}

} // namespace
} // namespace penumbra::test
