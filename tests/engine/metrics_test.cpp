// Metrics on images whose figures can be worked out by hand. Values are multiples of 1/8 or so where exact equality is asked for.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <penumbra/error.hpp>
#include <penumbra/metrics.hpp>

namespace penumbra {
namespace {

Image grey(int width, int height, std::vector<float> pixels) { return Image{width, height, 1, std::move(pixels)}; }

ErrorCode code_of(const Image& test, const Image& reference, std::string* what = nullptr)
{
    try {
        compare(test, reference);
    } catch (const Error& error) {
        if (what) *what = error.what();
        return error.code();
    }
    ADD_FAILURE() << "compare accepted these images";
    return ErrorCode::internal;
}

TEST(Metrics, EqualImagesHaveNoError)
{
    const Image mask = grey(2, 2, {0.0f, 0.25f, 0.5f, 1.0f});
    const Metrics m = compare(mask, mask);
    EXPECT_EQ(m.mae, 0);
    EXPECT_EQ(m.rmse, 0);
    EXPECT_EQ(m.max, 0);
    EXPECT_EQ(m.p99, 0);
    EXPECT_EQ(m.bias_shadow, 0);
    EXPECT_EQ(m.pixels, 4u);
    EXPECT_EQ(m.pixels_shadow, 3u);
}

TEST(Metrics, KnownFigures)
{
    // Differences: +0.25, -0.5, 0, 0; the last pixel is lit in both.
    const Metrics m = compare(grey(4, 1, {0.5f, 0.0f, 0.75f, 1.0f}), grey(4, 1, {0.25f, 0.5f, 0.75f, 1.0f}));
    EXPECT_EQ(m.pixels, 4u);
    EXPECT_EQ(m.pixels_shadow, 3u);
    EXPECT_DOUBLE_EQ(m.mae, 0.75 / 4);
    EXPECT_DOUBLE_EQ(m.rmse, std::sqrt(0.3125 / 4));
    EXPECT_DOUBLE_EQ(m.mae_shadow, 0.75 / 3);
    EXPECT_DOUBLE_EQ(m.rmse_shadow, std::sqrt(0.3125 / 3));
    EXPECT_DOUBLE_EQ(m.bias_shadow, -0.25 / 3);
    EXPECT_DOUBLE_EQ(m.max, 0.5);
    // Sorted {0, 0, 0.25, 0.5} at 0.99 * 3 = 2.97; {0, 0.25, 0.5} at 0.99 * 2 = 1.98.
    EXPECT_DOUBLE_EQ(m.p99, 0.25 + 0.97 * 0.25);
    EXPECT_DOUBLE_EQ(m.p99_shadow, 0.25 + 0.98 * 0.25);
    EXPECT_DOUBLE_EQ(m.off_1_255_shadow, 2.0 / 3);
    EXPECT_DOUBLE_EQ(m.off_0_05_shadow, 2.0 / 3);
}

TEST(Metrics, ShadowInEitherImageCounts)
{
    const Metrics m = compare(grey(3, 1, {1.0f, 0.5f, 1.0f}), grey(3, 1, {0.5f, 1.0f, 1.0f}));
    EXPECT_EQ(m.pixels_shadow, 2u);
    EXPECT_EQ(m.bias_shadow, 0);
    EXPECT_EQ(m.mae_shadow, 0.5);
}

TEST(Metrics, WithoutShadowTheShadowFiguresAreZero)
{
    const Metrics m = compare(grey(2, 1, {1.0f, 0.9995f}), grey(2, 1, {1.0f, 1.0f}));
    EXPECT_EQ(m.pixels_shadow, 0u);
    EXPECT_EQ(m.mae_shadow, 0);
    EXPECT_EQ(m.rmse_shadow, 0);
    EXPECT_EQ(m.bias_shadow, 0);
    EXPECT_EQ(m.p99_shadow, 0);
    EXPECT_EQ(m.off_1_255_shadow, 0);
    EXPECT_GT(m.mae, 0);
}

// Every pair of neighbouring 8-bit values is one step apart, not more; two steps are more.
TEST(Metrics, OneStepOf8BitsIsNotOff)
{
    std::vector<float> lower, one_above, two_above;
    for (int i = 0; i < 254; ++i) {
        lower.push_back(static_cast<float>(i) / 255.0f);
        one_above.push_back(static_cast<float>(i + 1) / 255.0f);
        two_above.push_back(static_cast<float>(i + 2) / 255.0f);
    }
    EXPECT_EQ(compare(grey(254, 1, one_above), grey(254, 1, lower)).off_1_255_shadow, 0);
    EXPECT_EQ(compare(grey(254, 1, two_above), grey(254, 1, lower)).off_1_255_shadow, 1);
}

TEST(Metrics, PercentileOfARamp)
{
    // Differences 0, 1/1024, ..., 100/1024: exact in float32; the 99th percentile of 101 values is the one at position 99.
    std::vector<float> test;
    for (int i = 100; i >= 0; --i) test.push_back(static_cast<float>(i) / 1024.0f);
    const Metrics m = compare(grey(101, 1, test), grey(101, 1, std::vector<float>(101, 0.0f)));
    EXPECT_DOUBLE_EQ(m.p99, 99.0 / 1024);
    EXPECT_DOUBLE_EQ(m.max, 100.0 / 1024);
}

// A float32 sum reaches 2^19, where it can no longer hold what each term adds; the figures keep all 24 bits of the terms.
TEST(Metrics, ManyDifferencesAddUp)
{
    const int side = 1024;
    const std::size_t count = static_cast<std::size_t>(side) * side;
    const float value = 0.75f + 0x1p-24f;
    const Metrics m = compare(grey(side, side, std::vector<float>(count, value)), grey(side, side, std::vector<float>(count, 0.0f)));
    EXPECT_EQ(m.mae, 0.75 + 0x1p-24);
    EXPECT_EQ(m.bias_shadow, 0.75 + 0x1p-24);
    EXPECT_DOUBLE_EQ(m.rmse, 0.75 + 0x1p-24);
}

TEST(Metrics, ColourPixelIsInShadowWhenOneChannelIs)
{
    const Image test{2, 1, 3, {1.0f, 1.0f, 0.5f, 1.0f, 1.0f, 1.0f}};
    const Image reference{2, 1, 3, {1.0f, 1.0f, 0.75f, 1.0f, 1.0f, 1.0f}};
    const Metrics m = compare(test, reference);
    EXPECT_EQ(m.pixels, 2u);
    EXPECT_EQ(m.pixels_shadow, 1u);
    EXPECT_DOUBLE_EQ(m.mae, 0.25 / 6);
    EXPECT_DOUBLE_EQ(m.mae_shadow, 0.25 / 3);
    EXPECT_DOUBLE_EQ(m.bias_shadow, -0.25 / 3);
    EXPECT_EQ(m.off_1_255_shadow, 1);
}

TEST(Metrics, SwappingTheImagesOnlyTurnsTheBias)
{
    const Image a = grey(3, 1, {0.125f, 0.5f, 0.75f}), b = grey(3, 1, {0.25f, 0.0f, 1.0f});
    const Metrics ab = compare(a, b), ba = compare(b, a);
    EXPECT_EQ(ab.bias_shadow, -ba.bias_shadow);
    EXPECT_NE(ab.bias_shadow, 0);
    EXPECT_EQ(ab.rmse, ba.rmse);
    EXPECT_EQ(ab.p99, ba.p99);
}

TEST(Metrics, RefusesWhatCannotBeCompared)
{
    std::string what;
    EXPECT_EQ(code_of(grey(2, 1, {0, 0}), grey(1, 2, {0, 0}), &what), ErrorCode::invalid_input);
    EXPECT_NE(what.find("2 x 1"), std::string::npos) << what;
    EXPECT_NE(what.find("1 x 2"), std::string::npos) << what;

    EXPECT_EQ(code_of(grey(1, 1, {0}), Image{1, 1, 3, {0, 0, 0}}, &what), ErrorCode::invalid_input);
    EXPECT_NE(what.find("1 and reference has 3 channels"), std::string::npos) << what;

    const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
    EXPECT_EQ(code_of(grey(2, 2, {0, 0, 0, nan}), grey(2, 2, {0, 0, 0, 0}), &what), ErrorCode::invalid_input);
    EXPECT_NE(what.find("test: pixel (1, 1)"), std::string::npos) << what;
    EXPECT_EQ(code_of(grey(2, 2, {0, 0, 0, 0}), grey(2, 2, {0, infinite, 0, 0}), &what), ErrorCode::invalid_input);
    EXPECT_NE(what.find("reference: pixel (1, 0)"), std::string::npos) << what;

    EXPECT_EQ(code_of(grey(0, 0, {}), grey(0, 0, {})), ErrorCode::invalid_input);
    EXPECT_EQ(code_of(grey(2, 2, {0}), grey(2, 2, {0, 0, 0, 0})), ErrorCode::invalid_input);
}

TEST(DifferenceImage, ColoursByDirectionAndSize)
{
    // Agreement, half scale darker, full scale brighter, beyond the scale darker. All values are exact in float32.
    const Image picture = difference_image(grey(4, 1, {0.5f, 0.375f, 0.75f, 0.0f}), grey(4, 1, {0.5f, 0.5f, 0.5f, 1.0f}), 0.25);
    ASSERT_EQ(picture.width, 4);
    ASSERT_EQ(picture.height, 1);
    ASSERT_EQ(picture.channels, 3);
    const std::vector<float> expected{1, 1, 1, 0.5f, 0.5f, 1, 1, 0, 0, 0, 0, 1};
    EXPECT_EQ(picture.pixels, expected);
}

TEST(DifferenceImage, ShowsTheChannelThatDiffersMost)
{
    const Image picture = difference_image(Image{1, 1, 3, {0.5f, 0.0f, 0.5f}}, Image{1, 1, 3, {0.25f, 0.5f, 0.5f}}, 1.0);
    EXPECT_EQ(picture.pixels, (std::vector<float>{0.5f, 0.5f, 1.0f}));
}

TEST(DifferenceImage, RefusesAScaleThatIsNotPositive)
{
    const Image mask = grey(1, 1, {0});
    EXPECT_THROW(difference_image(mask, mask, 0), Error);
    EXPECT_THROW(difference_image(mask, mask, -1), Error);
    EXPECT_THROW(difference_image(mask, mask, std::numeric_limits<double>::quiet_NaN()), Error);
    EXPECT_THROW(difference_image(mask, grey(2, 1, {0, 0})), Error);
}

} // namespace
} // namespace penumbra
