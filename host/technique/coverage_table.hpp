// Tables of a textured light's share beyond an edge (Assarsson 2003, Paper III, 3.3), made on the device.
#pragma once

#include "opencl/work.hpp"
#include "technique/emission.hpp"

namespace penumbra {

// table [n n][n n][channels].
opencl::Buffer<float> coverage_table(opencl::Work& work, const opencl::Specialisation& program, const EmissionSums& sums,
                                     const EmissionPart& part, int n);

} // namespace penumbra
