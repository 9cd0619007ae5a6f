// Settings of soft_shadow_volume.
#pragma once

#include <penumbra/technique/preset.hpp>

namespace penumbra {

enum class Coverage { linear, analytic, texture };
enum class Lookup { nearest, bilinear, quadrilinear };
enum class Silhouettes { centre, per_receiver };
enum class Overlap { sum, max, half_min, product };
enum class WedgeBuffer { binary32, int16, six_bits, twelve_bits };
enum class WedgeCulling { none, loose, far_depth, tight };

// Soft Shadow Volumes (Assarsson, A Real-Time Soft Shadow Volume Algorithm, 2003): the hard shadow of the light's centre, corrected inside
// the penumbra wedge of each silhouette edge. Exact for a caster whose silhouette is the same from all of the light, as of a planar one.
struct SoftShadowVolume {
    Preset preset = Preset::best; // what the other settings started from
    // From where silhouettes are found. per_receiver: from each receiver, and triangles are counted before each of 32 x 32 samples of the
    // light (Laine et al. 2005): what rays to those samples see. Of rectangles and points, with nothing else changed but light, culling, bias.
    Silhouettes silhouettes = Silhouettes::centre;
    Coverage coverage = Coverage::analytic; // how an edge's share of the light is found (Papers I, IV, III)
    bool smooth = false;                    // linear: s' = 3 s^2 - 2 s^3 (Paper I, 4.2)
    int corner_wedges = 0;                  // linear: extra wedges at a corner of 0 degrees, fewer up to a right angle (Paper I, Fig. 7)
    Overlap overlap = Overlap::sum;         // how sheets that hide the same light are joined; half_min: Paper IV, Eq. 1
    int light_splits = 1;                   // n x n parts of a rectangle, each with silhouettes of its own (Paper IV, 5.2)
    int table = 32;                         // texture: places an axis of the coverage table; even (Paper III, 3.3: n)
    Lookup lookup = Lookup::quadrilinear;   // texture: between the table's places
    WedgeBuffer buffer = WedgeBuffer::binary32; // the papers' integer buffers, for study
    WedgeCulling culling = WedgeCulling::tight; // what spares pairs of edge and receiver, for study; the mask is the same
    double bias = 1.0;                          // of casters made from depth maps: half texels that count as the receiver's own surface
    double tolerance = 0; // what computing fewer receivers may add to a pixel's error (docs/tolerance.md); 0: every receiver is computed
};

} // namespace penumbra
