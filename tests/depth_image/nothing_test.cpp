// Depth images of little or nothing.
#include "depth_image/images.hpp"

#include "depth_image/depth_image.hpp"

namespace penumbra::test {
namespace {

// Every number that is there is finite, and what casts and receives can be made.
DepthFit expect_sane(const DepthMap& map, bool orthographic)
{
    const Camera camera = camera_for(map.width, map.height, 0.6, orthographic);
    const DepthFit fit = fit_of(map, camera);
    const DepthImage image = depth_image(fit, camera, 0);
    const DepthSurface surface = depth_surface(fit, camera);
    for (std::size_t i = 0; i < fit.value.size(); ++i) {
        if (!fit.there[i]) {
            EXPECT_EQ(fit.value[i], 0);
            EXPECT_EQ(image.pixels[i].value, 0);
            EXPECT_EQ(surface.points[i].z, 0);
            continue;
        }
        for (const float number :
             {fit.value[i], fit.slope_x[i], fit.slope_y[i], fit.residual[i], fit.count[i], fit.sigma[i], image.pixels[i].back,
              image.pixels[i].slack, image.pixels[i].joint, surface.points[i].z, surface.normals[i].z})
            EXPECT_TRUE(std::isfinite(number)) << i;
        EXPECT_GT(fit.value[i], 0);
        EXPECT_GT(image.pixels[i].back, 0);
    }
    return fit;
}

TEST(DepthOfNothing, SpecialValuesAreHoles)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const float nothing : {nan, -nan, nothing_there, -nothing_there, 0.f, -0.f, -1.f}) {
        // Beyond what is closed, and one that is.
        DepthMap map = flat(31, 19, 2);
        for (int y = 0; y < 19; ++y)
            for (int x = 0; x < 12; ++x) map.at(x, y) = nothing;
        map.at(20, 9) = nothing;
        for (const bool orthographic : {false, true}) {
            const DepthFit fit = expect_sane(map, orthographic);
            EXPECT_EQ(fit.quality.pixels, 19u * 19u - 1);
            EXPECT_FALSE(fit.there[fit.index(5, 9)]);
            EXPECT_TRUE(fit.there[fit.index(20, 9)]);
            EXPECT_FALSE(fit.shaded[fit.index(20, 9)]);
            EXPECT_NEAR(fit.depth(fit.index(20, 9)), 2, 4 * rounding * 2);
        }
    }
}

TEST(DepthOfNothing, AllHoles)
{
    for (const bool orthographic : {false, true}) {
        const DepthFit fit = expect_sane(flat(31, 19, nothing_there), orthographic);
        EXPECT_EQ(fit.quality.pixels, 0u);
        EXPECT_FALSE(fit.quality.antialiased || fit.quality.smeared);
    }
}

TEST(DepthOfNothing, AllAtOneDepth)
{
    for (const float depth : {1e-6f, 2.f, 1e6f})
        for (const bool orthographic : {false, true}) {
            const DepthFit fit = expect_sane(flat(31, 19, depth), orthographic);
            EXPECT_FALSE(fit.quality.antialiased || fit.quality.smeared);
            for (std::size_t i = 0; i < fit.value.size(); ++i) {
                // All differences are 0: what is left are the roundings to disparity and back.
                EXPECT_NEAR(fit.depth(i), depth, 2 * rounding * depth);
                EXPECT_EQ(fit.slope_x[i], 0);
                EXPECT_EQ(fit.slope_y[i], 0);
            }
        }
}

TEST(DepthOfNothing, ThinImages)
{
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 2}, {2, 1}, {1, 40}, {40, 1}, {2, 2}, {3, 3}})
        for (const bool orthographic : {false, true}) {
            SCOPED_TRACE(testing::Message() << width << " x " << height);
            const auto depth = [&](int x, int y) { return orthographic ? 2 + .01 * (x + y) : 1 / (.5 - .002 * (x + y)); };
            const DepthMap map = map_of(width, height, [&](int x, int y) { return static_cast<float>(depth(x, y)); });
            const DepthFit fit = expect_sane(map, orthographic);
            // A line of pixels has no plane, and what was measured stays; 3 x 3 pixels have one. 9 roundings of a value (plane_test.cpp),
            // of up to 4.8 = 2 x the furthest, and two of the depth.
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) EXPECT_NEAR(fit.depth(fit.index(x, y)), depth(x, y), 11 * rounding * 4.8) << x << ", " << y;
        }
}

// One pixel alone, in the middle of nothing.
TEST(DepthOfNothing, OnePixel)
{
    DepthMap map = flat(31, 19, nothing_there);
    map.at(15, 9) = 2;
    for (const bool orthographic : {false, true}) {
        const DepthFit fit = expect_sane(map, orthographic);
        EXPECT_NEAR(fit.depth(fit.index(15, 9)), 2, 4 * rounding);
    }
}

// The smallest and the largest numbers.
TEST(DepthOfNothing, ExtremeDepths)
{
    for (const float depth : {1e-37f, 1e-30f, 1e30f, 1e37f}) expect_sane(flat(9, 9, depth), false);
}

} // namespace
} // namespace penumbra::test
