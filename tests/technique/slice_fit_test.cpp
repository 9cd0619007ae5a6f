// Where slices lie: ranges, planes and windows.
#include <algorithm>
#include <cmath>

#include "technique/occlusion_texture_run.hpp"

namespace penumbra::test {
namespace {

SliceCasters casters_of(const std::vector<TriangleMesh>& meshes)
{
    return slice_casters(light_frame(rectangle_light(1, 1)), pointers_to(meshes));
}

TEST(SliceCastersOf, HoldLightSpaceAndNothingThatIsNotFinite)
{
    TriangleMesh mesh = mesh_of({{1, 2, 3}, {4, 5, 6}, {7, 8, 10}, {NAN, 0, 0}, {0, INFINITY, 0}}, {{0, 1, 2}, {0, 1, 3}, {4, 1, 2}});
    const SliceCasters casters = casters_of({sheet(0, 1, 0, 1, 2), mesh});
    EXPECT_EQ(casters.triangles, (std::vector<std::int32_t>{0, 1, 2, 0, 2, 3, 4, 5, 6}));
    EXPECT_EQ(casters.left_out, 2u);
    EXPECT_EQ(casters.vertices[12], 1);
    EXPECT_EQ(casters.vertices[13], 2);
    EXPECT_EQ(casters.vertices[14], 3);
    EXPECT_TRUE(casters_of({}).triangles.empty());
}

TEST(SliceRangeOf, IsThatOfTheCastersButNotTooNear)
{
    const auto range = [](const std::vector<TriangleMesh>& meshes, bool directional = false) {
        return slice_range(casters_of(meshes), directional);
    };
    EXPECT_EQ(range({sheet(-1, 1, -1, 1, 3), sheet(-1, 1, -1, 1, 5)}).near, 3);
    EXPECT_EQ(range({sheet(-1, 1, -1, 1, 3), sheet(-1, 1, -1, 1, 5)}).far, 5);
    EXPECT_EQ(range({sheet(-1, 1, -1, 1, 3)}).cut, 0u);
    // 2^-10 of the furthest.
    const SliceRange near = range({sheet(-1, 1, -1, 1, 1e-6), sheet(-1, 1, -1, 1, 4)});
    EXPECT_EQ(near.near, 4 * 0x1p-10);
    EXPECT_EQ(near.cut, 2u);
    EXPECT_EQ(range({sheet(-1, 1, -1, 1, -3), sheet(-1, 1, -1, 1, 4)}).cut, 2u);
    // Nothing before the light, or nothing at all.
    EXPECT_LE(range({sheet(-1, 1, -1, 1, -3)}).far, 0);
    EXPECT_LE(range({sheet(-1, 1, -1, 1, 0)}).far, 0);
    // A directional light has no plane to be behind.
    EXPECT_EQ(range({sheet(-1, 1, -1, 1, -3), sheet(-1, 1, -1, 1, 4)}, true).near, -3);
    EXPECT_EQ(range({sheet(-1, 1, -1, 1, -3), sheet(-1, 1, -1, 1, 4)}, true).cut, 0u);
}

TEST(SliceDepths, RiseFromTheNearestToTheFurthest)
{
    const std::vector<TriangleMesh> meshes = {triangles_in(50, {-2, -2, 3}, {2, 2, 4}, 0.5, 1), sheet(-9, 9, -9, 9, 9)};
    const SliceCasters casters = casters_of(meshes);
    const SliceRange range = slice_range(casters, false);
    for (const Placement placement : {Placement::uniform, Placement::reciprocal, Placement::occupied})
        for (const int count : {1, 2, 33, 64}) {
            const auto depths = slice_depths(casters, range, count, placement, false);
            ASSERT_EQ(depths.size(), static_cast<std::size_t>(count) + 1);
            EXPECT_EQ(depths.front(), static_cast<float>(range.near));
            EXPECT_EQ(depths.back(), static_cast<float>(range.far));
            EXPECT_TRUE(std::is_sorted(depths.begin(), depths.end()));
        }
    const auto uniform = slice_depths(casters, range, 4, Placement::uniform, false),
               reciprocal = slice_depths(casters, range, 4, Placement::reciprocal, false);
    for (std::size_t i = 1; i < 4; ++i) {
        EXPECT_FLOAT_EQ(uniform[i], static_cast<float>(range.near + static_cast<double>(i) / 4 * (range.far - range.near)));
        EXPECT_FLOAT_EQ(reciprocal[i],
                        static_cast<float>(1 / (1 / range.near + static_cast<double>(i) / 4 * (1 / range.far - 1 / range.near))));
    }
}

// As much area between any two planes: two sheets of equal area, each spread over its own depths.
TEST(SliceDepths, OccupiedSharesTheArea)
{
    // Sheets tilted so that each covers one unit of depth, from 2 to 3 and from 8 to 9, and nothing between.
    const auto tilted = [](double z) { return sheet({Vec3{-1, -1, z}, Vec3{1, -1, z}, Vec3{1, 1, z + 1}, Vec3{-1, 1, z + 1}}); };
    const SliceCasters casters = casters_of({tilted(2), tilted(8)});
    const SliceRange range = slice_range(casters, false);
    const auto depths = slice_depths(casters, range, 8, Placement::occupied, false);
    // Four slices of a quarter each on either side, to within two of the 4096 steps of depth that area is counted in.
    const double step = 2 * 7.0 / 4096;
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(depths[i], 2 + 0.25 * static_cast<double>(i), step) << i;
    for (std::size_t i = 5; i <= 8; ++i) EXPECT_NEAR(depths[i], 8 + 0.25 * static_cast<double>(i - 4), step) << i;
    // The fourth plane lies somewhere in what is empty.
    EXPECT_GE(depths[4], 3 - step);
    EXPECT_LE(depths[4], 8 + step);
    // All in one plane: the range has no extent, and neither have the slices.
    const SliceCasters one = casters_of({sheet(-1, 1, -1, 1, 4)});
    for (const float z : slice_depths(one, slice_range(one, false), 5, Placement::occupied, false)) EXPECT_EQ(z, 4.0f);
}

// Every caster's texel lies within the window, and the window is no larger than it must be; the centre of projection lies at the light or behind it.
TEST(SliceViewOf, JustHoldsTheCasters)
{
    for (const ProjectionCentre centre : {ProjectionCentre::light, ProjectionCentre::behind_light})
    for (const double half : {0.0, 0.01, 1.0, 50.0})
        for (const bool directional : {false, true})
            for (const int resolution : {4, 333}) {
                const SliceCasters casters = casters_of({triangles_in(50, {-2, -1, 3}, {3, 2, 6}, 0.5, 1)});
                const SliceRange range = slice_range(casters, directional);
                const SlicePart part{.centre_x = 0.25, .centre_y = -0.5, .half_u = half, .half_v = half / 2};
                const SliceView view = slice_view(casters, range, part, {.slices = 7, .resolution = resolution, .projection_centre = centre}, directional);
                EXPECT_EQ(view.width, resolution);
                EXPECT_EQ(view.slices, 7);
                EXPECT_EQ(view.orthographic, directional ? 1 : 0);
                EXPECT_GE(view.behind, 0);
                EXPECT_LE(view.behind, static_cast<float>(range.far));
                double low_x = 1e9, high_x = -1e9, low_y = 1e9, high_y = -1e9;
                for (std::size_t i = 0; i < casters.vertices.size(); i += 3) {
                    const double away = directional ? 1 : casters.vertices[i + 2] + static_cast<double>(view.behind);
                    const double x = ((casters.vertices[i] - part.centre_x) / away - view.low_x) * view.per_x;
                    const double y = ((casters.vertices[i + 1] - part.centre_y) / away - view.low_y) * view.per_y;
                    low_x = std::min(low_x, x);
                    high_x = std::max(high_x, x);
                    low_y = std::min(low_y, y);
                    high_y = std::max(high_y, y);
                }
                // Three roundings of numbers up to a few windows.
                const double rounding = resolution * 0x1p-20;
                EXPECT_NEAR(low_x, 0, rounding);
                EXPECT_NEAR(low_y, 0, rounding);
                EXPECT_NEAR(high_x, resolution, rounding);
                EXPECT_NEAR(high_y, resolution, rounding);
            }
}

// From the light's centre, unless casters lie far beside it near its plane: there the centre moves back until the widest tangent is 4.
TEST(SliceViewOf, SeesFromTheLight)
{
    const SlicePart part{.centre_x = 1, .centre_y = 0, .half_u = 1, .half_v = 1};
    const auto behind = [&](const TriangleMesh& mesh) {
        const SliceCasters casters = casters_of({mesh});
        return slice_view(casters, slice_range(casters, false), part, {}, false).behind;
    };
    EXPECT_EQ(behind(sheet(-15, 17, -16, 16, 4)), 0);
    EXPECT_FLOAT_EQ(behind(sheet(-15, 17, -20, 16, 4)), 1); // 20 / 4 - 4
    EXPECT_FLOAT_EQ(behind(sheet(-15, 25, -16, 16, 4)), 2); // 24 / 4 - 4
}

// The frustum from behind the light through the light's edges holds the casters (3.4, Fig. 5) along the axis that it was fitted to.
TEST(SliceViewOf, SeesThroughTheLightsEdges)
{
    // A square light of half extent 1 and a caster that reaches out to 3 at depth 4: the frustum opens half z / (|x| - half) = 2 behind the
    // light.
    const OcclusionTexture paper{.slices = 1, .resolution = 8, .projection_centre = ProjectionCentre::behind_light};
    const SliceCasters casters = casters_of({sheet(-3, 3, -3, 3, 4)});
    const SlicePart part{.centre_x = 0, .centre_y = 0, .half_u = 1, .half_v = 1};
    EXPECT_FLOAT_EQ(slice_view(casters, slice_range(casters, false), part, paper, false).behind, 2);
    // Casters no wider than the light: no further than they reach.
    const SliceCasters narrow = casters_of({sheet(-1, 1, -0.5, 0.5, 4)});
    EXPECT_FLOAT_EQ(slice_view(narrow, slice_range(narrow, false), part, paper, false).behind, 4);
    // A point light sees from where it is.
    EXPECT_EQ(slice_view(casters, slice_range(casters, false), {}, paper, false).behind, 0);
}

// A caster without width or height, or both, still has a window with area.
TEST(SliceViewOf, OfLinesAndPointsHasArea)
{
    for (const std::array<Vec3, 3>& corners : {std::array{Vec3(0, -1, 4), Vec3(0, 0, 4), Vec3(0, 1, 5)},
                                               {Vec3(1, 1, 4), Vec3(2, 2, 5), Vec3(1, 1, 6)},
                                               {Vec3(3, 4, 5), Vec3(3, 4, 5), Vec3(3, 4, 5)},
                                               {Vec3(0, 0, 4), Vec3(0, 0, 5), Vec3(0, 0, 6)}})
        for (const bool directional : {false, true}) {
            const SliceCasters casters = casters_of({mesh_of({corners[0], corners[1], corners[2]}, {{0, 1, 2}})});
            const SliceView view = slice_view(casters, slice_range(casters, directional),
                                              {.centre_x = 0, .centre_y = 0, .half_u = 1, .half_v = 1}, {.slices = 4, .resolution = 64}, directional);
            EXPECT_TRUE(std::isfinite(view.per_x) && std::isfinite(view.per_y) && view.per_x > 0 && view.per_y > 0);
            EXPECT_TRUE(std::isfinite(view.low_x) && std::isfinite(view.low_y));
        }
}

} // namespace
} // namespace penumbra::test
