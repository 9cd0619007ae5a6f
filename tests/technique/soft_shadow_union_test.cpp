// The union of micro-patches against samples that are looked at one by one, and against areas that are known.
#include <bit>
#include <numbers>

#include "support/device_run.hpp"
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

constexpr int side = 32;

int reversed(int j)
{
    int result = 0;
    for (int bit = 0; bit < 5; ++bit) result |= (j >> bit & 1) << (4 - bit);
    return result;
}
double phase(int k) { return (reversed(k) + 0.5) / side; }                       // of a row, along u
// Of a column, along v: a linear map of its number's bits, and 21.
double column_phase(int i)
{
    constexpr int rows[5] = {5, 19, 3, 15, 11};
    int mapped = 21;
    for (int bit = 0; bit < 5; ++bit) mapped ^= (std::popcount(static_cast<unsigned>(rows[bit] & i)) & 1) << bit;
    return (mapped + 0.5) / side;
}

SoftCase united(const DepthMap& front, const DepthMap& receivers, Sides sides = Sides::front)
{
    return {.front = front, .back = {}, .settings = {.visibility = PatchVisibility::united, .sides = sides, .bias = 0, .tolerance = 0}, .receivers = receivers, .camera = {}};
}

// What a receiver sees past patches that share no edge: each a rectangle at its own depth, sample by sample. `unsure`: samples that lie within a
// thousandth of a sample's distance of an edge.
struct Seen {
    double visibility;
    int unsure;
};
Seen seen_past(const SoftRun& r, const oracle::Receiver& p, double half, double tangent)
{
    int hidden = 0, unsure = 0;
    for (int k = 0; k < side; ++k)
        for (int i = 0; i < side; ++i) {
            const double u = (i + phase(k)) / side, v = (k + column_phase(i)) / side;
            bool dark = false, near = false;
            for (const oracle::Map& map : r.maps)
                for (int y = 0; y < map.height; ++y)
                    for (int x = 0; x < map.width; ++x) {
                        const double d = map.texels[static_cast<std::size_t>(y * map.width + x)].disparity;
                        if (!(d > p.d)) continue;
                        const double k_light = tangent / (2 * half) / (d - p.d);
                        const double u0 = 0.5 + (2. * x / map.width - 1 - p.xi) * k_light, u1 = 0.5 + (2. * (x + 1) / map.width - 1 - p.xi) * k_light;
                        const double v0 = 0.5 + (1 - 2. * (y + 1) / map.height - p.eta) * k_light, v1 = 0.5 + (1 - 2. * y / map.height - p.eta) * k_light;
                        const double inside = std::min(std::min(u - u0, u1 - u), std::min(v - v0, v1 - v));
                        dark |= inside > 0;
                        near |= std::abs(inside) < 1e-3 / side;
                    }
            hidden += dark;
            unsure += near;
        }
    return {1 - hidden / double{side * side}, unsure};
}

// Every second texel of every second row, so that none has a neighbour.
DepthMap apart(int size, std::uint32_t seed)
{
    DepthMap map = random_map(size, size, 2, 4, 0.2, seed);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
            if (x % 2 || y % 2) map.depth[static_cast<std::size_t>(y * size + x)] = nothing_there;
    return map;
}

TEST(SoftShadowUnion, PatchesApartHideTheirSamples)
{
    const auto context = device_context();
    int penumbra = 0;
    for (const double half : {0.05, 0.25, 1.5}) {
        SoftCase c = united(apart(24, 5), random_map(24, 17, 5, 9, 0.1, 6));
        c.half_u = c.half_v = half;
        const SoftRun r = run(context, c);
        for (std::size_t i = 0; i < r.points.size(); ++i) {
            if (r.points[i].d == NO_RECEIVER) {
                EXPECT_EQ(r.visibility[i], 1.0F);
                continue;
            }
            const Seen expected = seen_past(r, r.points[i], half, 1);
            EXPECT_NEAR(r.visibility[i], expected.visibility, expected.unsure / double{side * side}) << i << ", light " << half;
            penumbra += expected.visibility > 0 && expected.visibility < 1;
        }
    }
    EXPECT_GT(penumbra, 300);
}

