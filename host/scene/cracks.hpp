// Vertices that nearly meet: surfaces that were saved as loose triangles, their corners rounded apart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra {

// For each place the index of the place that it is joined to: itself, or the first of those before it that stays and is no further off than
// `tolerance` (above 0).
std::vector<std::uint32_t> joined_within(std::span<const Imath::V3f> places, double tolerance);

// Borders of a mesh that lie along each other without meeting.
struct Cracks {
    std::size_t vertices = 0; // of borders, that another vertex of a border nearly meets
    double widest = 0;        // the furthest that such two are apart
};

// Those up to `widest` apart, and less than a sixteenth of the shortest border at either. A border is an edge of one triangle alone.
Cracks find_cracks(const TriangleMesh& mesh, double widest);

} // namespace penumbra
