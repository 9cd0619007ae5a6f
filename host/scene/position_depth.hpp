// Depth from position passes: images of world positions.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "scene/depth.hpp"

namespace penumbra {

// An image of positions, x, y and z for each pixel, as stored.
struct PositionImage {
    int width = 0, height = 0;
    SampleType type = SampleType::float32;
    std::span<const float> samples;
};

// Planar depth of positions that `camera` sees: its whole image is theirs. `encoding` may have scale, which multiplies the positions,
// empty, which all three numbers are where nothing is (by default 0), and precision. Throws invalid_input for another encoding and for
// integers. Adds warnings: half-floats, positions behind the camera, positions that the camera sees elsewhere than in their pixel.
DepthMap depth_of_positions(const PositionImage& positions, const DepthEncoding& encoding, const Camera& camera, const std::string& where,
                            std::vector<std::string>& warnings);

} // namespace penumbra
