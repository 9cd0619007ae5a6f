// The device's masks against the paper's formulas in double precision, from the same disparity texels and the same receiver points.
#include "support/device_run.hpp"
#include "support/maps.hpp"

#include "common/shared.h"

namespace penumbra::test {
namespace {

// Compares every receiver. Returns how many are in penumbra with a bound below 2^-10, so that a test can tell that it saw some.
int compare_with_oracle(const SoftRun& r, const std::string& what)
{
    int penumbra = 0, failures = 0;
    for (std::size_t i = 0; i < r.points.size(); ++i) {
        const float seen = r.visibility[i];
        if (r.points[i].d == NO_RECEIVER) {
            EXPECT_EQ(seen, 1.0f) << what << ", nothing at " << i;
            continue;
        }
        const oracle::Bounded expected = oracle::visibility(r.maps, r.points[i], r.settings);
        penumbra += expected.value > 0 && expected.value < 1 && expected.bound < 0x1p-10;
        if (std::abs(seen - expected.value) <= expected.bound) continue;
        if (++failures <= 3)
            ADD_FAILURE() << what << ", receiver " << i << " (" << r.points[i].xi << ", " << r.points[i].eta << ", " << r.points[i].d
                          << "): " << seen << ", expected " << expected.value << " within " << expected.bound;
    }
    EXPECT_EQ(failures, 0) << what;
    return penumbra;
}

struct Size {
    int width, height;
};
constexpr Size sizes[] = {{1, 1}, {1, 61}, {61, 1}, {7, 93}, {93, 7}, {32, 32}};

// A camera beside the light that looks at the receivers at an angle.
Camera oblique_camera()
{
    const double c = std::cos(0.3), s = std::sin(0.3);
    return {.frame = {.origin = {1.5, 0.5, -1}, .x = {c, 0, -s}, .y = {0, 1, 0}, .z = {s, 0, c}},
            .orthographic = false,
            .half_extent = {0.7, 0.5}};
}

SoftCase random_case(Size occluders, Size receivers, Sides sides, std::uint32_t seed)
{
    SoftCase c{.front = random_map(occluders.width, occluders.height, 2, 4, 0.2, seed),
               .back = {},
               .settings = {.visibility = PatchVisibility::sum, .sides = sides},
               .receivers = random_map(receivers.width, receivers.height, 5, 9, 0.1, seed + 1),
               .camera = {}};
    c.back = random_map(occluders.width, occluders.height, 3, 5, 0.3, seed + 2);
    return c;
}

TEST(SoftShadowMapOracle, RandomMapsOfEverySize)
{
    const auto context = device_context();
    int penumbra = 0;
    std::uint32_t seed = 1;
    for (const Size occluders : sizes)
        for (const Size receivers : sizes) {
            const std::string what = std::to_string(occluders.width) + " x " + std::to_string(occluders.height) + " occluders, " +
                                     std::to_string(receivers.width) + " x " + std::to_string(receivers.height) + " receivers";
            penumbra += compare_with_oracle(run(context, random_case(occluders, receivers, Sides::front, seed += 3)), what);
        }
    EXPECT_GT(penumbra, 1000);
}

TEST(SoftShadowMapOracle, EverySide)
{
    const auto context = device_context();
    for (const Sides sides : {Sides::front, Sides::back, Sides::both}) {
        const SoftRun r = run(context, random_case({61, 33}, {45, 21}, sides, 77));
        EXPECT_EQ(r.maps.size(), sides == Sides::both ? 2u : 1u);
        EXPECT_GT(compare_with_oracle(r, "sides " + std::to_string(static_cast<int>(sides))), 100);
    }
}

TEST(SoftShadowMapOracle, ReceiversFromAnotherCamera)
{
    const auto context = device_context();
    for (const Size size : {Size{1, 1}, Size{93, 7}, Size{61, 33}}) {
        SoftCase c = random_case({64, 64}, size, Sides::both, 5);
        c.camera = oblique_camera();
        compare_with_oracle(run(context, c), std::to_string(size.width) + " pixels wide");
    }
}

// Lights from a sliver to ten times the scene, and uneven ones.
TEST(SoftShadowMapOracle, LightsOfEveryExtent)
{
    const auto context = device_context();
    const double extents[][2] = {{0, 0}, {1e-6, 1e-6}, {1e-3, 1}, {1, 0}, {0, 1}, {2, 3}, {90, 90}};
    for (const auto& extent : extents) {
        SoftCase c = random_case({33, 21}, {29, 31}, Sides::front, 11);
        c.half_u = extent[0];
        c.half_v = extent[1];
        compare_with_oracle(run(context, c), "light of " + std::to_string(extent[0]) + " x " + std::to_string(extent[1]));
    }
}

// Full-size maps; the compensated sum has the sharper bound.
TEST(SoftShadowMapOracle, LargerMapsAndCompensatedSums)
{
    const auto context = device_context();
    for (const Accumulator accumulator : {Accumulator::binary32, Accumulator::compensated}) {
        SoftCase c = random_case({128, 128}, {40, 24}, Sides::both, 21);
        c.settings.accumulator = accumulator;
        EXPECT_GT(compare_with_oracle(run(context, c), accumulator == Accumulator::binary32 ? "binary32" : "compensated"), 100);
    }
}

// Occluders that reach from the light to behind the receivers: only what is nearer to the light than a receiver counts.
TEST(SoftShadowMapOracle, OccludersNearAndFar)
{
    const auto context = device_context();
    SoftCase c = random_case({40, 40}, {40, 40}, Sides::front, 31);
    c.front = random_map(40, 40, 1e-3, 100, 0.3, 41);
    c.receivers = random_map(40, 40, 0.5, 50, 0, 43);
    compare_with_oracle(run(context, c), "near and far");
}

// What the tiles leave out adds nothing: fewer pairs than all are evaluated, and the mask is still the oracle's.
TEST(SoftShadowMapOracle, CullingLeavesOutPairsThatAddNothing)
{
    SoftCase c = random_case({128, 128}, {64, 64}, Sides::front, 51);
    c.half_u = c.half_v = 0.02;
    const SoftRun r = run(device_context(), c);
    EXPECT_GT(compare_with_oracle(r, "culled"), 100);
    EXPECT_GT(r.counts.pairs, 0u);
    EXPECT_LT(r.counts.pairs, std::uint64_t{128} * 128 * 64 * 64 / 10);
    EXPECT_EQ(r.counts.receivers, static_cast<std::uint64_t>(
                                      std::count_if(r.points.begin(), r.points.end(), [](const auto& p) { return p.d != NO_RECEIVER; })));
}

// The bound is worth something: an oracle of a map with one texel missing is noticed.
TEST(SoftShadowMapOracle, BoundIsSharpEnoughToMissATexel)
{
    SoftCase c{.front = flat(16, 16, 2), .back = {}, .settings = {.visibility = PatchVisibility::sum, .sides = Sides::front}, .receivers = flat(1, 1, 8), .camera = {}};
    c.half_u = c.half_v = 1;
    SoftRun r = run(device_context(), c);
    r.maps[0].texels[8 * 16 + 8].disparity = 0;
    const oracle::Bounded without = oracle::visibility(r.maps, r.points[0], r.settings);
    EXPECT_GT(without.value - r.visibility[0], 10 * without.bound);
}

} // namespace
} // namespace penumbra::test
