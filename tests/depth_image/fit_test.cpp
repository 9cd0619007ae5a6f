// The planes of depth images against double precision.
#include "depth_image/images.hpp"

#include "oracle/depth_fit_oracle.hpp"

namespace penumbra::test {
namespace {

oracle::depth_fit::Image oracle_image(const DepthMap& map, const DepthFit& fit)
{
    oracle::depth_fit::Image image{.width = map.width, .height = map.height, .value = {}, .sigma = {}};
    for (std::size_t i = 0; i < map.depth.size(); ++i) {
        const bool there = std::isfinite(map.depth[i]) && map.depth[i] > 0;
        // Values are rounded to float32 once; what follows starts from the same numbers.
        image.value.push_back(there ? static_cast<double>(static_cast<float>(1 / static_cast<double>(map.depth[i]))) : 0);
        image.sigma.push_back(static_cast<double>(fit.sigma[i]));
    }
    return image;
}

// How many of the pixels that are there had to be left out: a decision was closer than float32 knows.
double compare(const DepthMap& map)
{
    const DepthFit fit = fit_of(map);
    EXPECT_FALSE(fit.quality.antialiased || fit.quality.smeared);
    const auto expected = oracle::depth_fit::used_planes(oracle_image(map, fit), fit.quality.reach);
    std::size_t there = 0, unsure = 0;
    for (int y = 0; y < fit.height; ++y)
        for (int x = 0; x < fit.width; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!std::isfinite(map.depth[i])) continue;
            ++there;
            const auto& p = expected[i];
            if (!p.sure) {
                ++unsure;
                continue;
            }
            SCOPED_TRACE(testing::Message() << x << ", " << y);
            EXPECT_LT(p.value_error, 2e-6 * p.value) << "the bound says nothing";
            EXPECT_NEAR(fit.value[i], p.value, p.value_error);
            EXPECT_NEAR(fit.slope_x[i], p.slope_x, p.slope_error);
            EXPECT_NEAR(fit.slope_y[i], p.slope_y, p.slope_error);
            // Of the square, which is a difference; and two roundings of the root and the quotient.
            const double residual = static_cast<double>(fit.residual[i]), square = p.residual * p.residual;
            EXPECT_NEAR(residual * residual, square, p.square_error + 4 * rounding * square);
            // 25 weights and a sum of as many.
            EXPECT_NEAR(fit.count[i], p.count, 1.2 * 27 * rounding * p.count);
        }
    return static_cast<double>(unsure) / static_cast<double>(there);
}

const Plane tilted{.5, 1e-3, -7e-4}, beside{.49, -2e-3, 4e-4}, behind{.2, 3e-4, 2e-4};

std::vector<Disparity> scenes(int width)
{
    return {tilted, Crease{tilted, beside}, Step{tilted, behind, 3.2}, Ball{behind, 1.2 / width, 3, .6}};
}

// Clean images have distances from their planes of a few roundings, and limits far above them; at creases and round bodies distances take
// all values, so some of the pixels near lines of equal choice are unsure: a band of a few pixels along them.
TEST(DepthFitOracle, CleanImages)
{
    for (const auto& [width, height] : {std::pair{61, 37}, std::pair{93, 7}})
        for (const Disparity& scene : scenes(width)) EXPECT_LT(compare(image_of(width, height, scene)), .2);
}

// Of the 25 to 289 pixels of a window hardly one lies as close to the limit of four standard errors as float32 rounds.
TEST(DepthFitOracle, NoisyImages)
{
    for (const double noise : {1e-5, 1e-4, 1e-3})
        for (const auto& [width, height] : {std::pair{61, 37}, std::pair{93, 7}})
            for (const Disparity& scene : scenes(width)) EXPECT_LT(compare(image_of(width, height, scene, {noise})), .2) << noise;
}

// Holes larger than those that are closed.
TEST(DepthFitOracle, ImagesWithHoles)
{
    const Disparity holed = [](double x, double y) { return std::hypot(x - 8, y) < 9 ? 0 : tilted(x, y); };
    EXPECT_LT(compare(image_of(61, 37, holed)), .05);
    EXPECT_LT(compare(image_of(61, 37, holed, {1e-4})), .05);
}

} // namespace
} // namespace penumbra::test
