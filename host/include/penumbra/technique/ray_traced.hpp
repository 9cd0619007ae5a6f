// Settings of ray_traced.
#pragma once

#include <cstdint>

#include <penumbra/technique/preset.hpp>

namespace penumbra {

// Shadow rays (Embree) through the scene's objects: the reference. Stratified over the light and seeded.
struct RayTraced {
    Preset preset = Preset::best; // what the other settings started from
    int samples = 256;     // rays a receiver
    bool adaptive = false; // `first_samples` rays everywhere, the rest only around receivers whose visibility is not settled
    int first_samples = 16;
    std::int64_t seed = 1;
    double tolerance = 0; // what computing fewer receivers may add to a pixel's error (docs/tolerance.md); 0: every receiver is computed
};

} // namespace penumbra
