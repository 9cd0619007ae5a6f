// All surfaces that a ray crosses, with their depth in double precision.
#pragma once

#include <cstdint>
#include <vector>

#include <embree3/rtcore.h>

#include "trace/embree_scene.hpp"

namespace penumbra {

// Points at `origin` + t `direction`, t > 0, in traced space. `view` is the viewing axis and view . direction = 1: t is planar depth.
struct ViewRay {
    Vec3 origin, direction, view;
};

struct Crossing {
    double depth = 0;       // traced space
    double uncertainty = 0; // how far `depth` may be off where the ray grazes an edge of the triangle
    std::uint32_t triangle = 0;
    bool leaves = false; // the triangle's outward normal points along the ray
};

// The ray through pixel (x, y)'s centre.
ViewRay view_ray(const Tracer::Impl& scene, const Camera& camera, int width, int height, int x, int y);

// Everything before the camera that the ray crosses, in order of depth; the same crossing reported by two triangles that share an edge or a
// vertex counts once. `crossings` is cleared first.
void find_crossings(const Tracer::Impl& scene, const ViewRay& ray, std::vector<Crossing>& crossings);

// Embree's intersection filter: notes the triangle and lets the ray go on.
void collect_crossing(const RTCFilterFunctionNArguments* arguments);

} // namespace penumbra
