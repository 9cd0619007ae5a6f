// Shadow maps and their filters against weights counted by hand, and self-shadowing of both depth-map techniques.
#include <cmath>

#include "support/maps.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

constexpr int size = 64; // of occluder maps

// The step: occluders at depth 4 in columns below 32; receivers behind them at depth 8, `times` pixels a texel.
Mask step_mask(const ShadowMap& settings, int times = 1)
{
    const DepthMap occluder = boxes(size, size, 4, {{0, 32, 0, size}});
    return engine().shade(engine().prepare(point_light(), occluders(light_view(), occluder), settings),
                          receivers(light_view(), flat(size * times, size * times, 8)));
}

TEST(ShadowMap, HardTestOnAStep)
{
    for (const int times : {1, 4}) {
        const Mask mask = step_mask({}, times);
        for (int y = 0; y < size * times; ++y)
            for (int x = 0; x < size * times; ++x) ASSERT_EQ(mask.visibility.at(x, y), x < 32 * times ? 0.0f : 1.0f) << x << ", " << y;
    }
}

// Only what is nearer to the light than the receiver casts.
TEST(ShadowMap, DepthDecides)
{
    const DepthMap occluder = map_of(size, size, [](int x, int) { return x < 32 ? 4.0f : 12.0f; });
    const Mask mask = engine().shade(engine().prepare(point_light(), occluders(light_view(), occluder), ShadowMap{}),
                                     receivers(light_view(), flat(size, size, 8)));
    for (int x = 0; x < size; ++x) EXPECT_EQ(mask.visibility.at(x, 10), x < 32 ? 0.0f : 1.0f);
}

// At a texel's centre the window of `taps` texels begins at x - floor((taps - 1) / 2). Beyond the map's border nothing casts shadows.
TEST(ShadowMap, PercentageCloserCountsItsWindow)
{
    for (const int taps : {1, 2, 3, 4, 5, 8, 63}) {
        const Mask mask = step_mask({.filter = ShadowFilter::percentage_closer, .taps = taps});
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x) {
                int lit = 0;
                for (int j = 0; j < taps; ++j)
                    for (int i = 0; i < taps; ++i) {
                        const int column = x - (taps - 1) / 2 + i, row = y - (taps - 1) / 2 + j;
                        lit += column < 0 || column >= 32 || row < 0 || row >= size;
                    }
                // A whole number over a whole number, both exact: one rounding.
                ASSERT_EQ(mask.visibility.at(x, y), static_cast<float>(lit) / static_cast<float>(taps * taps))
                    << taps << ": " << x << ", " << y;
            }
    }
}

// At centres the B-spline weighs 1/6, 4/6, 1/6.
TEST(ShadowMap, BicubicWeightsAtCentres)
{
    const Mask mask = step_mask({.filter = ShadowFilter::bicubic});
    const float bound = 32 * 0x1p-24f; // 16 terms of two roundings each, all below 1
    for (int y = 2; y < size - 2; ++y) {
        EXPECT_NEAR(mask.visibility.at(10, y), 0, bound);
        EXPECT_NEAR(mask.visibility.at(31, y), 1 / 6.0, bound);
        EXPECT_NEAR(mask.visibility.at(32, y), 5 / 6.0, bound);
        EXPECT_EQ(mask.visibility.at(40, y), 1.0f);
    }
}

// Between centres: weights sum to 1, and the edge rises smoothly, by at most 3/4 a texel (the peak of the quadratic
// B-spline, which is the edge's slope).
TEST(ShadowMap, BicubicIsSmooth)
{
    constexpr int times = 8;
    const Mask mask = step_mask({.filter = ShadowFilter::bicubic}, times);
    const float bound = 32 * 0x1p-24f;
    const int row = 32 * times + 3;
    for (int x = 4 * times; x + 1 < size * times; ++x) {
        const float rise = mask.visibility.at(x + 1, row) - mask.visibility.at(x, row);
        EXPECT_GE(rise, -bound);
        EXPECT_LE(rise, 0.75f / times + bound);
    }
    EXPECT_NEAR(mask.visibility.at(16 * times, row), 0, bound);
    EXPECT_EQ(mask.visibility.at(40 * times, row), 1.0f);
}

// --- A lone tilted plane that casts and receives: lit, wherever one looks -----------------------------------------------------------

struct Tilt {
    double x, y; // disparity across half the map, over the disparity in its middle
};
constexpr Tilt tilts[] = {{0, 0}, {0.02, 0}, {0, -0.1}, {0.1, 0.07}, {-0.3, 0.2}, {0.45, -0.45}};

DepthMap plane(int pixels, const Tilt& tilt)
{
    return map_of(pixels, pixels, [&](int x, int y) {
        const double xi = (2 * x + 1.0) / pixels - 1, eta = 1 - (2 * y + 1.0) / pixels;
        return static_cast<float>(1 / (0.2 * (1 + tilt.x * xi + tilt.y * eta)));
    });
}

