// Some channels of an image file, as they are stored.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <penumbra/image.hpp>

#include "scene/depth.hpp"

namespace penumbra {

// Interleaved samples; integers as stored.
struct RawPlanes {
    int width = 0, height = 0, channels = 1;
    SampleType type = SampleType::float32;
    std::vector<float> samples = {};
    ImageFrame frame = {}; // of no size: that of the samples
    double pixel_aspect = 1;
};

// Throws too_large for a frame of more than max_samples pixels, and invalid_input for one beyond what OpenEXR takes.
void check_frame(const ImageFrame& frame, std::string_view where, std::uint64_t max_samples);

// A pixel's width over its height as a file gives it; what cannot be one counts as 1.
double sound_aspect(double aspect);

} // namespace penumbra
