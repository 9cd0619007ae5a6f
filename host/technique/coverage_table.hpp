// Tables of a textured light's share beyond an edge (Assarsson 2003, Paper III, 3.3), made on the device.
#pragma once

#include <array>
#include <vector>

#include <penumbra/scene.hpp>

#include "common/shared.h"
#include "opencl/work.hpp"
#include "technique/wedge_data.hpp"

namespace penumbra {

// A texture as the table's kernels read it. One of more than `most` texels an axis is averaged down to that many; a black channel counts as
// an even one.
struct EmissionSums {
    int width = 0, height = 0, channels = 1;
    std::vector<double> sums; // [height][width + 1][channels]: of each row, from the left
};
EmissionSums emission_sums(const Image* emission, int most);

// A part's window on the texture, and the light that it emits in each channel; `total` of the whole light is the last part's of one.
struct EmissionPart {
    Emission window{};
    std::array<double, 3> light{};
};
EmissionPart emission_part(const EmissionSums& sums, const LightPart& part, int splits);

// table [n n][n n][channels].
opencl::Buffer<float> coverage_table(opencl::Work& work, const opencl::Specialisation& program, const EmissionSums& sums,
                                     const EmissionPart& part, int n);

} // namespace penumbra
