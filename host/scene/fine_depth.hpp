// What is seen of a depth map's texels beside their centres.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

namespace penumbra {

// Samples of the texels in which something begins or ends: side x side in each, at the centres of as many equal parts. The map's own depth is
// all there is to the others.
struct FineDepth {
    int side = 0;
    std::shared_ptr<const std::vector<std::int32_t>> blocks; // [height][width]: where a texel's samples are; -1: it has none
    std::vector<float> depth = {};                           // [blocks][side][side], planar

    std::size_t block_size() const { return static_cast<std::size_t>(side) * static_cast<std::size_t>(side); }
};

} // namespace penumbra
