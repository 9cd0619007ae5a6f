// The noise that is found in depth images.
#include "depth_image/images.hpp"

namespace penumbra::test {
namespace {

const Plane tilted{.5, 1e-4, -7e-5};

// A median of n normal sizes is off by 1.17 / sqrt(n) of itself, and neighbouring second differences are not independent: of 95,000 below 1
// % all together. 10 % leave room for the 3e-8 that float32's own rounding adds.
TEST(DepthNoise, IsFound)
{
    for (const double noise : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2})
        EXPECT_NEAR(fit_of(image_of(256, 192, tilted, {noise})).quality.noise, noise, .1 * noise);
}

// Second differences of rounded numbers are whole last places, and so is their median: one, 2^-23 of the value at the most.
TEST(DepthNoise, OfACleanImageIsRounding)
{
    const double found = fit_of(image_of(256, 192, tilted)).quality.noise;
    EXPECT_GE(found, 3e-8);
    EXPECT_LE(found, 2 * rounding / .6745 / std::sqrt(6.));
}

TEST(DepthNoise, StatedOverrides)
{
    for (const double stated : {1e-6, 3e-3}) {
        DepthMap map = image_of(61, 37, tilted, {1e-4});
        map.noise = stated;
        const DepthFit fit = fit_of(map);
        EXPECT_EQ(fit.quality.noise, stated);
        // sigma = hypot(noise value, 0): three roundings.
        for (std::size_t i = 0; i < fit.sigma.size(); ++i) {
            const double value = static_cast<double>(static_cast<float>(1 / static_cast<double>(map.depth[i])));
            EXPECT_NEAR(fit.sigma[i], stated * value, 4 * rounding * stated * value);
        }
    }
}

// Terraces of integers: the format says their step, second differences do not.
TEST(DepthNoise, AStoredStepCountsAsItsStandardError)
{
    DepthMap map = flat(16, 16, 2);
    map.from_image = true;
    map.step.depth = .001;
    const DepthFit fit = fit_of(map);
    const double quantum = .001 / 4 / std::sqrt(12.), noise = fit.quality.noise * .5;
    for (const float sigma : fit.sigma) EXPECT_NEAR(sigma, std::hypot(quantum, noise), 4 * rounding * quantum);
}

// More noise, a wider window; never beyond 8.
TEST(DepthNoise, WindowsGrow)
{
    int last = 2;
    for (const double noise : {0., 1e-5, 1e-4, 1e-3, 1e-2, 1e-1}) {
        DepthMap map = image_of(61, 37, tilted);
        map.noise = noise;
        const int reach = fit_of(map).quality.reach;
        EXPECT_GE(reach, last);
        EXPECT_LE(reach, 8);
        last = reach;
    }
    EXPECT_EQ(last, 8);
}

} // namespace
} // namespace penumbra::test
