// Which receivers are shaded, and what lies between them.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "refine/coarse_to_fine.hpp"
#include "scene/camera.hpp"
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

// Receivers seen from above, under a light of 1 x 1 at a height of 8 that nothing or one plate stands before.
struct World {
    int width, height;
    DepthMap receivers;
    Camera camera = light_camera(LightFrame{}, {0.5, 0.5}, {0, 0, 0});
    LightFrame light{.half_u = 0.5, .half_v = 0.5};
    DepthMap map{.width = 32, .height = 32, .depth = std::vector<float>(32 * 32, INFINITY)};

    World(int w, int h, float depth = 8) : width(w), height(h), receivers{.width = w, .height = h, .depth = std::vector<float>(static_cast<std::size_t>(w * h), depth)} {}

    OccluderField field() const
    {
        const DepthMap* maps[] = {&map};
        return {light, camera, maps};
    }
    ReceiverImage image() const { return {.camera = camera, .width = width, .height = height, .depth = receivers.depth, .points = {}, .normals = {}}; }
    template <class Value> CoarseToFine shade(double tolerance, const Value& value) const
    {
        std::set<std::uint32_t> asked;
        return shade_coarse_to_fine(image(), 1, {.tolerance = tolerance}, field(), [&](std::span<const std::uint32_t> pixels) {
            std::vector<float> values;
            for (const std::uint32_t pixel : pixels) {
                EXPECT_TRUE(asked.insert(pixel).second) << pixel << " twice";
                values.push_back(value(static_cast<int>(pixel) % width, static_cast<int>(pixel) / width));
            }
            return values;
        });
    }
};

TEST(CoarseToFine, ShadesFewOfAPlaneThatNothingCastsOn)
{
    const World world(257, 129);
    const CoarseToFine result = world.shade(0.01, [](int, int) { return 1.f; });
    EXPECT_EQ(result.receivers, 257u * 129);
    EXPECT_EQ(result.shaded, 17u * 9); // every sixteenth, each way
    for (const float v : result.visibility) ASSERT_EQ(v, 1);
}

TEST(CoarseToFine, KeepsToTheToleranceOnSmoothMasks)
{
    const World world(301, 211);
    for (const double tolerance : {0.1, 0.03, 0.006}) {
        const auto value = [](int x, int y) { return static_cast<float>(0.5 + 0.3 * std::sin(x / 29.0) * std::cos(y / 37.0 + x / 91.0)); };
        const CoarseToFine result = world.shade(tolerance, value);
        EXPECT_LT(result.shaded, result.receivers / 2) << tolerance;
        for (int y = 0; y < world.height; ++y)
            for (int x = 0; x < world.width; ++x) ASSERT_NEAR(result.visibility[static_cast<std::size_t>(y * world.width + x)], value(x, y), tolerance) << x << ' ' << y;
    }
}

TEST(CoarseToFine, WhatWasShadedStaysAsItWas)
{
    const World world(90, 61);
    std::vector<float> values(90 * 61);
    std::mt19937 random(5);
    for (float& v : values) v = std::uniform_real_distribution<float>(0, 1)(random);
    const CoarseToFine result = world.shade(0.01, [&](int x, int y) { return values[static_cast<std::size_t>(y * 90 + x)]; });
    EXPECT_EQ(result.shaded, result.receivers); // noise tells nothing about its neighbours
    EXPECT_EQ(result.visibility, values);
}

// What is shaded is never written again, at any size: the last blocks of an image may be one pixel high or wide.
TEST(CoarseToFine, WhatWasShadedStaysBesideWhatWasNot)
{
    for (const auto& [width, height] : {std::pair{256, 200}, {200, 256}, {97, 98}, {64, 39}, {41, 63}, {512, 512}}) {
        const World world(width, height);
        const auto value = [width = width, height = height](int x, int y) { return 3 * x < 2 * width && 3 * y < 2 * height ? 0.5f : static_cast<float>(0.5 + 0.01 * std::sin(0.9 * x) * std::sin(1.1 * y)); };
        std::set<std::uint32_t> shaded;
        const CoarseToFine result = shade_coarse_to_fine(world.image(), 1, {.tolerance = 0.02}, world.field(), [&](std::span<const std::uint32_t> pixels) {
            std::vector<float> values;
            for (const std::uint32_t pixel : pixels) {
                shaded.insert(pixel);
                values.push_back(value(static_cast<int>(pixel) % width, static_cast<int>(pixel) / width));
            }
            return values;
        });
        ASSERT_GT(shaded.size(), 0u);
        for (const std::uint32_t pixel : shaded)
            ASSERT_EQ(result.visibility[pixel], value(static_cast<int>(pixel) % width, static_cast<int>(pixel) / width)) << width << ' ' << height << ' ' << pixel % static_cast<unsigned>(width) << ' ' << pixel / static_cast<unsigned>(width);
    }
}

