// Prefiltered levels: how many, where they lie, and that each texel is the mean it stands for, borders included.
#include <algorithm>
#include <cmath>

#include "technique/occlusion_texture_run.hpp"

namespace penumbra::test {
namespace {

namespace slices = oracle::slices;

constexpr LevelKind kinds[] = {LevelKind::nbuffer, LevelKind::mipmap, LevelKind::smooth};

TEST(LevelCount, UpToTheKernelAndNoFurtherThanTheWindow)
{
    EXPECT_EQ(levels_for(0, 256, LevelKind::nbuffer), 1);
    EXPECT_EQ(levels_for(1, 256, LevelKind::nbuffer), 1);
    EXPECT_EQ(levels_for(1.001, 256, LevelKind::nbuffer), 2);
    EXPECT_EQ(levels_for(2, 256, LevelKind::nbuffer), 2);
    EXPECT_EQ(levels_for(100, 256, LevelKind::nbuffer), 8); // 128
    for (const double size : {257.0, 1e9, 1e300}) EXPECT_EQ(levels_for(size, 256, LevelKind::mipmap), 9) << size;
    EXPECT_EQ(levels_for(1e9, 257, LevelKind::mipmap), 10);
    EXPECT_EQ(levels_for(1e9, 4, LevelKind::smooth), 3);
    EXPECT_EQ(levels_for(1e9, 4096, LevelKind::table), 1);
}

// Nothing overlaps, all is within the sum, and what surrounds a level's texels is there.
TEST(LevelLayout, LevelsLieBesideEachOther)
{
    for (const LevelKind kind : kinds)
        for (const int side : {4, 5, 31, 256, 4096})
            for (const std::vector<int>& levels : {std::vector<int>{}, {1}, {5, 3, 3, 1}, std::vector<int>(64, 9)}) {
                const LevelLayout layout = level_layout(levels, side, kind);
                ASSERT_EQ(layout.levels.size(), levels.empty() ? 0u : static_cast<std::size_t>(levels[0]));
                std::uint64_t end = 0;
                for (std::size_t l = 0; l < layout.levels.size(); ++l) {
                    const OcclusionLevel& level = layout.levels[l];
                    EXPECT_EQ(static_cast<std::uint64_t>(level.offset) * 1024, end) << l;
                    EXPECT_EQ(level.stride % 16, 0);
                    EXPECT_GE(level.stride, level.width);
                    EXPECT_GE(level.rows, level.height);
                    EXPECT_EQ(layout.textures[l],
                              std::count_if(levels.begin(), levels.end(), [&](int n) { return n > static_cast<int>(l); }));
                    const auto elements = static_cast<std::uint64_t>(layout.textures[l]) * static_cast<std::uint64_t>(level.rows) *
                                          static_cast<std::uint64_t>(level.stride);
                    end += (elements + 1023) / 1024 * 1024;
                    // The window's corners lie inside by more than half a texel, so that four texels surround each of their places.
                    EXPECT_GE(level.shift, 0.5f) << l;
                    EXPECT_LE(static_cast<float>(side) * level.scale + level.shift, static_cast<float>(level.width) - 0.5f) << l;
                }
                EXPECT_EQ(layout.elements, end);
            }
}

// Every stored texel of every level of every texture against a brute-force mean (or, smooth, the convolution of all taps at once).
// binary32: means of fewer than 2^12 x 2^12 bits are exact. 16 bits: half a unit of 2^-16 a level, that is of 1 / 65535. Smooth levels
// round: 30 roundings of numbers up to 1 a level.
void expect_levels(const SliceCase& c, const std::string& what)
{
    const auto context = device_context();
    const slices::Scene scene = oracle_scene(context, c);
    const auto textures = slices::textures_of(scene);
    const SliceRun r = run(context, c);
    const slices::Levels kind = slices::levels_of(scene);
    ASSERT_FALSE(r.parts[0].planes.empty());
    for (std::size_t t = 0; t < r.parts[0].planes.size(); ++t) {
        const OcclusionPlane& plane = r.parts[0].planes[t];
        const auto& texture = textures[static_cast<std::size_t>(plane.slice)][static_cast<std::size_t>(std::max(plane.layer, 0))];
        ASSERT_LE(plane.levels, static_cast<int>(r.parts[0].levels.size()));
        for (int l = 0; l < plane.levels; ++l) {
            const OcclusionLevel& level = r.parts[0].levels[static_cast<std::size_t>(l)];
            const int apart = kind == slices::Levels::mipmap ? 1 << l : 1, texels = (scene.view.width + apart - 1) / apart;
            const int before = (level.width - texels) / 2;
            const double bound = c.settings.storage == LevelStorage::normalized16 ? (l + 1e-3) * 0.5 / 65535
                                 : kind == slices::Levels::smooth                 ? 30 * l * 0x1p-24
                                                                                  : 0;
            double worst = 0, most = 0;
            for (int y = 0; y < level.height; ++y)
                for (int x = 0; x < level.width; ++x) {
                    const double expected = slices::level_value(texture, kind, l, x - before, y - before);
                    const double value = stored(r.parts[0], c.settings, static_cast<std::size_t>(l), t, x, y);
                    worst = std::max(worst, std::abs(value - expected));
                    most = std::max(most, expected);
                    // What surrounds a level is nothing, so that places beyond it are clamped to nothing.
                    if (x == 0 || y == 0 || x == level.width - 1 || y == level.height - 1) {
                        ASSERT_EQ(value, 0) << what << ": border of level " << l;
                        ASSERT_EQ(expected, 0) << what << ": level " << l << " is stored too narrow";
                    }
                }
            EXPECT_LE(worst, bound) << what << ": texture " << t << ", level " << l;
            EXPECT_GT(most, 0);
        }
    }
}

SliceCase levelled(const OcclusionTexture& settings)
{
    return {.light = rectangle_light(4, 4),
            .casters = {triangles_in(40, {-2, -2, 3}, {2, 2, 6}, 1, 1), sheet(-2.5, 2.5, -2.5, -1.5, 4.5)},
            .settings = settings};
}

TEST(Levels, AreMeansOfSquares)
{
    for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap})
        for (const LevelStorage storage : {LevelStorage::binary32, LevelStorage::normalized16})
            for (const int resolution : {4, 7, 33, 64})
                expect_levels(levelled({.slices = 3, .resolution = resolution, .prefilter = prefilter, .storage = storage}),
                              std::to_string(resolution) + " texels, prefilter " + std::to_string(static_cast<int>(prefilter)));
}

