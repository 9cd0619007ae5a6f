// Settings of depth_trace.
#pragma once

#include <cstdint>

#include <penumbra/technique/preset.hpp>

namespace penumbra {

// Shadow rays walked through depth images on the OpenCL device: those among the objects that cast, and the light's own view of the meshes.
// Stratified over the light and seeded.
struct DepthTrace {
    Preset preset = Preset::best; // what the other settings started from
    int samples = 64; // rays a receiver
    std::int64_t seed = 1;
    double tolerance = 0; // what computing fewer receivers may add to a pixel's error (docs/tolerance.md); 0: every receiver is computed
};

} // namespace penumbra