TEST(CoarseToFine, EverySizeAndNoReceivers)
{
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 40}, {40, 1}, {2, 2}, {7, 61}, {17, 16}, {93, 3}}) {
        World world(width, height);
        const auto value = [](int x, int y) { return x > y ? 0.25f : 0.75f; };
        const CoarseToFine result = world.shade(0.001, value);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) ASSERT_NEAR(result.visibility[static_cast<std::size_t>(y * width + x)], value(x, y), 0.001) << width << ' ' << height << ' ' << x << ' ' << y;
        world.receivers.depth.assign(world.receivers.depth.size(), INFINITY);
        const CoarseToFine none = world.shade(0.001, [](int, int) { return 0.f; });
        EXPECT_EQ(none.shaded, 0u);
        EXPECT_EQ(none.receivers, 0u);
        for (const float v : none.visibility) ASSERT_EQ(v, 1);
    }
}

// A step in depth: on either side its own visibility, smooth enough to be told from few.
TEST(CoarseToFine, NothingIsTakenAcrossAStepInDepth)
{
    World world(128, 128);
    for (int y = 0; y < 128; ++y)
        for (int x = 61; x < 128; ++x) world.receivers.at(x, y) = 6;
    const auto value = [](int x, int) { return x < 61 ? 0.2f : 0.8f; };
    const CoarseToFine result = world.shade(0.01, value);
    for (int y = 0; y < 128; ++y)
        for (int x = 0; x < 128; ++x) ASSERT_EQ(result.visibility[static_cast<std::size_t>(y * 128 + x)], value(x, y)) << x << ' ' << y;
    EXPECT_LT(result.shaded, 128u * 128 / 4);
}

// A crease and a turned normal alike.
TEST(CoarseToFine, NothingIsTakenAcrossATurnedNormal)
{
    World world(64, 64);
    std::vector<DepthVector> normals(64 * 64, DepthVector{0, 0, -1});
    for (int y = 0; y < 64; ++y)
        for (int x = 37; x < 64; ++x) normals[static_cast<std::size_t>(y * 64 + x)] = {0.6f, 0, -0.8f};
    ReceiverImage image = world.image();
    image.normals = normals;
    const OccluderField field = world.field();
    const CoarseToFine result = shade_coarse_to_fine(image, 1, {.tolerance = 0.01}, field, [](std::span<const std::uint32_t> pixels) {
        std::vector<float> values;
        for (const std::uint32_t pixel : pixels) values.push_back(pixel % 64 < 37 ? 0.f : 1.f);
        return values;
    });
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) ASSERT_EQ(result.visibility[static_cast<std::size_t>(y * 64 + x)], x < 37 ? 0.f : 1.f);
}

// A bar close above the receivers, thinner than the steps between those that are shaded first: nobody who looks at every sixteenth sees it.
TEST(CoarseToFine, ABarBetweenTheShadedReceiversIsSeen)
{
    World world(512, 512);
    for (int y = 0; y < 32; ++y) world.map.at(13, y) = 7.98f; // hard shadows: 2 cm above, 8 m from a light of 1 m
    const double left = 2.0 * 13 / 32 - 1, right = 2.0 * 14 / 32 - 1;
    const auto value = [&](int x, int) {
        const double xi = (2 * x + 1) / 512.0 - 1;
        return xi > left && xi < right ? 0.f : 1.f;
    };
    const CoarseToFine result = world.shade(0.01, value);
    for (int y = 0; y < 512; ++y)
        for (int x = 0; x < 512; ++x) ASSERT_EQ(result.visibility[static_cast<std::size_t>(y * 512 + x)], value(x, y)) << x;
}

