// Depth images: decoding.
#pragma once

#include <optional>
#include <string_view>

#include <penumbra/scene.hpp>

namespace penumbra {

enum class EncodingKind { planar, radial, disparity, window, reversed_window, normalized };

// How a depth image stores depth (docs/scene_file.md, encoding). `empty`: the stored value that means nothing there.
struct DepthEncoding {
    EncodingKind kind = EncodingKind::planar;
    std::optional<double> near, far;
    double scale = 1; // multiplies the decoded depth
    std::optional<double> empty;
    std::optional<double> shift = {}; // disparity alone: 1 / depth = value scale + shift; without it, depth = scale / value
    std::optional<double> precision = {}; // standard error of a depth over the depth; without it, estimated from the image
};

// The stored samples of one channel as float32. Integers come as stored (0 to 255, 0 to 65535), not divided.
struct RawDepth {
    int width = 0, height = 0;
    SampleType type = SampleType::float32;
    std::vector<float> samples;
};

// Planar depth from stored samples. `half_extent` are the camera's tangents (for radial). Throws invalid_input, message starting with
// `where`: near and far missing, not finite or not 0 < near < far; 8-bit samples in an encoding other than normalized, window,
// reversed_window; a decoded depth that is not positive. Adds warnings (half-float, 8-bit). Takes the samples: planar depth stays in their
// memory.
DepthMap decode_depth(RawDepth raw, const DepthEncoding& encoding, const Vec2& half_extent, std::string_view where,
                      std::vector<std::string>& warnings);

} // namespace penumbra
