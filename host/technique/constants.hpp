// Specialisation constants of every kernel file, typed. One function each makes the text that the build checks and the cache is keyed by.
//
// A technique's kernel file includes receivers.cl and occluders.cl, and launches all it needs from its own program: drivers take tens of
// milliseconds a program even from their caches. Those two files are programs of their own as well, where no technique is at work.
#pragma once

#include <vector>

#include "opencl/quirks.hpp"
#include "opencl/specialisation.hpp"

namespace penumbra {

// Rows of a tile of receivers (see soft_shadow_map.cl; the width is TILE_WIDTH of common/shared.h).
constexpr int tile_rows = 8;

struct ReceiversConstants {
    int rows = tile_rows;
    opencl::Specialisation specialisation() const;
};

struct OccludersConstants {
    opencl::Specialisation specialisation() const;
};

struct ShadowMapConstants {
    int rows = tile_rows;
    opencl::Specialisation specialisation() const;
};

struct SoftShadowMapConstants {
    int lanes = 16;
    int item_rows = tile_rows;
    int rows = tile_rows;
    int accumulator = 0; // in the order of Accumulator
    opencl::Specialisation specialisation() const;
};

struct SoftShadowVolumeConstants {
    int lanes = 16;
    int item_rows = tile_rows;
    int rows = tile_rows;
    int light = 0;       // 0 rectangle, 1 disc
    int coverage = 1;    // in the order of Coverage
    int channels = 1;    // of the light
    int lookup = 2;      // in the order of Lookup
    int accumulator = 0; // in the order of WedgeBuffer
    opencl::Specialisation specialisation() const;
};

struct OcclusionTextureConstants {
    int lanes = 16;
    int rows = tile_rows;
    int prefilter = 0; // in the order of LevelKind
    int storage = 0;   // in the order of LevelStorage
    opencl::Specialisation specialisation() const;
};

struct SmoothieConstants {
    int lanes = 16;
    int rows = tile_rows;
    opencl::Specialisation specialisation() const;
};

// What the kernels are built with on some device; the build compiles each.
std::vector<opencl::Specialisation> every_specialisation();

} // namespace penumbra
