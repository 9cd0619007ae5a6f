// The same scene at another scale, mirrored or turned gives the same, mirrored or turned mask.
#include <cmath>
#include <cstring>

#include "support/maps.hpp"

#include "oracle/soft_shadow_map_oracle.hpp"

namespace penumbra::test {
namespace {

constexpr int texels = 64, pixels = 41;

struct World {
    double scale = 1;
    double half_u = 0.7, half_v = 0.3;
    double tangent_x = 1, tangent_y = 0.5;
    DepthMap front, back, receivers;
};

World world()
{
    return {.front = random_map(texels, texels, 2, 4, 0.4, 1),
            .back = random_map(texels, texels, 3, 5, 0.4, 2),
            .receivers = random_map(pixels, pixels, 6, 9, 0.05, 3)};
}

DepthMap scaled(DepthMap map, double scale)
{
    for (float& depth : map.depth) depth = static_cast<float>(depth * scale);
    return map;
}

// The map with pixel (x, y) taken from (y, x) of another: turned about the image's diagonal.
DepthMap transposed(const DepthMap& map)
{
    return map_of(map.height, map.width, [&](int x, int y) { return map.at(y, x); });
}
DepthMap mirrored(const DepthMap& map)
{
    return map_of(map.width, map.height, [&](int x, int y) { return map.at(map.width - 1 - x, y); });
}

// Without the self-shadow bound: in maps of random depths a texel's neighbours may look like one steep surface that reaches to the
// receivers.
Mask mask_of(const World& w, const Technique& technique = SoftShadowMap{.visibility = PatchVisibility::sum, .bias = 0, .tolerance = 0})
{
    const Engine engine;
    Occluders o = occluders(light_view(w.tangent_x, w.tangent_y), scaled(w.front, w.scale));
    o.back = scaled(w.back, w.scale);
    return engine.shade(engine.prepare(rectangle_light(w.half_u * w.scale, w.half_v * w.scale), o, technique),
                        penumbra::test::receivers(light_view(w.tangent_x, w.tangent_y), scaled(w.receivers, w.scale)));
}

oracle::Map oracle_map(const DepthMap& depth)
{
    oracle::Map map{.width = depth.width, .height = depth.height, .texels = {}};
    for (const float z : depth.depth)
        map.texels.push_back({.disparity = std::isfinite(z) ? 1.0 / static_cast<double>(z) : 0, .covered = std::isfinite(z) ? 1.0 : 0});
    return map;
}

// What the mask should be, from the depths themselves. Against those, the device's places are off by seven roundings and its disparities by
// two (depth scaled to binary32, one over it).
oracle::Bounded expected_at(const World& w, int x, int y)
{
    const oracle::Settings settings{.kx = w.tangent_x / (2 * w.half_u),
                                    .ky = w.tangent_y / (2 * w.half_v),
                                    .bias = 0,
                                    .place_error = 7 * oracle::e,
                                    .disparity_error = 2 * oracle::e};
    const oracle::Receiver p{(2 * x + 1.0) / pixels - 1, 1 - (2 * y + 1.0) / pixels, 1.0 / static_cast<double>(w.receivers.at(x, y))};
    return oracle::visibility({oracle_map(w.front), oracle_map(w.back)}, p, settings);
}

TEST(Scale, PowersOfTwoGiveTheSameBits)
{
    World w = world();
    const Mask one = mask_of(w);
    for (const double scale : {0x1p-20, 0x1p-10, 0x1p10, 0x1p20}) {
        w.scale = scale;
        EXPECT_EQ(mask_of(w).visibility.pixels, one.visibility.pixels) << scale;
    }
}

TEST(Scale, AnyOtherGivesTheSameMaskWithinRounding)
{
    World w = world();
    const std::vector<double> scales = {1e-6, 1e-3, 1, 1e3, 1e6};
    std::vector<Mask> masks;
    for (const double scale : scales) {
        w.scale = scale;
        masks.push_back(mask_of(w));
    }
    double widest = 0;
    for (int y = 0; y < pixels; y += 3)
        for (int x = 0; x < pixels; x += 3) {
            if (!std::isfinite(w.receivers.at(x, y))) continue;
            const oracle::Bounded expected = expected_at(w, x, y);
            widest = std::max(widest, expected.bound);
            for (std::size_t i = 0; i < scales.size(); ++i)
                EXPECT_NEAR(masks[i].visibility.at(x, y), expected.value, expected.bound) << scales[i] << ": " << x << ", " << y;
        }
    EXPECT_LT(widest, 1e-3);
}

// Texels are added in another order, so equal within the rounding of both.
TEST(Mirror, MirrorsTheMask)
{
    const World w = world();
    World other = w;
    other.front = mirrored(w.front);
    other.back = mirrored(w.back);
    other.receivers = mirrored(w.receivers);
    const Mask a = mask_of(w), b = mask_of(other);
    int compared = 0;
    for (int y = 0; y < pixels; y += 2)
        for (int x = 0; x < pixels; ++x) {
            if (!std::isfinite(w.receivers.at(x, y))) continue;
            EXPECT_NEAR(a.visibility.at(x, y), b.visibility.at(pixels - 1 - x, y), 2 * expected_at(w, x, y).bound) << x << ", " << y;
            ++compared;
        }
    EXPECT_GT(compared, 500);
}

World turned(const World& w)
{
    return {.half_u = w.half_v,
            .half_v = w.half_u,
            .tangent_x = w.tangent_y,
            .tangent_y = w.tangent_x,
            .front = transposed(w.front),
            .back = transposed(w.back),
            .receivers = transposed(w.receivers)};
}

TEST(Turn, TurnsTheMask)
{
    const World w = world();
    const Mask a = mask_of(w), b = mask_of(turned(w));
    for (int y = 0; y < pixels; y += 2)
        for (int x = 0; x < pixels; ++x)
            if (std::isfinite(w.receivers.at(x, y))) {
                EXPECT_NEAR(a.visibility.at(x, y), b.visibility.at(y, x), 2 * expected_at(w, x, y).bound) << x << ", " << y;
            }
}

// A hard test adds nothing, so it mirrors and turns to the bit; percentage-closer weights are equal, so their sum is exact.
TEST(Mirror, HardShadowsMirrorToTheBit)
{
    World w = world();
    w.half_u = w.half_v = 0;
    World other = w;
    other.front = mirrored(w.front);
    other.receivers = mirrored(w.receivers);
    for (const Technique& technique :
         {Technique(ShadowMap{}), Technique(ShadowMap{.filter = ShadowFilter::percentage_closer, .taps = 5})}) {
        const Mask a = mask_of(w, technique), b = mask_of(other, technique), c = mask_of(turned(w), technique);
        for (int y = 0; y < pixels; ++y)
            for (int x = 0; x < pixels; ++x) {
                // Centres lie on a border of texels where 64 (2 x + 1) / 82 is whole: in the middle alone. There either side may count.
                if (x == 20 || y == 20) continue;
                EXPECT_EQ(a.visibility.at(x, y), b.visibility.at(pixels - 1 - x, y)) << x << ", " << y;
                EXPECT_EQ(a.visibility.at(x, y), c.visibility.at(y, x)) << x << ", " << y;
            }
    }
}

} // namespace
} // namespace penumbra::test
