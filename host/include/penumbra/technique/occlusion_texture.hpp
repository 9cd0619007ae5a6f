// Settings of occlusion_texture.
#pragma once

#include <penumbra/technique/preset.hpp>

namespace penumbra {

enum class Placement { uniform, reciprocal, occupied };
enum class Prefilter { nbuffer, mipmap, summed_area };
enum class Combine { product, sum, max, layered, layered_max };
enum class SelfShadow { automatic, fade, own, omit };
enum class ProjectionCentre { light, behind_light };
enum class LevelStorage { binary32, normalized16 };

// Occlusion textures (Eisemann, Decoret, Occlusion Textures for Plausible Soft Shadows, 2008): the casters cut into slices parallel to the
// light, each a picture that is prefiltered; a receiver looks each slice between it and the light up once. Cost does not depend on the
// light's size and hardly on the casters.
struct OcclusionTexture {
    Preset preset = Preset::best; // what the other settings started from
    int slices = 16; // 3.4
    Placement placement =
        Placement::uniform; // of the slices along the light's axis: even in depth (3.4), in its reciprocal, or in the casters' area
    int resolution = 256;   // texels along each side of a slice
    ProjectionCentre projection_centre =
        ProjectionCentre::light; // the slices are seen from the light's centre, or from so far behind it that its edges' frustum holds the casters (3.4)
    Prefilter prefilter = Prefilter::summed_area;      // 3.2
    LevelStorage storage = LevelStorage::normalized16; // of N-buffers and mip-maps
    Combine combine =
        Combine::layered_max; // of slices: Eq. 5 (3.3) is product; layered: the sum within each depth layer, the product or the greatest across them
    int layers = 4;        // layered: depth layers, the last of which takes all that lies behind
    bool leak_fix = false; // each slice is seen in the next one away from the light too (3.4.1)
    // fade (3.4.2): a receiver's own slice is left out, and the one before fades in with the distance from it. own: its own fades in. omit: its
    // own is left out at once. automatic: own where no receiver casts, else fade. What lies beyond the last caster sees every slice in full.
    SelfShadow self_shadow = SelfShadow::automatic;
    int light_splits = 1; // n x n parts of a rectangle, each with slices of its own
    double tolerance = 0; // what computing fewer receivers may add to a pixel's error (docs/tolerance.md); 0: every receiver is computed
};

} // namespace penumbra
