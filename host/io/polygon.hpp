// Polygons into triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra {

// Appends the triangles of one polygon: places in `corners` (3 or more points in order), three a triangle, same sense of rotation. Concave
// ones, and those with holes that a cut joins to the border (keyholes), by ear clipping in the plane of their mean normal (Meisters 1975),
// with exact signs; what crosses itself or has no area gives a fan of what is left.
void triangulate(std::span<const Vec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles);

} // namespace penumbra
