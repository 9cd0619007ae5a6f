#include "trace/surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include <penumbra/error.hpp>

namespace penumbra {
namespace {

double largest_length(const Vec3 (&v)[3]) { return std::max({v[0].length(), v[1].length(), v[2].length()}); }

double distance_to(const Imath::Box3d& box, const Vec3& p)
{
    const Vec3 out(std::max({box.min.x - p.x, p.x - box.max.x, 0.0}), std::max({box.min.y - p.y, p.y - box.max.y, 0.0}),
                   std::max({box.min.z - p.z, p.z - box.max.z, 0.0}));
    return out.length();
}

// Whether the point is above or below the triangle, or no further beyond an edge than `margin`.
bool beside(const Surface& s, const Vec3& p, double margin)
{
    for (int i = 0; i < 3; ++i) {
        const Vec3 edge = s.corner[(i + 1) % 3] - s.corner[i];
        if (s.normal.cross(edge).dot(p - s.corner[i]) < -margin * edge.length()) return false;
    }
    return true;
}

bool note_triangle(RTCPointQueryFunctionArguments* arguments)
{
    auto* found = static_cast<NearSurfaces*>(arguments->userPtr);
    try {
        found->triangles.push_back(arguments->primID);
    } catch (const std::bad_alloc&) {
        found->out_of_memory = true; // no exception may pass through Embree
    }
    return false; // the radius stays
}

void find_triangles(const Tracer::Impl& scene, const Vec3& point, double radius, NearSurfaces& found)
{
    found.triangles.clear();
    // Embree's query is in float32: the point's rounding and the radius's own come on top.
    const double rounded = radius + root3 * float_rounding * point.length();
    RTCPointQuery query{};
    query.x = static_cast<float>(point.x);
    query.y = static_cast<float>(point.y);
    query.z = static_cast<float>(point.z);
    query.radius = std::nextafter(static_cast<float>(rounded), std::numeric_limits<float>::infinity());
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene.scene, &query, &context, note_triangle, &found);
    if (found.out_of_memory) throw Error(ErrorCode::too_large, "tracing: out of memory for the surfaces at one receiver");
    std::sort(found.triangles.begin(), found.triangles.end());
}

} // namespace

Surface triangle_surface(const Tracer::Impl& scene, std::uint32_t triangle)
{
    Surface s;
    for (int i = 0; i < 3; ++i) s.corner[i] = scene.corner(triangle, i);
    const Vec3 edges[] = {s.corner[1] - s.corner[0], s.corner[2] - s.corner[1], s.corner[0] - s.corner[2]};
    const Vec3 normal = edges[0].cross(-edges[2]);
    s.normal = normal / normal.length();
    const double u = float_rounding, edge = largest_length(edges);

    // The corners are world space positions in float32 (u |world|), rounded once more relative to the origin (u |traced|). A depth map made
    // elsewhere has seen roundings of the same kind: twice the sum.
    const Vec3 world = scene.origin * scene.scale;
    const Vec3 in_world[] = {s.corner[0] + world, s.corner[1] + world, s.corner[2] + world};
    s.offset = 2 * root3 * u * (largest_length(s.corner) + largest_length(in_world));

    // Embree (robust, Pluecker) puts the ray's origin O into the plane equation: h = (v0 - O) . N / |N|, N = e0 x e1. O is on the triangle,
    // so |v - O| <= e, the longest edge. Each v - O is rounded (u e a coordinate), each edge too (with what it inherits, 3 u e a
    // coordinate, 5.2 u e as a vector), N inherits 2 e 5.2 u e and its own products and difference add 2 u e^2 a coordinate: 14 u e^2. The
    // dot product adds 3 u e |N| and inherits e (14 u e^2) and 1.8 u e |N|. So h is off by at most u e (5 + 14 e^2 / |N|). Needles whose
    // float32 normal means nothing (e^2 / |N| beyond 2^8 and more) are capped: a 4096th of their length.
    s.clearance = std::min(u * edge * (5 + 14 * edge * edge / normal.length()), 0x1p-12 * edge);

    // Its edge tests are 16 roundings of numbers of that size (crossings.cpp).
    s.sideways = 16 * u * edge;
    return s;
}

double reach(const Surface& surface) { return surface.offset + surface.clearance + surface.sideways; }

// Why not an epsilon along the normal or along the shadow ray: it must be larger than rounding and smaller than the scene's detail, and no
// number is both for every scene. And why not a step towards the camera: where the camera grazes the surface, no step is long enough.
//
// The receiver P was c + d w with d in float32, so it is off by at most 2^-24 d |w| along the camera's ray: `depth_error`, known here; and
// the triangle's corners have been rounded: `offset`. Hence a triangle that P lies on is no further from P than the sum, a bound that holds
// at any angle. Every such triangle is looked up, its plane is turned to face the camera, and P moves along the plane's normal until it
// clears the plane by `clearance` plus the rounding of P itself: then Embree sees P on the camera's side of it, and a shadow ray meets it
// only when the light is on the other side. A receiver that lies on no caster does not move.
Vec3 before_surfaces(const Tracer::Impl& scene, const Vec3& point, const Vec3& view, double depth_error, NearSurfaces& scratch)
{
    const double radius = depth_error + scene.surface_reach;
    if (scene.triangles.empty() || distance_to(scene.box, point) > radius) return point;
    find_triangles(scene, point, radius, scratch);
    if (scratch.triangles.empty()) return point;

    // The planes that the point may lie on, facing the camera.
    const double rounding = root3 * float_rounding * point.length();
    scratch.surfaces.clear();
    for (const std::uint32_t t : scratch.triangles) {
        Surface s = triangle_surface(scene, t);
        if (s.normal.dot(view) > 0) std::swap(s.corner[1], s.corner[2]), s.normal = -s.normal;
        s.clearance += rounding;
        const double height = s.normal.dot(point - s.corner[0]);
        const double off = depth_error + s.offset;
        if (height > -off && height < s.clearance && beside(s, point, off + s.sideways)) scratch.surfaces.push_back(s);
    }
    std::stable_sort(scratch.surfaces.begin(), scratch.surfaces.end(),
                     [&](const Surface& a, const Surface& b) { return a.normal.dot(view) < b.normal.dot(view); });

    // Clear one after the other, those that face the camera most first. At a silhouette the far side, turned to the camera, opposes the
    // near side: it is left out. Two planes at an angle of 60 degrees or more undo at most half of each other's move a pass: four passes
    // leave a small part, less than the slack in `clearance`.
    Vec3 p = point;
    const Vec3* const first = scratch.surfaces.empty() ? nullptr : &scratch.surfaces.front().normal;
    for (int pass = 0; pass < 4; ++pass)
        for (const Surface& s : scratch.surfaces) {
            if (s.normal.dot(*first) < -0.5) continue;
            const double height = s.normal.dot(p - s.corner[0]);
            if (height < s.clearance) p += s.normal * (s.clearance - height);
        }
    return p;
}

} // namespace penumbra
