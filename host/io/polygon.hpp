// Polygons into triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Imath/ImathVec.h>

namespace penumbra {

// Appends the triangles of one polygon (3 or more corners; indices into `positions`), same sense of rotation. Concave ones by ear clipping
// in the plane of their mean normal (Meisters 1975); what has no area gives a fan.
void triangulate(std::span<const std::uint32_t> corners, std::span<const Imath::V3f> positions,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

} // namespace penumbra
