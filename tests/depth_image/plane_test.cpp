// A plane stays a plane, and a crease a crease.
#include "depth_image/images.hpp"

namespace penumbra::test {
namespace {

// A measured value has two roundings of float32, of depth and of disparity. The plane is a weighted mean of such values, and at the border
// an extrapolation by half a window at the most, whose weights' sizes sum to less than 4; one rounding more stores it.
constexpr double plane_ulps = 2 * 4 + 1;

void expect_plane(const DepthMap& map, const Camera& camera, const Plane& plane, double far = 0)
{
    const DepthFit fit = fit_of(map, camera);
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
            const std::size_t i = fit.index(x, y);
            const double value = plane(x + .5 - map.width / 2., y + .5 - map.height / 2.), expected = far > 0 ? far - value : value;
            const double ulp = rounding * std::max(expected, far);
            SCOPED_TRACE(testing::Message() << x << ", " << y);
            EXPECT_NEAR(fit.value[i], expected, plane_ulps * ulp);
            // A slope is a difference over some pixels.
            EXPECT_NEAR(fit.slope_x[i], far > 0 ? -plane.slope_x : plane.slope_x, 4 * ulp);
            EXPECT_NEAR(fit.slope_y[i], far > 0 ? -plane.slope_y : plane.slope_y, 4 * ulp);
            EXPECT_TRUE(fit.there[i] && fit.shaded[i] && !fit.mixed[i]);
        }
}

// From a wall to a floor that disparity crosses almost to the horizon.
TEST(DepthPlane, StaysOneAtAnyTilt)
{
    for (const auto& [width, height] : {std::pair{61, 37}, std::pair{93, 7}})
        for (const double slope : {0., 1e-5, 1e-3, .48}) {
            const Plane along{.5, slope * 2 / width, 0}, across{.5, 0, -slope * 2 / height}, both{.5, slope / width, slope / height};
            for (const Plane& plane : {along, across, both}) {
                SCOPED_TRACE(testing::Message() << width << " x " << height << ", " << slope);
                expect_plane(image_of(width, height, plane), camera_for(width, height), plane);
            }
        }
}

TEST(DepthPlane, StaysOneAtAnyScale)
{
    for (const double scale : {1e-6, 1e-3, 1e3, 1e6}) {
        const Plane plane{.5 / scale, 1e-3 / scale, -2e-3 / scale};
        const DepthMap map = image_of(61, 37, plane);
        const DepthFit fit = fit_of(map);
        for (int y = 0; y < 37; ++y)
            for (int x = 0; x < 61; ++x)
                EXPECT_NEAR(fit.value[fit.index(x, y)], plane(x + .5 - 30.5, y + .5 - 18.5), plane_ulps * rounding * plane(0, 0) * 2);
    }
}

// Depth itself is linear there; values are far - depth, rounded like far.
TEST(DepthPlane, StaysOneBeforeAnOrthographicCamera)
{
    const Plane depth{3, 2e-2, -1e-2};
    DepthMap map = map_of(61, 37, [&](int x, int y) { return static_cast<float>(depth(x + .5 - 30.5, y + .5 - 18.5)); });
    map.from_image = true;
    const double furthest = static_cast<double>(*std::max_element(map.depth.begin(), map.depth.end()));
    expect_plane(map, camera_for(61, 37, 1, true), depth, 2 * furthest);
}

// Noise is averaged: of a full window of n pixels a plane's middle is certain to sigma / sqrt(n), at the border to twice as much in either
// direction; 5 standard errors of that. What exceeds 3 standard errors of a single pixel stays as measured.
TEST(DepthPlane, StaysOneUnderNoise)
{
    const Plane plane{.5, 1e-3, -7e-4};
    for (const double noise : {1e-5, 1e-4, 1e-3}) {
        const DepthFit fit = fit_of(image_of(61, 37, plane, {noise}));
        const int side = 2 * fit.quality.reach + 1;
        std::size_t outside = 0;
        for (int y = 0; y < 37; ++y)
            for (int x = 0; x < 61; ++x) {
                const double value = plane(x + .5 - 30.5, y + .5 - 18.5);
                outside += std::abs(static_cast<double>(fit.value[fit.index(x, y)]) - value) > 5 * 4 * noise * value / side;
            }
        // Beyond 3 standard errors lie .27 % of the pixels, and their excess is small.
        EXPECT_LE(outside, 61 * 37 / 200) << noise;
    }
}

// Each pixel lies on one face or on the other, but for the pixels on the line itself.
void expect_crease(const Crease& crease)
{
    const DepthMap map = image_of(61, 37, crease);
    const DepthFit fit = fit_of(map);
    const Plane &one = crease.one, &other = crease.other;
    const double jump = std::hypot(one.slope_x - other.slope_x, one.slope_y - other.slope_y);
    for (int y = 0; y < 37; ++y)
        for (int x = 0; x < 61; ++x) {
            const std::size_t i = fit.index(x, y);
            // Distance to the line where the two are equal.
            const double px = x + .5 - 30.5, py = y + .5 - 18.5, away = std::abs(one(px, py) - other(px, py)) / jump;
            if (away <= 1) continue;
            const Plane& face = one(px, py) < other(px, py) ? one : other;
            // One part in twenty of the jump would turn a normal by as much of the crease's angle.
            EXPECT_NEAR(fit.slope_x[i], face.slope_x, .05 * jump) << x << ", " << y << ", " << away << " from the crease";
            EXPECT_NEAR(fit.slope_y[i], face.slope_y, .05 * jump) << x << ", " << y << ", " << away << " from the crease";
        }
}

TEST(DepthCrease, StaysOneAlongColumns)
{
    expect_crease({{.5, 1e-3, 2e-4}, {.5, -1e-3, 2e-4}});
    expect_crease({{.5, 1e-2, 0}, {.501, 1e-3, 0}});
}

TEST(DepthCrease, StaysOneAlongRows) { expect_crease({{.5, 2e-4, 2e-3}, {.5, 2e-4, -1e-3}}); }

TEST(DepthCrease, StaysOneAslant) { expect_crease({{.5, 2e-3, 1e-3}, {.5, -1e-3, -2e-3}}); }

} // namespace
} // namespace penumbra::test
