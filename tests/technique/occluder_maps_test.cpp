// Occluder maps on the device: disparity, reduction by area and by nearest texel, the pyramid, slopes.
#include "support/device_run.hpp"
#include "support/maps.hpp"

#include "technique/occluder_maps.hpp"

namespace penumbra::test {
namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

std::vector<cl_float2> texels_of(opencl::Work& work, const DepthMap& depth, MapSize size, Reduction reduction)
{
    const auto uploaded = work.upload(std::span<const float>(depth.depth), "depth");
    return work.read(occluder_map(work, uploaded.memory(), {depth.width, depth.height}, size, reduction, depth.precision).texels);
}

bool is_there(float depth) { return std::isfinite(depth) && depth > 0; }

// Mean disparity and covered share of a texel of the smaller map, in double precision.
struct Reference {
    double disparity, covered;
};
Reference reference_texel(const DepthMap& depth, MapSize size, int x, int y)
{
    const double rx = static_cast<double>(depth.width) / size.width, ry = static_cast<double>(depth.height) / size.height;
    double sum = 0, covered = 0;
    for (int j = 0; j < depth.height; ++j)
        for (int i = 0; i < depth.width; ++i) {
            const double sx = std::min((x + 1) * rx, i + 1.0) - std::max(x * rx, static_cast<double>(i));
            const double sy = std::min((y + 1) * ry, j + 1.0) - std::max(y * ry, static_cast<double>(j));
            if (sx <= 0 || sy <= 0 || !is_there(depth.at(i, j))) continue;
            covered += sx * sy;
            sum += sx * sy / depth.at(i, j);
        }
    return {covered > 0 ? sum / covered : 0, covered / (rx * ry)};
}

TEST(OccluderMap, DisparityIsOneOverDepthAndNothingIsZero)
{
    opencl::Work work(device_context());
    DepthMap depth{.width = 3, .height = 3, .depth = {2, 1e-6f, 1e6f, nothing_there, -nothing_there, not_a_number, 0.0f, -0.0f, -3}};
    const auto texels = texels_of(work, depth, {3, 3}, Reduction::area);
    for (std::size_t i = 0; i < 9; ++i) {
        const float z = depth.depth[i];
        EXPECT_EQ(texels[i].s[0], is_there(z) ? 1 / z : 0.0f) << z;
        EXPECT_EQ(texels[i].s[1], is_there(z) ? 1.0f : 0.0f) << z;
    }
}

// A depth so small that its disparity overflows would let an infinity into the arithmetic.
TEST(OccluderMap, DisparityIsFinite)
{
    opencl::Work work(device_context());
    const DepthMap depth{.width = 2, .height = 1, .depth = {std::numeric_limits<float>::denorm_min(), 0x1p-127f}};
    for (const cl_float2& texel : texels_of(work, depth, {2, 1}, Reduction::area)) EXPECT_TRUE(std::isfinite(texel.s[0]));
}

TEST(OccluderMap, SizesKeepTheAspect)
{
    const auto is = [](MapSize size, int w, int h) { return size.width == w && size.height == h; };
    EXPECT_TRUE(is(reduced_size(256, 256, 0), 256, 256));
    EXPECT_TRUE(is(reduced_size(256, 128, 64), 64, 32));
    EXPECT_TRUE(is(reduced_size(61, 1, 7), 7, 1));
    EXPECT_TRUE(is(reduced_size(1, 93, 1), 1, 1));
    EXPECT_TRUE(is(reduced_size(93, 61, 93), 93, 61));
    EXPECT_TRUE(is(reduced_size(93, 61, 1000), 93, 61)); // never larger than it is
}

// Whole ratios, broken ones, and ones that differ by axis, with holes.
TEST(OccluderMap, AreaReductionMatchesDoublePrecision)
{
    opencl::Work work(device_context());
    const MapSize cases[][2] = {{{64, 64}, {16, 16}}, {{61, 93}, {7, 11}}, {{93, 7}, {31, 2}}, {{1, 61}, {1, 7}}, {{100, 3}, {99, 1}}};
    for (const auto& [from, to] : cases) {
        const DepthMap depth = random_map(from.width, from.height, 1, 9, 0.3, 5);
        const auto texels = texels_of(work, depth, to, Reduction::area);

        // Places of the borders (up to `from`) are right to a few units in the last place, a share therefore to that many in a texel of
        // `ratio` texels' width; sums add half a unit each.
        const double rx = static_cast<double>(from.width) / to.width, ry = static_cast<double>(from.height) / to.height;
        const double border = 4 * 0x1p-24 * (from.width / rx + from.height / ry);
        const double bound = border + (rx + 2) * (ry + 2) * 0x1p-24 * 2;
        for (int y = 0; y < to.height; ++y)
            for (int x = 0; x < to.width; ++x) {
                const Reference expected = reference_texel(depth, to, x, y);
                const cl_float2 texel = texels[static_cast<std::size_t>(y * to.width + x)];
                EXPECT_NEAR(texel.s[1], expected.covered, bound);
                // A share that is off by `bound` of the whole moves a mean over `covered` of it by that over `covered`.
                if (expected.covered > 1e-4) {
                    EXPECT_NEAR(texel.s[0], expected.disparity, bound / expected.covered);
                }
                EXPECT_LE(texel.s[1], 1.0f);
            }
    }
}

TEST(OccluderMap, AreaReductionOfOneDepthIsThatDepth)
{
    opencl::Work work(device_context());
    for (const MapSize to : {MapSize{8, 8}, MapSize{7, 5}, MapSize{1, 1}, MapSize{63, 30}})
        for (const cl_float2& texel : texels_of(work, flat(64, 31, 3), to, Reduction::area)) {
            // Numerator and denominator round alike but not equally: n terms each, half a unit in the last place a term.
            const double terms = (64.0 / to.width + 2) * (31.0 / to.height + 2);
            EXPECT_NEAR(texel.s[0], 1.0 / 3, terms * 0x1p-23);
            EXPECT_NEAR(texel.s[1], 1, terms * 0x1p-23);
            EXPECT_LE(texel.s[1], 1);
        }
}

// Whole ratios: shares are exactly 1, so nothing rounds but the disparities' sum.
TEST(OccluderMap, CoveredShareCountsTexels)
{
    opencl::Work work(device_context());
    const DepthMap depth = boxes(16, 16, 2, {{0, 1, 0, 1}, {4, 8, 0, 2}, {8, 16, 8, 16}});
    const auto texels = texels_of(work, depth, {4, 4}, Reduction::area);
    const float expected[16] = {1 / 16.f, 0.5f, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 1};
    for (std::size_t i = 0; i < 16; ++i) {
        EXPECT_EQ(texels[i].s[1], expected[i]) << i;
        EXPECT_EQ(texels[i].s[0], expected[i] > 0 ? 0.5f : 0.0f) << i;
    }
}

// A tilted plane's disparity is linear across the image: its mean over a texel is its value at the texel's centre.
TEST(OccluderMap, TiltedPlaneKeepsItsPlane)
{
    opencl::Work work(device_context());
    const auto disparity = [](double xi, double eta) { return 0.5 + 0.2 * xi - 0.1 * eta; };
    const DepthMap depth =
        map_of(96, 96, [&](int x, int y) { return static_cast<float>(1 / disparity((2 * x + 1) / 96.0 - 1, 1 - (2 * y + 1) / 96.0)); });
    for (const int n : {32, 7}) {
        const auto texels = texels_of(work, depth, {n, n}, Reduction::area);
        const double terms = (96.0 / n + 2) * (96.0 / n + 2);
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) {
                const double expected = disparity((2 * x + 1.0) / n - 1, 1 - (2 * y + 1.0) / n);
                // With a broken ratio a texel's part is taken to have the whole texel's mean: it is off by at most a quarter of the part
                // that is cut (p (1 - p) / 2 <= 1/8 of a texel's step on each of two sides, per axis), over the ratio.
                const double cut = 96 % n == 0 ? 0 : 2 * 0.125 * (0.3 * 2 / 96) / (96.0 / n);
                EXPECT_NEAR(texels[static_cast<std::size_t>(y * n + x)].s[0], expected, cut + terms * 0x1p-24)
                    << n << ": " << x << ", " << y;
            }
    }
}