int dark_pixels(const Light& light, const Tilt& tilt, int pixels, const Technique& technique)
{
    const Mask mask = engine().shade(engine().prepare(light, occluders(light_view(), plane(size, tilt)), technique),
                                     receivers(light_view(), plane(pixels, tilt)));
    int dark = 0;
    for (const float v : mask.visibility.pixels) dark += v < 1;
    return dark;
}

TEST(SelfShadow, ShadowMapOfATiltedPlane)
{
    for (const ShadowFilter filter : {ShadowFilter::hard, ShadowFilter::percentage_closer, ShadowFilter::bicubic})
        for (const Tilt& tilt : tilts)
            for (const int pixels : {size, 61, 3 * size}) {
                EXPECT_EQ(dark_pixels(point_light(), tilt, pixels, ShadowMap{.filter = filter, .taps = 5, .bias = 1}), 0)
                    << static_cast<int>(filter) << ": " << tilt.x << ", " << tilt.y << ", " << pixels;
                // Without the bound there is acne, unless there is no slope.
                if (pixels == 3 * size && (tilt.x != 0 || tilt.y != 0)) {
                    EXPECT_GT(dark_pixels(point_light(), tilt, pixels, ShadowMap{.filter = filter, .taps = 5, .bias = 0}),
                              pixels * pixels / 5)
                        << static_cast<int>(filter) << ": " << tilt.x << ", " << tilt.y;
                }
            }
}

// The bound holds where the bracket of receiver_limits is above 1/4: steps below 3/2 of k h, k h = light's view over light, a texel. Step /
// (k h) is 0.2 tilt (2 / n) / (1 / (2 half) (2 / n)) = 0.4 tilt half.
TEST(SelfShadow, SoftShadowMapOfATiltedPlane)
{
    for (const double half : {0.001, 0.1, 0.5, 1.5})
        for (const Tilt& tilt : tilts)
            for (const int pixels : {size, 61, 3 * size}) {
                ASSERT_LT(0.4 * (std::abs(tilt.x) + std::abs(tilt.y)) * half, 1.5);
                EXPECT_EQ(dark_pixels(rectangle_light(half, half), tilt, pixels, SoftShadowMap{.sides = Sides::front, .bias = 1}), 0)
                    << half << ": " << tilt.x << ", " << tilt.y << ", " << pixels;
            }
    // Without the bound there is acne.
    EXPECT_GT(dark_pixels(rectangle_light(0.1, 0.1), {0.1, 0.07}, 3 * size, SoftShadowMap{.sides = Sides::front, .bias = 0}), 1000);
}

// Where a receiver's own texel shows nothing, the neighbours know its surface: a plane with pinholes stays lit, in the holes as well.
TEST(SelfShadow, APlaneWithPinholesIsLit)
{
    const auto with_holes = [](const Tilt& tilt) {
        DepthMap map = plane(size, tilt);
        for (int y = 3; y + 1 < size; y += 7)
            for (int x = 4; x + 1 < size; x += 5) map.depth[static_cast<std::size_t>(y * size + x)] = nothing_there;
        return map;
    };
    const std::vector<std::pair<Light, Technique>> rows = {
        {point_light(), ShadowMap{.filter = ShadowFilter::hard}},
        {point_light(), ShadowMap{.filter = ShadowFilter::percentage_closer, .taps = 3}},
        {point_light(), ShadowMap{.filter = ShadowFilter::bicubic}},
        {rectangle_light(0.5, 0.5), SoftShadowMap{.sides = Sides::front}},
    };
    for (const auto& [light, technique] : rows)
        for (const Tilt& tilt : tilts) {
            const Mask mask = engine().shade(engine().prepare(light, occluders(light_view(), with_holes(tilt)), technique),
                                             receivers(light_view(), plane(3 * size, tilt)));
            for (const float v : mask.visibility.pixels) ASSERT_EQ(v, 1) << kind_of(technique) << ": " << tilt.x << ", " << tilt.y;
        }
}

// The bound is for receivers on the casters' own surface: an occluder just before a plane still casts its shadow.
TEST(SelfShadow, BiasTakesNothingFromOtherOccluders)
{
    const DepthMap occluder = boxes(size, size, 4.999f, {{20, 44, 20, 44}});
    for (const double bias : {0.0, 1.0, 16.0}) {
        const Mask mask = engine().shade(engine().prepare(rectangle_light(0.01, 0.01), occluders(light_view(), occluder),
                                                          SoftShadowMap{.sides = Sides::front, .bias = bias}),
                                         receivers(light_view(), flat(size, size, 5)));
        EXPECT_NEAR(mask.visibility.at(32, 32), 0, 1e-6) << bias;
        EXPECT_EQ(mask.visibility.at(10, 10), 1.0f);
    }
}

} // namespace
} // namespace penumbra::test