// A half plane over the samples, against its share of the square: 7.6/1024, and what the counting of the exact share is off by, 1/512.
TEST(SoftShadowUnion, AnEdgeOfAnyDirectionIsResolved)
{
    // The samples themselves: below the line through the light at distance h from its middle.
    double worst = 0;
    for (int degrees = 0; degrees < 360; degrees += 7)
        for (double h = -0.6; h < 0.6; h += 0.01) {
            const double a = std::cos(degrees * std::numbers::pi / 180), b = std::sin(degrees * std::numbers::pi / 180);
            int below = 0;
            constexpr int fine = 64;
            int exact = 0; // of fine x fine places in each of side x side cells
            for (int k = 0; k < side; ++k)
                for (int i = 0; i < side; ++i) below += a * ((i + phase(k)) / side - 0.5) + b * ((k + column_phase(i)) / side - 0.5) < h;
            for (int j = 0; j < fine * 8; ++j)
                for (int i = 0; i < fine * 8; ++i) exact += a * ((i + 0.5) / (fine * 8) - 0.5) + b * ((j + 0.5) / (fine * 8) - 0.5) < h;
            worst = std::max(worst, std::abs(below / double{side * side} - exact / double{fine * 8 * fine * 8}));
        }
    RecordProperty("worst", std::to_string(worst));
    EXPECT_LT(worst, 7.6 / 1024 + 1. / 512);
}

// One plate, whose texels share edges, at one depth: the exact rectangle.
TEST(SoftShadowUnion, APlateHasNoSeams)
{
    const auto context = device_context();
    for (const double half : {0.05, 0.3, 2.0}) {
        SoftCase c = united(boxes(64, 64, 4, {{16, 48, 8, 56}}), flat(61, 61, 8));
        c.half_u = c.half_v = half;
        const SoftRun r = run(context, c);
        for (std::size_t i = 0; i < r.points.size(); ++i) {
            const oracle::Receiver& p = r.points[i];
            const double k = 1 / (2 * half) / (0.25 - p.d);
            const auto within = [&](double at) { return std::clamp(0.5 + at * k, 0.0, 1.0); };
            const double hidden = (within(0.5 - p.xi) - within(-0.5 - p.xi)) * (within(0.75 - p.eta) - within(-0.75 - p.eta));
            // A straight edge along an axis is right to 1/1024; there are four.
            EXPECT_NEAR(r.visibility[i], 1 - hidden, 4.0 / 1024) << i << ", light " << half;
        }
    }
}

// A tilted sheet of many texels is dark, whether its patches are joined or one by one.
TEST(SoftShadowUnion, ATiltedSheetIsDark)
{
    const auto context = device_context();
    DepthMap sheet = flat(96, 96, 4);
    for (int y = 0; y < 96; ++y)
        for (int x = 0; x < 96; ++x) {
            // A plane in light space: its disparity is linear over the map.
            sheet.depth[static_cast<std::size_t>(y * 96 + x)] = static_cast<float>(1 / (0.25 + 0.0012 * (x - 48) + 0.0007 * (y - 48)));
        }
    for (const double half : {0.02, 0.3, 1.0}) {
        SoftCase c = united(sheet, flat(61, 61, 12));
        c.half_u = c.half_v = half;
        const SoftRun r = run(context, c);
        int dark = 0;
        for (std::size_t i = 0; i < r.points.size(); ++i) {
            const oracle::Receiver& p = r.points[i];
            if (std::abs(p.xi) > 0.3 || std::abs(p.eta) > 0.3) continue; // whose light meets the sheet's border
            // Where four patches meet, their edges step past each other: a sample may slip through, and at most three were seen to.
            EXPECT_LE(r.visibility[i], 3.0F / 1024) << i << ", light " << half;
            ++dark;
        }
        EXPECT_GT(dark, 100);
    }
}

TEST(SoftShadowUnion, AFurtherOccluderNeverBrightens)
{
    const auto context = device_context();
    // The further ones lie where the first map has nothing, so that they are no back of it and move none of its rims.
    SoftCase one = united(random_map(40, 40, 2, 4, 0.7, 9), random_map(48, 48, 5, 9, 0.1, 10)), two = one;
    two.settings.sides = Sides::both;
    two.back = apart(40, 11);
    for (std::size_t i = 0; i < two.front.depth.size(); ++i)
        if (two.front.depth[i] != nothing_there) two.back->depth[i] = nothing_there;
    const SoftRun before = run(context, one), after = run(context, two);
    int darker = 0;
    for (std::size_t i = 0; i < before.points.size(); ++i) {
        EXPECT_LE(after.visibility[i], before.visibility[i]) << i;
        darker += after.visibility[i] < before.visibility[i];
    }
    EXPECT_GT(darker, 500);
}

// Whichever map comes first.
TEST(SoftShadowUnion, FrontAndBackAreOneSet)
{
    const auto context = device_context();
    SoftCase c = united(apart(32, 3), random_map(48, 48, 5, 9, 0.1, 4), Sides::both);
    c.back = apart(32, 8);
    // No texel of one is a texel of the other, so that no rim depends on both.
    for (std::size_t i = 0; i < c.front.depth.size(); ++i)
        if (c.front.depth[i] != nothing_there) c.back->depth[i] = nothing_there;
    SoftCase swapped = c;
    swapped.front = *c.back;
    swapped.back = c.front;
    EXPECT_EQ(run(context, c).visibility, run(context, swapped).visibility);
}

} // namespace
} // namespace penumbra::test
