// Receivers that lie on a caster's own surface: moved off it by what rounding can do, and no more.
#pragma once

#include <cstdint>
#include <vector>

#include "trace/embree_scene.hpp"

namespace penumbra {

// A triangle with the bounds of what rounding does to it, in traced space.
struct Surface {
    Vec3 corner[3];
    Vec3 normal;          // unit length, outwards
    double offset = 0;    // how far a receiver that lies on it may be off, its depth's own rounding aside
    double clearance = 0; // from here on Embree's float32 arithmetic tells on which side of it a point is
    double sideways = 0;  // Embree's edge tests may take a point this far beyond an edge for one inside
};

Surface triangle_surface(const Tracer::Impl& scene, std::uint32_t triangle);

// The largest distance at which the surface may concern a receiver, its depth's own rounding aside.
double reach(const Surface& surface);

// Scratch space of one thread.
struct NearSurfaces {
    std::vector<std::uint32_t> triangles;
    std::vector<Surface> surfaces;
    bool out_of_memory = false;
};

// `point` (traced space) lies on what a camera sees along `view` (unit length), up to a distance of `depth_error`. Returns the point on the
// camera's side of every triangle that it may lie on, at the least distance that float32 resolves.
Vec3 before_surfaces(const Tracer::Impl& scene, const Vec3& point, const Vec3& view, double depth_error, NearSurfaces& scratch);

} // namespace penumbra
