// Settings of shadow_map.
#pragma once

#include <penumbra/technique/preset.hpp>

namespace penumbra {

enum class ShadowFilter { hard, percentage_closer, bicubic };

// Shadow mapping (Williams 1978) from the light's centre: the baselines that the papers compare with. The light's extent is ignored.
struct ShadowMap {
    Preset preset = Preset::best; // what the other settings started from
    ShadowFilter filter = ShadowFilter::hard;
    int taps = 3;      // percentage_closer: taps x taps texels (Reeves et al. 1987)
    double bias = 1.0; // in units of the bound derived from each texel's slope and the depth's precision
    double tolerance = 0; // not used: its penumbrae are not the light's, and every receiver is computed (docs/tolerance.md)
};

} // namespace penumbra
