// What a light's texture emits, over any part of the light.
#pragma once

#include <array>
#include <vector>

#include <penumbra/scene.hpp>

#include "common/shared.h"

namespace penumbra {

// The texture of a light; null: it has none.
const Image* emission_of(const Light& light);

// A texture as sums of its rows. One of more than `most` texels an axis is averaged down to that many; a black channel counts as an even one; no image is
// one white texel.
struct EmissionSums {
    int width = 0, height = 0, channels = 1;
    std::vector<double> sums; // [height][width + 1][channels]: of each row, from the left
};
EmissionSums emission_sums(const Image* emission, int most);

// A part of the light: its window on the texture, and the light that it emits in each channel.
struct EmissionPart {
    Emission window{};
    std::array<double, 3> light{};
};
// The part with its middle at (x, y), -1 to 1 across the light, y up, and `half` its half extent: 1 of all of it.
EmissionPart emission_part(const EmissionSums& sums, double x, double y, double half);

} // namespace penumbra
