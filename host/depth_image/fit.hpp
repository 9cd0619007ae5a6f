// What each pixel of a depth image knows: a plane, its error, and which surface it belongs to.
//
// Values are disparities (1/z) of a pinhole's image and far - z of an orthographic one (kernels/common/depth_walk.h). Images are row-major,
// width x height.
#pragma once

#include <cstdint>
#include <vector>

#include <penumbra/scene.hpp>

#include "opencl/work.hpp"

namespace penumbra {

// What was found in an image, for reports and warnings.
struct DepthQuality {
    double noise = 0;          // standard error of a value over the value: estimated, or stated
    double step = 0;           // between neighbouring stored numbers, over the value: the median; 0: float32's own
    int reach = 2;             // the planes rest on windows of 2 reach + 1 pixels
    bool antialiased = false;  // pixels between two surfaces hold a mean of both
    bool smeared = false;      // edges are ramps over several pixels
    double edge_share = 0;     // share of the edges' pixels that lie between two surfaces
    std::uint64_t pixels = 0;  // that hold depth
    std::uint64_t between = 0; // of them between two surfaces (antialiased) or on ramps (smeared)
    std::uint64_t filled = 0;  // holes that were closed
};

struct DepthFit {
    int width = 0, height = 0;
    bool orthographic = false;
    double far = 0;              // orthographic: value = far - z
    double pixel_x = 0, pixel_y = 0; // tangents of a pixel, or lengths
    std::vector<std::uint8_t> there;  // holds a surface
    std::vector<std::uint8_t> shaded; // is a receiver: there, and not a hole that was closed
    std::vector<std::uint8_t> mixed;  // between two surfaces: casts nothing
    std::vector<float> value;         // that is used
    std::vector<float> sigma;         // standard error of what was measured
    std::vector<float> slope_x, slope_y, residual, count;
    DepthQuality quality;

    std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); }
    float depth(std::size_t i) const { return static_cast<float>(orthographic ? far - static_cast<double>(value[i]) : 1 / static_cast<double>(value[i])); }
    // From here on a neighbour is another surface.
    float joint(std::size_t i) const;
    // How far a pixel's fitted value may be off (twice the standard error and more).
    float error(std::size_t i) const;
};

// Fits the image. Throws invalid_input for an image whose size does not fit.
DepthFit fit_depth(opencl::Work& work, const DepthMap& depth, const Camera& camera);

// The program of depth_fit.cl.
opencl::Specialisation depth_fit_program();

} // namespace penumbra
