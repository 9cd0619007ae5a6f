// A mask computed only where it must be: some receivers of every block are shaded, and the block is divided where they do not tell the others.
//
// Visibility is smooth inside a penumbra. Blocks of 32 x 32 pixels are shaded at their corners, the middles of their edges and their centre. A block is
// divided, down to single pixels, where
//  - its receivers are not of one smooth surface,
//  - a silhouette may pass unseen between the shaded ones (occluder_field.hpp),
//  - one of the five middles differs by more than a sixth of `tolerance` from what the corners say.
// Elsewhere pixels lie between the nine. A block that nothing can darken, neither what casts nor its own horizon, is not shaded at all.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <penumbra/scene.hpp>

#include "common/depth_walk.h"
#include "refine/occluder_field.hpp"

namespace penumbra {

// The receivers of a mask, [height][width].
struct ReceiverImage {
    const Camera& camera;
    int width = 0, height = 0;
    std::span<const float> depth;         // planar; not finite or not positive: no receiver
    std::span<const DepthVector> points;  // in the camera's coordinates, where they do not lie at the pixels' centres; z = 0: no receiver
    std::span<const DepthVector> normals; // of unit length, in the camera's coordinates; empty: not known
};

// Visibility of pixels (y width + x), `channels` values each, in their order.
using ShadePixels = std::function<std::vector<float>(std::span<const std::uint32_t> pixels)>;

struct CoarseToFine {
    std::vector<float> visibility;       // [height][width][channels]; 1 where no receiver is
    std::uint64_t receivers = 0, shaded = 0;
};

struct Coarse {
    double tolerance = 0;   // above 0
    bool proves_lit = false; // the field's maps and the receivers' own horizons are all that darkens
};

// The same bits whatever the threads, as long as `shade` gives them.
CoarseToFine shade_coarse_to_fine(const ReceiverImage& receivers, int channels, const Coarse& coarse, const OccluderField& field, const ShadePixels& shade);

} // namespace penumbra
