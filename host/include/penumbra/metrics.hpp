// How far a mask is from a reference.
#pragma once

#include <cstdint>

#include <penumbra/export.hpp>
#include <penumbra/image.hpp>

namespace penumbra {

// A pixel with a visibility below this is in shadow.
constexpr double shadow_below = 0.999;

// Differences are test - reference, over all channels. The _shadow figures are over pixels that are in shadow in either image; without any such pixel they are 0.
struct Metrics {
    double mae_shadow = 0, rmse_shadow = 0, bias_shadow = 0;
    double mae = 0, rmse = 0;
    double max = 0;                 // largest absolute difference
    double p99 = 0;                 // 99th percentile of the absolute difference, over all pixels
    double p99_shadow = 0;          // and over shadow pixels
    double off_1_255_shadow = 0;    // share of shadow pixels off by more than 1/255
    double off_0_05_shadow = 0;     // and by more than 0.05
    std::uint64_t pixels_shadow = 0, pixels = 0;
};

// Throws invalid_input when the sizes or channels differ or a pixel is not finite.
PENUMBRA_API Metrics compare(const Image& test, const Image& reference);

// test - reference in false colour: blue where the test is darker, red where it is brighter, white where they agree; full colour at
// `full_scale`. 3 channels, for the eye (display-referred).
PENUMBRA_API Image difference_image(const Image& test, const Image& reference, double full_scale = 0.1);

} // namespace penumbra
