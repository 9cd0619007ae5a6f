// Edges of a depth image: pixels between two surfaces, ramps, holes, silhouettes.
#pragma once

#include <cstdint>
#include <vector>

#include "depth_image/fit.hpp"

namespace penumbra {

// A value image with where it holds something.
struct ValueImage {
    int width, height;
    const std::vector<float>& value; // 0: nothing there
    const std::vector<float>& sigma;
};

// Where anti-aliasing may have put a pixel between two surfaces, and the step (dx, dy) to the nearer one.
struct Between {
    std::vector<std::uint8_t> mixed;
    std::vector<std::int8_t> toward_x, toward_y;
    std::uint64_t between = 0, steps = 0; // pixels between two surfaces, and clean steps, along rows and columns
    std::uint64_t seen_steps = 0;         // of the steps those between two surfaces that are there

    double share() const { return static_cast<double>(between) / static_cast<double>(std::max<std::uint64_t>(1, between + steps)); }
};
Between between_two_surfaces(const ValueImage& image);

// Pixels on edges that are ramps over several pixels, as networks, denoisers and upscaling make them, grown by one. half_width: of a ramp.
// Windows that reach over holes or the border count what is there.
std::vector<std::uint8_t> ramps(const ValueImage& image, int half_width);

// Whether an image's edges are ramps: there are many, and hardly a clean step.
bool is_smeared(const ValueImage& image, const std::vector<std::uint8_t>& ramp, std::uint64_t seen_steps);

// Holes that a closing of `there` by `reach` pixels covers.
std::vector<std::uint8_t> closed_holes(int width, int height, const std::vector<std::uint8_t>& there, int reach);

// Pixels nearer than a neighbour by more than `joint`: where a body ends. Across a pixel between two surfaces the next one counts.
std::vector<std::uint8_t> silhouettes(const DepthFit& fit);

} // namespace penumbra