TEST(OccluderMap, NearestTakesTheTexelUnderTheCentre)
{
    opencl::Work work(device_context());
    const MapSize cases[][2] = {{{64, 64}, {16, 16}}, {{61, 93}, {7, 11}}, {{93, 7}, {31, 2}}};
    for (const auto& [from, to] : cases) {
        const DepthMap depth = random_map(from.width, from.height, 1, 9, 0.3, 9);
        const auto texels = texels_of(work, depth, to, Reduction::nearest);
        for (int y = 0; y < to.height; ++y)
            for (int x = 0; x < to.width; ++x) {
                // Centres on a border belong to the texel after it.
                const int i = static_cast<int>(std::floor((x + 0.5) * from.width / to.width));
                const int j = static_cast<int>(std::floor((y + 0.5) * from.height / to.height));
                const float z = depth.at(i, j);
                const cl_float2 texel = texels[static_cast<std::size_t>(y * to.width + x)];
                EXPECT_EQ(texel.s[0], is_there(z) ? 1 / z : 0.0f);
                EXPECT_EQ(texel.s[1], is_there(z) ? 1.0f : 0.0f);
            }
    }
}

// Each level holds the greatest disparity of its blocks, at sizes that are no multiple of a block.
TEST(OccluderMap, PyramidHoldsTheNearest)
{
    opencl::Work work(device_context(true));
    for (const MapSize size : {MapSize{1, 1}, MapSize{7, 93}, MapSize{93, 7}, MapSize{64, 65}, MapSize{129, 61}}) {
        const DepthMap map = random_map(size.width, size.height, 1, 5, 0.9, 3);
        const auto uploaded = work.upload(std::span<const float>(map.depth), "depth");
        OccluderDepth depth{.light = light_frame(rectangle_light(1, 1)),
                            .camera = light_camera(light_frame(rectangle_light(1, 1)), {1, 1}, {0, 0, 0}),
                            .width = size.width,
                            .height = size.height,
                            .precision = map.precision,
                            .front = uploaded.memory(),
                            .back = {},
                                .layers = {}};
        const PreparedSoftShadowMap prepared = prepare_soft_shadow_map(work, depth, {.visibility = PatchVisibility::sum, .sides = Sides::front, .layers = 0});
        float nearest = 0;
        const auto expect_level = [&](const std::vector<float>& level, int block) {
            const int columns = (size.width + block - 1) / block, rows = (size.height + block - 1) / block;
            ASSERT_EQ(level.size(), static_cast<std::size_t>(columns * rows));
            for (int by = 0; by < rows; ++by)
                for (int bx = 0; bx < columns; ++bx) {
                    float expected = 0;
                    for (int y = by * block; y < std::min((by + 1) * block, size.height); ++y)
                        for (int x = bx * block; x < std::min((bx + 1) * block, size.width); ++x)
                            expected = std::max(expected, is_there(map.at(x, y)) ? 1 / map.at(x, y) : 0.0f);
                    EXPECT_EQ(level[static_cast<std::size_t>(by * columns + bx)], expected) << block << ": " << bx << ", " << by;
                    nearest = std::max(nearest, expected);
                }
        };
        expect_level(work.read(prepared.sides[0].blocks), 8);
        expect_level(work.read(prepared.sides[0].superblocks), 64);
        EXPECT_EQ(prepared.nearest, nearest);
    }
    EXPECT_NO_THROW(work.finish());
}