TEST(Levels, OfLayersAndOfSlicesSeenInTheNext)
{
    expect_levels(levelled({.slices = 9, .resolution = 33, .prefilter = Prefilter::nbuffer, .combine = Combine::layered, .layers = 2}), "layers");
    expect_levels(levelled({.slices = 64, .resolution = 20, .prefilter = Prefilter::nbuffer, .combine = Combine::layered_max, .layers = 8}), "eight layers");
    expect_levels(levelled({.slices = 9, .resolution = 33, .prefilter = Prefilter::nbuffer, .combine = Combine::product, .leak_fix = true}), "leak fix");
    expect_levels(levelled({.slices = 64, .resolution = 20, .prefilter = Prefilter::nbuffer, .combine = Combine::product, .leak_fix = true}), "leak fix of 64 slices");
}

TEST(Levels, OfADirectionalLightAreSmooth)
{
    for (const LevelStorage storage : {LevelStorage::binary32, LevelStorage::normalized16})
        for (const int resolution : {4, 17, 24}) {
            SliceCase c = levelled({.slices = 3, .resolution = resolution, .prefilter = Prefilter::nbuffer, .storage = storage});
            c.light = DirectionalLight{.direction = {0, 0, -1}, .angular_diameter_deg = 0.53, .up = Vec3(0, 1, 0)};
            expect_levels(c, "sun, " + std::to_string(resolution));
        }
}

// Integers: exact at every corner.
TEST(Tables, AreCounts)
{
    const auto context = device_context();
    for (const int resolution : {4, 31, 65}) {
        const SliceCase c = levelled({.slices = 40, .resolution = resolution, .prefilter = Prefilter::summed_area, .combine = Combine::product});
        const slices::Scene scene = oracle_scene(context, c);
        const auto textures = slices::textures_of(scene);
        const SliceRun r = run(context, c);
        const auto side = static_cast<std::size_t>(resolution + 1);
        for (std::size_t t = 0; t < r.parts[0].planes.size(); ++t)
            for (int y = 0; y <= resolution; ++y)
                for (int x = 0; x <= resolution; ++x) {
                    cl_uint value = 0;
                    std::memcpy(
                        &value,
                        r.parts[0].data.data() + 4 * ((t * side + static_cast<std::size_t>(y)) * side + static_cast<std::size_t>(x)), 4);
                    ASSERT_EQ(value, textures[static_cast<std::size_t>(r.parts[0].planes[t].slice)][0].area(0, x, 0, y))
                        << t << ": " << x << ", " << y;
                }
    }
}

} // namespace
} // namespace penumbra::test
