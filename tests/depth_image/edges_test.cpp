// What is found at the edges of depth images: anti-aliasing, ramps, holes.
#include "depth_image/images.hpp"

#include "depth_image/edges.hpp"

namespace penumbra::test {
namespace {

// Discs at several depths before a tilted plane: edges in all directions.
double discs(double x, double y)
{
    constexpr double centres[][2] = {{-70, -40}, {-20, 30}, {35, -25}, {80, 40}, {-85, 45}};
    for (int i = 0; i < 5; ++i)
        if (std::hypot(x - centres[i][0], y - centres[i][1]) < 18 + 2 * i) return .4 + .06 * i + 2e-4 * x;
    return .2 + 1e-4 * x - 2e-4 * y;
}

constexpr int width = 256, height = 192;

// The mean depth of side x side points of each pixel.
DepthMap averaged(int side)
{
    return image_of(width, height, [side](double x, double y) {
        double sum = 0;
        for (int j = 0; j < side; ++j)
            for (int i = 0; i < side; ++i) sum += 1 / discs(x + (i + .5) / side - .5, y + (j + .5) / side - .5);
        return side * side / sum;
    });
}

// A Gaussian blur of the disparity.
DepthMap blurred(double deviation, const Noise& noise = {})
{
    return image_of(
        width, height,
        [deviation](double x, double y) {
            double sum = 0, weights = 0;
            for (int j = -6; j <= 6; ++j)
                for (int i = -6; i <= 6; ++i) {
                    const double w = std::exp(-(i * i + j * j) / (2 * deviation * deviation));
                    sum += w * discs(x + i, y + j);
                    weights += w;
                }
            return sum / weights;
        },
        noise);
}

TEST(DepthEdges, CleanStepsAreClean)
{
    for (const double noise : {0., 1e-5, 1e-3}) {
        const DepthQuality quality = fit_of(image_of(width, height, discs, {noise})).quality;
        EXPECT_FALSE(quality.antialiased) << noise << ", " << quality.edge_share;
        EXPECT_FALSE(quality.smeared) << noise;
        EXPECT_EQ(quality.between, 0u);
        EXPECT_EQ(quality.filled, 0u);
    }
}

TEST(DepthEdges, AntiAliasingIsFound)
{
    for (const int side : {2, 4}) {
        const DepthFit fit = fit_of(averaged(side));
        EXPECT_TRUE(fit.quality.antialiased) << side << ", " << fit.quality.edge_share;
        EXPECT_FALSE(fit.quality.smeared) << side;
        EXPECT_GT(fit.quality.between, 0u);
    }
}

// A pixel between two surfaces casts nothing and is shaded on the nearer one: its value is that of a disc or of the plane, not a mean.
TEST(DepthEdges, PixelsBetweenTwoSurfacesArePlacedOnTheNearer)
{
    const DepthFit fit = fit_of(averaged(2));
    std::size_t placed = 0, mixed = 0;
    for (int y = 3; y < height - 3; ++y)
        for (int x = 3; x < width - 3; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!fit.mixed[i]) continue;
            ++mixed;
            double nearest = 0;
            for (int j = -2; j <= 2; ++j)
                for (int k = -2; k <= 2; ++k) nearest = std::max(nearest, discs(x + k + .5 - width / 2., y + j + .5 - height / 2.));
            // Two pixels' slopes of the discs' 2e-4 and more.
            placed += std::abs(static_cast<double>(fit.value[i]) - nearest) < 2e-3;
        }
    EXPECT_GT(mixed, 100u);
    // A corner may take its neighbour along a diagonal.
    EXPECT_GE(static_cast<double>(placed), .95 * static_cast<double>(mixed));
}

TEST(DepthEdges, RampsAreFound)
{
    EXPECT_TRUE(fit_of(blurred(1.5)).quality.smeared);
    EXPECT_TRUE(fit_of(blurred(1.5, {1e-4})).quality.smeared);
    EXPECT_FALSE(fit_of(averaged(2)).quality.smeared);
    EXPECT_FALSE(fit_of(averaged(4)).quality.smeared);
}

// Dropped pixels and short bands are closed by the plane around them; they cast, and are not shaded.
TEST(DepthHoles, AreClosedAndNotShaded)
{
    const Plane plane{.5, 1e-3, -7e-4};
    DepthMap map = image_of(61, 37, plane);
    for (const auto& [x, y] : {std::pair{10, 10}, {11, 10}, {30, 20}, {0, 0}, {60, 36}, {40, 5}, {40, 6}, {40, 7}, {41, 6}})
        map.at(x, y) = nothing_there;
    const DepthFit fit = fit_of(map);
    EXPECT_EQ(fit.quality.filled, 9u);
    for (int y = 0; y < 37; ++y)
        for (int x = 0; x < 61; ++x) {
            const std::size_t i = fit.index(x, y);
            EXPECT_TRUE(fit.there[i]);
            EXPECT_EQ(fit.shaded[i], std::isfinite(map.depth[i]));
            // The nearest good pixel's plane a pixel or two on: 9 roundings of the value (plane_test.cpp), and 4 of each slope.
            EXPECT_NEAR(fit.value[i], plane(x + .5 - 30.5, y + .5 - 18.5), (9 + 2 * 2 * 4) * rounding * .6) << x << ", " << y;
        }
}

TEST(DepthHoles, LargeOnesStay)
{
    DepthMap map = image_of(61, 37, Plane{.5, 1e-3, -7e-4});
    for (int y = 10; y < 26; ++y)
        for (int x = 20; x < 40; ++x) map.at(x, y) = nothing_there;
    const DepthFit fit = fit_of(map);
    EXPECT_EQ(fit.quality.filled, 0u);
    for (int y = 10; y < 26; ++y)
        for (int x = 20; x < 40; ++x) EXPECT_FALSE(fit.there[fit.index(x, y)]);
}

// Closing by `reach`: what a square of 2 reach + 1 pixels cannot lie in.
TEST(DepthHoles, ClosingByItsDefinition)
{
    std::mt19937 random(5);
    for (const int reach : {1, 3}) {
        std::vector<std::uint8_t> there(29 * 17);
        for (auto& one : there) one = random() % 16 == 0;
        const auto closed = closed_holes(29, 17, there, reach);
        const auto near = [&](const auto& image, int x, int y, bool any) {
            for (int v = std::max(0, y - reach); v <= std::min(16, y + reach); ++v)
                for (int u = std::max(0, x - reach); u <= std::min(28, x + reach); ++u)
                    if (image(u, v) == any) return any;
            return !any;
        };
        const auto given = [&](int x, int y) { return there[static_cast<std::size_t>(y * 29 + x)] != 0; };
        const auto grown = [&](int x, int y) { return near(given, x, y, true); };
        for (int y = 0; y < 17; ++y)
            for (int x = 0; x < 29; ++x)
                EXPECT_EQ(closed[static_cast<std::size_t>(y * 29 + x)] != 0, !given(x, y) && near(grown, x, y, false));
    }
}

} // namespace
} // namespace penumbra::test
