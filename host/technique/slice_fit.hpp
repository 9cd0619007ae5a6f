// Where occlusion_texture's slices lie: the window that they are seen through and the planes between them. Plain numbers; no device.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <penumbra/technique.hpp>

#include "common/shared.h"
#include "scene/light_space.hpp"

namespace penumbra {

// What casts, in light space (light_space.hpp), scene units, as binary32.
struct SliceCasters {
    std::vector<float> vertices;         // x, y, z
    std::vector<std::int32_t> triangles; // three vertices each
    std::uint64_t left_out = 0;          // triangles with vertices that are not finite
};

// Triangles with vertices that are not finite are left out, and counted.
SliceCasters slice_casters(const LightFrame& light, std::span<const TriangleMesh* const> meshes);

// The range of depth that the slices share. A directional light has its origin moved to `origin` along its direction, before all that
// casts.
struct SliceRange {
    double near = 0, far = 0; // far <= 0: nothing casts
    std::uint64_t cut = 0;    // triangles that reach nearer than `near` or behind the light's plane: that part casts nothing
};

// From the nearest to the furthest depth of the casters, but no nearer than 2^-10 of the furthest: what almost touches the light's plane
// would take all slices.
SliceRange slice_range(const SliceCasters& casters, bool directional);

// The planes between slices, `slices` + 1 of them: even steps of depth (the paper, 3.4), of its reciprocal, or with as much of the casters'
// area between any two.
std::vector<float> slice_depths(const SliceCasters& casters, const SliceRange& range, int slices, Placement placement, bool directional);

// One part of a rectangle (or the whole light): its centre from the light's, and its half extents; scene units (directional: tangents).
struct SlicePart {
    double centre_x = 0, centre_y = 0, half_u = 0, half_v = 0;
};

// The window, `resolution` texels along each side, that just holds what casts within the range.
// Centre light: seen from the part's centre. Only where casters lie at tangents beyond 4 does it move back, until they do not.
// Centre behind_light (the paper, 3.4, Fig. 5): so far behind that the frustum through the light's edges holds the casters, by the axis that
// lets it be further away, and no further than the casters reach (from there an orthographic view, which leaks, would be near).
SliceView slice_view(const SliceCasters& casters, const SliceRange& range, const SlicePart& part, const OcclusionTexture& settings,
                     bool directional);

} // namespace penumbra
