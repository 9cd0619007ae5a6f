// Depth images become planar depth: every encoding against its closed formula, what means nothing there, and what is refused.
#include "support/maps.hpp"

#include "scene/depth.hpp"

namespace penumbra::test {
namespace {

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
const std::vector<float> unit_samples = {0.001f, 0.25f, 0.5f, 0.75f, 0.999f};

DepthEncoding of(EncodingKind kind, std::optional<double> near = {}, std::optional<double> far = {}, double scale = 1,
                 std::optional<double> empty = {})
{
    return {.kind = kind, .near = near, .far = far, .scale = scale, .empty = empty};
}

DepthMap decode(const DepthEncoding& encoding, const std::vector<float>& samples, SampleType type = SampleType::float32,
                std::vector<std::string>* warnings = nullptr)
{
    std::vector<std::string> ignored;
    return decode_depth({.width = static_cast<int>(samples.size()), .height = 1, .type = type, .samples = samples}, encoding, {1, 1},
                        "the map", warnings ? *warnings : ignored);
}

Error decode_error(const DepthEncoding& encoding, const std::vector<float>& samples, SampleType type = SampleType::float32)
{
    return error_of([&] { decode(encoding, samples, type); });
}

TEST(DecodeDepth, PlanarIsItself)
{
    EXPECT_EQ(decode({}, {1e-6f, 1, 12.5f, 9.9e8f}).depth, (std::vector<float>{1e-6f, 1, 12.5f, 9.9e8f}));
    EXPECT_EQ(decode(of(EncodingKind::planar, {}, {}, 0.5), {1, 12.5f}).depth, (std::vector<float>{0.5f, 6.25f}));
}

TEST(DecodeDepth, DisparityIsOneOver)
{
    const DepthMap map = decode(of(EncodingKind::disparity, {}, {}, 2), {0.125f, 4, 0, -1});
    EXPECT_EQ(map.depth, (std::vector<float>{16, 0.5f, nothing_there, nothing_there}));
}

// Window depth w is affine in 1/z: 0 at the near plane, 1 at the far one.
TEST(DecodeDepth, WindowAndReversedWindow)
{
    const double n = 0.1, f = 100;
    const DepthMap window = decode(of(EncodingKind::window, n, f), unit_samples);
    const DepthMap reversed = decode(of(EncodingKind::reversed_window, n, f), unit_samples);
    const DepthMap infinite = decode(of(EncodingKind::reversed_window, n, {}), unit_samples);
    for (std::size_t i = 0; i < unit_samples.size(); ++i) {
        const double w = unit_samples[i];
        // Double precision until the result is rounded to float32.
        EXPECT_FLOAT_EQ(window.depth[i], static_cast<float>(1 / (1 / n + w * (1 / f - 1 / n)))) << w;
        EXPECT_FLOAT_EQ(reversed.depth[i], static_cast<float>(1 / (1 / f + w * (1 / n - 1 / f)))) << w;
        EXPECT_FLOAT_EQ(infinite.depth[i], static_cast<float>(n / w)) << w;
    }
    EXPECT_FLOAT_EQ(decode(of(EncodingKind::reversed_window, n, f), {1}).depth[0], 0.1f);
}

TEST(DecodeDepth, NormalizedIsLinear)
{
    const DepthEncoding encoding = of(EncodingKind::normalized, 2, 10, 3);
    const DepthMap map = decode(encoding, unit_samples);
    for (std::size_t i = 0; i < unit_samples.size(); ++i)
        EXPECT_FLOAT_EQ(map.depth[i], static_cast<float>(3 * (2 + 8 * static_cast<double>(unit_samples[i]))));
    // Integers as they stand in the file.
    EXPECT_FLOAT_EQ(decode(encoding, {65535}, SampleType::uint16).depth[0], 30);
    EXPECT_FLOAT_EQ(decode(encoding, {51}, SampleType::uint8).depth[0], static_cast<float>(3 * (2 + 8 * 51 / 255.0)));
    // Depth may begin at the camera.
    EXPECT_FLOAT_EQ(decode(of(EncodingKind::normalized, 0, 10), {0.5f}).depth[0], 5);
}

// z = r / sqrt(1 + tau_x^2 + tau_y^2) with the tangents of the pixel's centre.
TEST(DecodeDepth, RadialIsTheDistanceToTheCentre)
{
    std::vector<std::string> warnings;
    const Vec2 half{0.8, 0.3};
    const int width = 5, height = 3;
    const RawDepth raw{.width = width, .height = height, .type = SampleType::float32, .samples = std::vector<float>(15, 7.0f)};
    const DepthMap map = decode_depth(raw, of(EncodingKind::radial), half, "the map", warnings);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double tx = ((x + 0.5) / width * 2 - 1) * half.x, ty = (1 - (y + 0.5) / height * 2) * half.y;
            EXPECT_FLOAT_EQ(map.at(x, y), static_cast<float>(7 / std::sqrt(1 + tx * tx + ty * ty))) << x << ", " << y;
        }
    EXPECT_EQ(map.at(2, 1), 7); // the centre looks straight ahead
}

TEST(DecodeDepth, WhatMeansNothingThere)
{
    const std::vector<float> samples = {nan_value, nothing_there, -nothing_there, 0, -0.0f, -1, 1e9f, 9.99e8f, 65504};
    const auto there = [](const DepthMap& map) {
        std::vector<bool> result;
        for (const float depth : map.depth) result.push_back(std::isfinite(depth));
        return result;
    };
    EXPECT_EQ(there(decode({}, samples)), (std::vector<bool>{false, false, false, false, false, false, false, true, true}));
    // Half-floats end at 65504.
    EXPECT_EQ(there(decode({}, {65504, 65472, 1e9f, 1}, SampleType::float16)), (std::vector<bool>{false, true, false, true}));
    // Integers have no such end.
    EXPECT_EQ(there(decode({}, {65535, 0, 1}, SampleType::uint16)), (std::vector<bool>{true, false, true}));
    EXPECT_TRUE(std::isfinite(decode({}, {2e9f}, SampleType::uint32).depth[0]));
    for (const float depth : decode({}, samples).depth) EXPECT_FALSE(std::isnan(depth) || depth <= 0);
}

TEST(DecodeDepth, EmptyReplacesTheDefaults)
{
    const DepthEncoding encoding = of(EncodingKind::planar, {}, {}, 1, 5);
    EXPECT_EQ(decode(encoding, {5, 4, 2e9f, nan_value}).depth, (std::vector<float>{nothing_there, 4, 2e9f, nothing_there}));
    EXPECT_EQ(decode(of(EncodingKind::window, 1, 9, 1, 1), {1}).depth[0], nothing_there);
    // Then a value that is not positive is no longer nothing, but no depth either.
    EXPECT_EQ(decode_error(encoding, {-1}).code(), ErrorCode::invalid_input);
}

TEST(DecodeDepth, EightBitsAreTooFewForLengths)
{
    const Error error = decode_error({}, {200}, SampleType::uint8);
    EXPECT_EQ(error.code(), ErrorCode::invalid_input);
    EXPECT_EQ(error.message(), "the map is 8-bit; depth needs 16-bit or float");
    EXPECT_TRUE(holds(error.hint(), "use EXR float32, or encoding \"normalized\" with near and far")) << error.hint();
    EXPECT_EQ(decode_error(of(EncodingKind::radial), {200}, SampleType::uint8).code(), ErrorCode::invalid_input);

    // Stereo and networks give disparity in 8 bits.
    std::vector<std::string> warnings;
    decode(of(EncodingKind::disparity), {200}, SampleType::uint8, &warnings);
    EXPECT_EQ(warnings.size(), 1u);
    warnings.clear();
    decode(of(EncodingKind::normalized, 1, 2), {200}, SampleType::uint8, &warnings);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(holds(warnings[0], "the map is 8-bit")) << warnings[0];
}

TEST(DecodeDepth, Warnings)
{
    std::vector<std::string> warnings;
    decode({}, {1}, SampleType::float16, &warnings);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(holds(warnings[0], "half-float")) << warnings[0];
}

TEST(DecodeDepth, RangesAreChecked)
{
    const auto message = [](EncodingKind kind, std::optional<double> near, std::optional<double> far) {
        const Error error = decode_error(of(kind, near, far), {0.5f});
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_TRUE(error.message().starts_with("the map")) << error.message();
        return std::string(error.what());
    };
    EXPECT_TRUE(holds(message(EncodingKind::window, {}, 9), "near and far"));
    EXPECT_TRUE(holds(message(EncodingKind::window, 1, {}), "near and far"));
    EXPECT_TRUE(holds(message(EncodingKind::normalized, 1, {}), "near and far"));
    EXPECT_TRUE(holds(message(EncodingKind::reversed_window, {}, {}), "near"));
    EXPECT_TRUE(holds(message(EncodingKind::window, 9, 1), "0 < near < far"));
    EXPECT_TRUE(holds(message(EncodingKind::window, 0, 1), "0 < near < far"));
    message(EncodingKind::normalized, -1, 1);
    EXPECT_TRUE(holds(message(EncodingKind::normalized, 1, 1), "differ"));
    message(EncodingKind::window, std::nan(""), 1);
    message(EncodingKind::normalized, 1, HUGE_VAL);
    EXPECT_TRUE(holds(decode_error(of(EncodingKind::window, 1, 9), {1.5f}).what(), "1.5"));
    for (const double scale : {0.0, HUGE_VAL, std::nan("")})
        EXPECT_TRUE(holds(decode_error(of(EncodingKind::planar, {}, {}, scale), {1}).message(), "scale"));
}

// What a cleared depth buffer holds, in every type; `empty` says otherwise.
TEST(DecodeDepth, TheFarEndOfADepthBufferIsNothing)
{
    const DepthEncoding window = of(EncodingKind::window, 1, 9), reversed = of(EncodingKind::reversed_window, 1, 9);
    EXPECT_EQ(decode(window, {1, 0.999f}).depth[0], nothing_there);
    EXPECT_TRUE(std::isfinite(decode(window, {1, 0.999f}).depth[1]));
    EXPECT_EQ(decode(window, {1, 0.5f}, SampleType::float16).depth[0], nothing_there);
    const DepthMap bytes = decode(window, {255, 254}, SampleType::uint8);
    EXPECT_TRUE(bytes.depth[0] == nothing_there && bytes.depth[1] < 9);
    EXPECT_EQ(decode(window, {65535}, SampleType::uint16).depth[0], nothing_there);
    EXPECT_EQ(decode(window, {4294967295.0f}, SampleType::uint32).depth[0], nothing_there);
    EXPECT_EQ(decode(reversed, {0, 1}).depth, (std::vector<float>{nothing_there, 1}));
    EXPECT_EQ(decode(of(EncodingKind::reversed_window, 1, {}), {0, 1}).depth, (std::vector<float>{nothing_there, 1}));
    EXPECT_EQ(decode(of(EncodingKind::normalized, 1, 9), {1}).depth[0], 9) << "its end is a depth like others";
    EXPECT_FLOAT_EQ(decode(of(EncodingKind::window, 1, 9, 1, 0.5), {1}).depth[0], 9);
}

TEST(DecodeDepth, WhiteMayBeNear)
{
    const DepthMap map = decode(of(EncodingKind::normalized, 10, 2), {65535, 1, 0}, SampleType::uint16);
    EXPECT_FLOAT_EQ(map.depth[0], 2);
    EXPECT_FLOAT_EQ(map.depth[1], static_cast<float>(10 - 8 / 65535.0));
    EXPECT_EQ(map.depth[2], nothing_there);
    EXPECT_NEAR(map.step.depth, 8 / 65535.0, 1e-12);
}

// Camera-space z is negative: a negative scale turns it round, and with it what counts as nothing.
TEST(DecodeDepth, NegativeScaleTurnsDepthRound)
{
    EXPECT_EQ(decode(of(EncodingKind::planar, {}, {}, -1), {-2, -1e9f, 0, 3, -nothing_there}).depth,
              (std::vector<float>{2, nothing_there, nothing_there, nothing_there, nothing_there}));
    EXPECT_EQ(decode(of(EncodingKind::radial, {}, {}, -2), {-2}).depth[0], 4);
    EXPECT_EQ(decode(of(EncodingKind::disparity, {}, {}, -1), {-0.5f, 0.5f}).depth, (std::vector<float>{2, nothing_there}));
    EXPECT_EQ(decode(of(EncodingKind::planar, {}, {}, -1, 7), {-2, 7}).depth, (std::vector<float>{2, nothing_there}));
}

TEST(DecodeDepth, NegativeValuesAreNotPassedOver)
{
    const Error error = decode_error({}, {-3, -5, 0});
    EXPECT_EQ(error.code(), ErrorCode::invalid_input);
    EXPECT_TRUE(holds(error.message(), "its values are negative: 3 values from -5 to 0, 2 negative, 1 zero")) << error.message();
    EXPECT_TRUE(holds(error.hint(), "\"scale\": -1")) << error.hint();
    EXPECT_TRUE(holds(decode_error(of(EncodingKind::planar, {}, {}, -1), {3, 5}).message(), "positive"));

    // One marker is nobody's mistake; many values are.
    std::vector<std::string> warnings;
    decode({}, {1, -1, 2, -1}, SampleType::float32, &warnings);
    EXPECT_TRUE(warnings.empty());
    decode({}, {1, -1, 2, -1.5f}, SampleType::float32, &warnings);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(holds(warnings[0], "2 values are negative")) << warnings[0];
    warnings.clear();
    EXPECT_EQ(decode(of(EncodingKind::planar, {}, {}, 1, -1), {-1, -1}, SampleType::float32, &warnings).depth[0], nothing_there);
    EXPECT_TRUE(warnings.empty()) << "empty says that they mean nothing there";
}

TEST(DecodeDepth, DisparityBehindInfinityIsNothing)
{
    DepthEncoding network = of(EncodingKind::disparity, {}, {}, 1);
    network.shift = -0.25;
    std::vector<std::string> warnings;
    EXPECT_EQ(decode(network, {0.5f, 0.25f, 0.1f}, SampleType::float32, &warnings).depth, (std::vector<float>{4, nothing_there, nothing_there}));
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(holds(warnings[0], "2 of 3 pixels")) << warnings[0];
    EXPECT_TRUE(holds(decode_error(network, {0.1f, 0.2f}).message(), "0 or less"));
}

// Least squares in disparity: exact for what lies on a line, the textbook's line for what does not.
TEST(DecodeDepth, AnchorsSolveScaleAndShift)
{
    DepthEncoding encoding = of(EncodingKind::disparity);
    encoding.anchors = {{0, 0, 1}, {2, 0, 4}, {3, 0, 8}};
    std::vector<std::string> warnings;
    // value = (1 / depth - 0.05) / 0.002
    const std::vector<float> exact{475, 200, 100, 37.5f};
    const DepthMap map = decode(encoding, exact, SampleType::float32, &warnings);
    EXPECT_FLOAT_EQ(map.depth[0], 1);
    EXPECT_NEAR(map.depth[1], 1 / (200 * 0.002 + 0.05), 1e-6);
    EXPECT_NEAR(map.depth[3], 8, 1e-5);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(holds(warnings[0], "3 anchors give scale 0.002 and shift 0.05")) << warnings[0];

    // (1, 1), (2, 1/2), (3, 1/2): slope -1/4, through the means (2, 2/3).
    warnings.clear();
    encoding.anchors = {{0, 0, 1}, {1, 0, 2}, {2, 0, 2}};
    decode(encoding, {1, 2, 3}, SampleType::float32, &warnings);
    ASSERT_GE(warnings.size(), 1u);
    EXPECT_TRUE(holds(warnings[0], "scale -0.25 and shift 1.16667; they miss the anchors' disparities by up to 33 %")) << warnings[0];
    EXPECT_TRUE(holds(warnings[0], "greater values are further")) << warnings[0];
}

TEST(DecodeDepth, AnchorsStandOnWhatTheImageShows)
{
    const auto complaint = [](std::vector<DepthAnchor> anchors) {
        DepthEncoding encoding = of(EncodingKind::disparity);
        encoding.anchors = std::move(anchors);
        return std::string(decode_error(encoding, {1, 2, 0, 1}).what());
    };
    EXPECT_TRUE(holds(complaint({{0, 0, 1}, {4, 0, 2}}), "[4, 0], which lies beside the image"));
    EXPECT_TRUE(holds(complaint({{0, 0, 1}, {-1, 0, 2}}), "beside the image"));
    EXPECT_TRUE(holds(complaint({{0, 0, 1}, {2, 0, 2}}), "nothing at the pixel [2, 0]"));
    EXPECT_TRUE(holds(complaint({{0, 0, 1}, {3, 0, 2}}), "same value"));
    EXPECT_TRUE(holds(complaint({{0, 0, 2}, {1, 0, 2}}), "one depth"));
}

// 1 2      . . . .
// 3 4  ->  . 1 2 .   where the frame is a pixel wider; and the other way round.
TEST(DecodeDepth, FramesAreWhatTheCameraSaw)
{
    RawDepth raw{.width = 2, .height = 2, .samples = {1, 2, 3, 4}, .frame = {-1, -1, 4, 4}};
    const RawDepth wide = framed(raw);
    ASSERT_EQ(wide.samples.size(), 16u);
    EXPECT_EQ(wide.samples[5], 1);
    EXPECT_EQ(wide.samples[10], 4);
    EXPECT_TRUE(std::isnan(wide.samples[0]) && std::isnan(wide.samples[15]));
    raw.frame = {1, 0, 1, 2};
    EXPECT_EQ(framed(raw).samples, (std::vector<float>{2, 4}));
    raw.frame = {};
    EXPECT_EQ(framed(raw).samples, raw.samples);
    raw.frame = {5, 5, 2, 1};
    EXPECT_EQ(framed(raw).samples.size(), 2u) << "nothing in common";
}

// The largest relative error that the stored samples leave: half a step of what was stored.
TEST(DecodeDepth, PrecisionIsThatOfTheSamples)
{
    EXPECT_EQ(decode({}, {1, 3}).precision, 0x1p-24);
    EXPECT_EQ(decode({}, {1, 3}, SampleType::float16).precision, 0x1p-11);
    // Integers: half a step of the nearest depth.
    EXPECT_NEAR(decode({}, {100, 5000}, SampleType::uint16).precision, 0.5 / 100, 1e-12);
    const DepthMap map = decode(of(EncodingKind::normalized, 2, 10), {1, 40000}, SampleType::uint16);
    EXPECT_NEAR(map.precision, 8 * 0.5 / 65535 / (2 + 8 / 65535.0), 1e-12);
}

} // namespace
} // namespace penumbra::test
