// Depth images: decoding, and surfaces made from them.
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

// The surfaces that a camera sees: neighbouring pixel centres joined by triangles, but not across a depth jump: where disparity steps by
// more than the neighbouring slopes explain. Triangles face the camera.
TriangleMesh mesh_from_depth(const DepthMap& depth, const Camera& camera);

// Whether two neighbouring texels a, b lie on one surface, from four disparities in a row (0: nothing there) that are right to the relative
// `precision`. A plane's disparity is linear across the image, so the step from a to b must be one that the slope on either side explains.
bool connected(double before, double a, double b, double after, double precision);

} // namespace penumbra