// Steps are the surface's own, not a silhouette's.
TEST(OccluderMap, SlopesAreTheSurfacesOwn)
{
    opencl::Work work(device_context(true));
    // A plane with disparity steps of 1/256 across and 1/512 down; a nearer flat square in its middle; a hole in a corner.
    const auto disparity = [](int x, int y) { return static_cast<float>(0.5 + x / 256.0 + y / 512.0); };
    const DepthMap depth = map_of(24, 24, [&](int x, int y) {
        if (x < 3 && y < 3) return nothing_there;
        return x >= 8 && x < 16 && y >= 8 && y < 16 ? 0.5f : 1 / disparity(x, y);
    });
    const auto uploaded = work.upload(std::span<const float>(depth.depth), "depth");
    const OccluderMap map = occluder_map(work, uploaded.memory(), {24, 24}, {24, 24}, Reduction::area, depth.precision);
    const auto steps = work.read(map.steps);
    for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 24; ++x) {
            const cl_float2 step = steps[static_cast<std::size_t>(y * 24 + x)];
            const bool hole = x < 3 && y < 3, square = x >= 8 && x < 16 && y >= 8 && y < 16;
            // 1 / (1 / d): two roundings each of two values below 1.
            EXPECT_NEAR(step.s[0], hole || square ? 0 : 1 / 256.0, 0x1p-22) << x << ", " << y;
            EXPECT_NEAR(step.s[1], hole || square ? 0 : 1 / 512.0, 0x1p-22) << x << ", " << y;
        }
    EXPECT_NO_THROW(work.finish());
}

} // namespace
} // namespace penumbra::test
