// Depth images: decoding.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra {

// Whether a pixel of planar depth shows anything.
inline bool is_there(float depth) { return depth > 0 && std::isfinite(depth); }

enum class EncodingKind { planar, radial, disparity, window, reversed_window, normalized };

// A pixel of known depth: column and row from the image's top left corner, and planar depth.
struct DepthAnchor {
    std::int64_t x = 0, y = 0;
    double depth = 0;
};

// How a depth image stores depth (docs/scene_file.md, encoding). `empty`: the stored value that means nothing there.
struct DepthEncoding {
    EncodingKind kind = EncodingKind::planar;
    std::optional<double> near, far;
    double scale = 1; // multiplies the decoded depth; negative where what is stored is negative
    std::optional<double> empty;
    std::optional<double> shift = {}; // disparity alone: 1 / depth = value scale + shift; without it, depth = scale / value
    std::optional<double> precision = {}; // standard error of a depth over the depth; without it, estimated from the image
    std::vector<DepthAnchor> anchors = {}; // disparity alone: what scale and shift are solved from
};

// What a camera saw of an image file: in the samples' pixels, (0, 0) their top left corner. EXR's display window; else the samples' own.
struct ImageFrame {
    int x = 0, y = 0;
    int width = 0, height = 0;
};

// The stored samples of one channel as float32. Integers come as stored (0 to 255, 0 to 65535), not divided.
struct RawDepth {
    int width = 0, height = 0;
    SampleType type = SampleType::float32;
    std::vector<float> samples;
    ImageFrame frame = {};   // of no size: that of the samples
    double pixel_aspect = 1; // a pixel's width over its height
};

// The image's frame, also where it is that of the samples.
ImageFrame frame_of(const RawDepth& raw);

// The samples in the frame alone: what they leave out of it is nothing there (NaN), what they have beyond it goes.
RawDepth framed(RawDepth raw);

// Whether a stored value means nothing there.
bool is_empty(float stored, const RawDepth& raw, const DepthEncoding& encoding);

// "64 values from -3 to 5; 60 negative, 1 zero, 3 not finite": what an image without a depth holds.
std::string values_text(const RawDepth& raw);

// The encoding with scale and shift by which its anchors' disparities are met best (least squares); one of these is a warning with the misfit.
// Without anchors as it is. Throws invalid_input for an anchor beside the image or where nothing is, and for anchors of one value.
DepthEncoding solved(const DepthEncoding& encoding, const RawDepth& raw, const std::string& where, std::vector<std::string>& warnings);

// Planar depth from stored samples, the frame left aside. `half_extent` and `center` are the camera's (for radial). Throws invalid_input,
// message starting with `where`: near and far missing, not finite or not 0 < near < far (normalized: any two that differ); 8-bit samples of
// lengths; a decoded depth that is not positive; no depth but values of the other sign. Adds warnings (half-float, 8-bit, values of the other
// sign, disparities beyond infinity). Takes the samples: planar depth stays in their memory.
DepthMap decode_depth(RawDepth raw, const DepthEncoding& given, const Vec2& half_extent, std::string_view where,
                      std::vector<std::string>& warnings, const Vec2& center = {0, 0});

} // namespace penumbra
