// How occlusion_texture's prefiltered levels lie in memory, and how many there are. Plain numbers; no device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <penumbra/technique.hpp>

#include "common/shared.h"

namespace penumbra {

// What the kernels call PREFILTER.
enum class LevelKind { nbuffer, mipmap, table, smooth };
LevelKind level_kind(bool directional, const OcclusionTexture& settings);

// Bytes of a stored mean.
std::size_t element_size(LevelKind kind, const OcclusionTexture& settings);

// Whether each slice is taken apart into depth layers.
bool is_layered(const OcclusionTexture& settings);

// Levels that a kernel of at most `size` texels asks for: to the one that is as large, but no further than one that holds the whole window
// of `side` texels (of smooth levels: as wide).
int levels_for(double size, int side, LevelKind kind);

struct LevelLayout {
    std::vector<OcclusionLevel> levels;
    std::vector<int> textures;  // of each level: how many are built
    std::uint64_t elements = 0; // of all
};

// `levels` [texture], not growing from one texture to the next.
LevelLayout level_layout(const std::vector<int>& levels, int side, LevelKind kind);

} // namespace penumbra