// A plate of half the map's width in the middle, half-way to the light; receivers that face it.
struct Lit : World {
    std::vector<DepthVector> normals;
    Lit() : World(256, 256), normals(256 * 256, DepthVector{0, 0, -1})
    {
        for (int y = 12; y < 20; ++y)
            for (int x = 12; x < 20; ++x) map.at(x, y) = 4;
    }
    CoarseToFine shade_lit(const std::vector<float>& values) const
    {
        ReceiverImage all = image();
        all.normals = normals;
        return shade_coarse_to_fine(all, 1, {.tolerance = 0.06, .proves_lit = true}, field(), [&](std::span<const std::uint32_t> pixels) {
            std::vector<float> some;
            for (const std::uint32_t pixel : pixels) some.push_back(values[pixel]);
            return some;
        });
    }
};

// The light's window of 1 x 1 at half-way: half of it wide, so a receiver at x sees the plate between -1 and 1 from x / 2 - 0.25 to x / 2 + 0.25.
TEST(CoarseToFine, WhatNothingCanDarkenIsNotShaded)
{
    const Lit world;
    std::vector<float> values(256 * 256, 1.f);
    std::size_t dark = 0;
    for (int y = 0; y < 256; ++y)
        for (int x = 0; x < 256; ++x) {
            const auto seen = [](int i) {
                const double at = 2.0 * ((2 * i + 1) / 256.0 - 1); // half-way, where the map is 4 wide
                return std::clamp(std::min(at + 0.25, 0.5) - std::max(at - 0.25, -0.5), 0.0, 0.5) / 0.5;
            };
            values[static_cast<std::size_t>(y * 256 + x)] = static_cast<float>(1 - seen(x) * seen(y));
            dark += seen(x) * seen(y) > 0;
        }
    const CoarseToFine result = world.shade_lit(values);
    for (std::size_t i = 0; i < values.size(); ++i) ASSERT_NEAR(result.visibility[i], values[i], 0.03) << i % 256 << ' ' << i / 256;
    EXPECT_GT(result.shaded, 0u);
    EXPECT_LT(result.shaded, dark / 2);
    // The same where nothing casts at all: but for what sees past the map's border.
    Lit none;
    none.map.depth.assign(none.map.depth.size(), INFINITY);
    EXPECT_EQ(none.shade_lit(values).shaded, 0u);
}

TEST(CoarseToFine, WhatTurnsFromTheLightIsShaded)
{
    const std::vector<float> values(256 * 256, 0.5f);
    Lit world;
    world.map.depth.assign(world.map.depth.size(), INFINITY);
    const CoarseToFine flat = world.shade_lit(values);
    EXPECT_EQ(flat.shaded, 0u);
    world.normals.assign(world.normals.size(), DepthVector{0, 0, 1});
    EXPECT_EQ(world.shade_lit(values).visibility, values);
    // A quarter turn: of the light, from -0.5 to 0.5, all lies above the planes of those left of it, none above those right of it.
    world.normals.assign(world.normals.size(), DepthVector{1, 0, 0});
    const CoarseToFine turned = world.shade_lit(values);
    EXPECT_EQ(turned.visibility[256 * 128], 1.f);
    for (int x = 128 - 16; x < 256; ++x) EXPECT_EQ(turned.visibility[static_cast<std::size_t>(256 * 128 + x)], 0.5f) << x; // from x = -0.5 on
    world.normals.assign(world.normals.size(), DepthVector{0, 0, 0}); // not known
    EXPECT_EQ(world.shade_lit(values).visibility, values);
}

// What the maps do not show may cast: it is told from receivers that see past the border.
TEST(CoarseToFine, WhatSeesPastTheMapIsShaded)
{
    const std::vector<float> values(256 * 256, 0.5f);
    Lit world;
    world.map.depth.assign(world.map.depth.size(), INFINITY);
    world.map.at(16, 16) = 4;
    const CoarseToFine result = world.shade_lit(values);
    EXPECT_EQ(result.visibility.front(), 0.5f); // the corner's window reaches past the map
    EXPECT_EQ(result.visibility[256 * 50 + 128], 1.f);
}

} // namespace
} // namespace penumbra::test
