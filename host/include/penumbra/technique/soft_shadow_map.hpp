// Settings of soft_shadow_map.
#pragma once

#include <penumbra/technique/preset.hpp>

namespace penumbra {

enum class Sides { front, back, both };
enum class Accumulator { binary32, compensated, binary16 };
enum class Reduction { area, nearest };
enum class PatchVisibility { sum, united };

// Soft Shadow Maps (Atty, Holzschuch, Lapierre, Hasenfratz, Hansen, Sillion 2006): each texel of the occluder map is a micro-patch
// parallel to the light; its back-projection hides a share of the light.
struct SoftShadowMap {
    Preset preset = Preset::best; // what the other settings started from
    // united (`union` in scene files): which of 32 x 32 samples of the light the patches of all maps hide, each once. sum: the paper's, the shares
    // added up, and of two maps the larger.
    PatchVisibility visibility = PatchVisibility::united;
    Sides sides = Sides::both;                       // 3.5: one map each, merged by the larger occlusion
    int layers = 3;                                  // of the union: surfaces behind the front that are used as well, peeled or given
    int resolution = 0;                              // texels along the occluder map's longer side; 0: the map as it is, of the union up to 2^21 texels of all maps
    Reduction reduction = Reduction::area;           // how a larger map becomes `resolution`, of sum; united takes the nearest texel
    Accumulator accumulator = Accumulator::binary32; // of sum; binary16: the blending of Appendix A, for study
    double bias = 1.0;                               // in units of the bound derived from each texel's slope and the depth's precision
    bool project = false;                            // shade in the light's view and sample that mask from the receivers' camera (3.1)
    int project_resolution = 512;                    // of that mask
    // What computing less may add to a pixel's error: fewer receivers (docs/tolerance.md), and of the union coarser patches. 0: everything is computed.
    double tolerance = 0.03;
};

} // namespace penumbra
