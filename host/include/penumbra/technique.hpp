// The techniques and their settings.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include <penumbra/export.hpp>
#include <penumbra/scene.hpp>

namespace penumbra {

enum class ShadowFilter { hard, percentage_closer, bicubic };

// Shadow mapping (Williams 1978) from the light's centre: the baselines that the papers compare with. The light's extent is ignored.
struct ShadowMap {
    ShadowFilter filter = ShadowFilter::hard;
    int taps = 3;      // percentage_closer: taps x taps texels (Reeves et al. 1987)
    double bias = 1.0; // in units of the bound derived from each texel's slope and the depth's precision
};

enum class Sides { front, back, both };
enum class Accumulator { binary32, compensated, binary16 };
enum class Reduction { area, nearest };

// Soft Shadow Maps (Atty, Holzschuch, Lapierre, Hasenfratz, Hansen, Sillion 2006): each texel of the occluder map is a micro-patch
// parallel to the light; its back-projection's share of the light is summed.
struct SoftShadowMap {
    Sides sides = Sides::both;                       // 3.5: one map each, merged by the larger occlusion
    int resolution = 0;                              // texels along the occluder map's longer side; 0: the map as it is
    Reduction reduction = Reduction::area;           // how a larger map becomes `resolution`
    Accumulator accumulator = Accumulator::binary32; // binary16: the blending of Appendix A, for study
    double bias = 1.0;                               // in units of the bound derived from each texel's slope and the depth's precision
    bool project = false;                            // shade in the light's view and sample that mask from the receivers' camera (3.1)
    int project_resolution = 512;                    // of that mask
};

enum class Coverage { linear, analytic, texture };
enum class Lookup { nearest, bilinear, quadrilinear };
enum class Overlap { sum, max, half_min, product };
enum class WedgeBuffer { binary32, int16, six_bits, twelve_bits };
enum class WedgeCulling { none, loose, far_depth, tight };

// Soft Shadow Volumes (Assarsson, A Real-Time Soft Shadow Volume Algorithm, 2003): the hard shadow of the light's centre, corrected inside
// the penumbra wedge of each silhouette edge. Exact for a caster whose silhouette is the same from all of the light, as of a planar one.
struct SoftShadowVolume {
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
};

enum class Placement { uniform, reciprocal, occupied };
enum class Prefilter { nbuffer, mipmap, summed_area };
enum class Combine { product, sum, max, layered, layered_max };
enum class SelfShadow { fade, own, omit };
enum class LevelStorage { binary32, normalized16 };

// Occlusion textures (Eisemann, Decoret, Occlusion Textures for Plausible Soft Shadows, 2008): the casters cut into slices parallel to the
// light, each a picture that is prefiltered; a receiver looks each slice between it and the light up once. Cost does not depend on the
// light's size and hardly on the casters.
struct OcclusionTexture {
    int slices = 16; // 3.4
    Placement placement =
        Placement::uniform; // of the slices along the light's axis: even in depth (3.4), in its reciprocal, or in the casters' area
    int resolution = 256;   // texels along each side of a slice
    Prefilter prefilter = Prefilter::nbuffer;          // 3.2
    LevelStorage storage = LevelStorage::normalized16; // of N-buffers and mip-maps
    Combine combine =
        Combine::product;  // of slices (3.3, Eq. 5); layered: the sum within each depth layer, the product or the greatest across them
    int layers = 4;        // layered: depth layers, the last of which takes all that lies behind
    bool leak_fix = false; // each slice is seen in the next one away from the light too (3.4.1)
    SelfShadow self_shadow =
        SelfShadow::fade; // 3.4.2: fade: a receiver's own slice is left out and the one before fades in with the distance from it
    int light_splits = 1; // n x n parts of a rectangle, each with slices of its own
};

enum class SmoothieWidth { light, t };
enum class SilhouetteSource { object, image };
enum class Falloff { sinusoidal, linear };

// Smoothies (Chan, Durand, Rendering Fake Soft Shadows with Smoothies, 2003): a shadow map whose silhouettes wear fins that fade to light
// outwards.
struct Smoothie {
    SmoothieWidth t_from =
        SmoothieWidth::light; // light: a smoothie is as wide as the outer half of the penumbra that the light's size casts
    double t = 0.05;          // t_from t: the paper's t, where the light's image is 2 wide along its wider side
    SilhouetteSource silhouettes =
        SilhouetteSource::object;          // of the objects that cast (the paper's section 3), or of the depth map (its section 6)
    Falloff falloff = Falloff::sinusoidal; // 3.1
    bool two_sided = false;                // beyond the paper: an inner fin too, half lit at the silhouette
    double bias = 1.0;                     // as of ShadowMap
};

// Shadow rays (Embree) through the scene's objects: the reference. Stratified over the light and seeded.
struct RayTraced {
    int samples = 256;     // rays a receiver
    bool adaptive = false; // `first_samples` rays everywhere, the rest only around receivers whose visibility is not settled
    int first_samples = 16;
    std::int64_t seed = 1;
};

using Technique = std::variant<ShadowMap, SoftShadowMap, SoftShadowVolume, OcclusionTexture, Smoothie, RayTraced>;

// The typed settings of a request, and back. Throws invalid_input for an unknown kind or key (naming the known ones), a value of the
// wrong type or out of range.
PENUMBRA_API Technique technique_from(const TechniqueRequest& request);
PENUMBRA_API TechniqueRequest request_from(const Technique& technique); // every key, with its value
PENUMBRA_API std::string kind_of(const Technique& technique);

} // namespace penumbra
