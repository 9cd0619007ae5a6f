#include "trace/crossings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include <penumbra/error.hpp>

namespace penumbra {
namespace {

// What the filter writes to. Embree hands the context through as a pointer to its first member.
struct CollectingContext {
    RTCIntersectContext embree;
    std::vector<Crossing>* crossings;
    bool out_of_memory;
};

// A ray whose origin has been moved along to twice the scene's bounding sphere, so that a far camera loses no digits in float32 (twice:
// rounding must not take it past a corner on the sphere).
struct EntryRay {
    Vec3 origin;
    double moved; // depth of the origin
};

EntryRay to_entry(const Imath::Box3d& box, const ViewRay& ray)
{
    const Vec3 center = box.center();
    const double twice_radius = (box.max - box.min).length();
    const double speed = ray.direction.length();
    const double nearest = ((center - ray.origin).dot(ray.direction) / speed - twice_radius) / speed;
    const double moved = std::max(nearest, 0.0);
    return {ray.origin + ray.direction * moved, moved};
}

// Depth at which the ray meets the triangle's plane. False for a plane that holds the ray: the neighbours across its edges are crossed.
bool meet(const Tracer::Impl& scene, const ViewRay& ray, double entry, Crossing& crossing)
{
    const Vec3 a = scene.corner(crossing.triangle, 0), b = scene.corner(crossing.triangle, 1), c = scene.corner(crossing.triangle, 2);
    const Vec3 normal = (b - a).cross(c - a);
    const double approach = normal.dot(ray.direction);
    if (approach == 0) return false;

    // A ray that passes just beside an edge meets the plane outside of the triangle: keep to the triangle's own depths.
    const double depths[] = {(a - ray.origin).dot(ray.view), (b - ray.origin).dot(ray.view), (c - ray.origin).dot(ray.view)};
    const auto [nearest, furthest] = std::minmax({depths[0], depths[1], depths[2]});
    crossing.depth = std::clamp(normal.dot(a - ray.origin) / approach, nearest, furthest);
    crossing.leaves = approach > 0;

    // Embree's ray differs from the exact one by the rounding of its origin, its direction and its edge tests (vertex minus origin, edge,
    // sum of vertices, cross product, dot product): at most 16 roundings of numbers no larger than the ray's length so far plus the
    // triangle and the origin. Sideways by that much, depth changes by the slope of the plane.
    const double edge = std::max({(b - a).length(), (c - b).length(), (a - c).length()});
    const double length = (crossing.depth - entry) * ray.direction.length() + edge;
    const double origin_size = (ray.origin + ray.direction * entry).length();
    const double sideways = 16 * float_rounding * (origin_size + length);
    crossing.uncertainty = std::min(sideways * normal.length() / std::abs(approach), furthest - nearest);
    return true;
}

// Two triangles that share an edge or a vertex meet there at one depth, and the ray passes the edge within the uncertainty of both. They
// face the same way: at an edge where a surface turns away from the ray, the ray enters and leaves, which is two crossings.
bool same_crossing(const Crossing& a, const Crossing& b)
{
    return a.leaves == b.leaves && std::abs(a.depth - b.depth) <= a.uncertainty + b.uncertainty;
}

} // namespace

ViewRay view_ray(const Tracer::Impl& scene, const Camera& camera, int width, int height, int x, int y)
{
    const Frame& f = camera.frame;
    const Vec3 from = camera_point(camera, width, height, x + 0.5, y + 0.5, 0);
    const Vec3 step = camera_point(camera, width, height, x + 0.5, y + 0.5, 1) - from;
    return {.origin = (f.origin - scene.origin + f.x * from.x + f.y * from.y) * scene.scale,
            .direction = f.x * step.x + f.y * step.y - f.z,
            .view = -f.z};
}

void collect_crossing(const RTCFilterFunctionNArguments* arguments)
{
    auto* context = reinterpret_cast<CollectingContext*>(arguments->context);
    const auto* cuts = static_cast<const std::vector<TracedCut>*>(arguments->geometryUserPtr); // null when nothing is cut out
    for (unsigned i = 0; i < arguments->N; ++i) {
        if (arguments->valid[i] == 0) continue;
        arguments->valid[i] = 0;
        const unsigned triangle = RTCHitN_primID(arguments->hit, arguments->N, i);
        if (cuts && !is_there((*cuts)[triangle], RTCHitN_u(arguments->hit, arguments->N, i), RTCHitN_v(arguments->hit, arguments->N, i))) continue;
        try {
            context->crossings->push_back({.triangle = triangle});
        } catch (const std::bad_alloc&) {
            context->out_of_memory = true; // no exception may pass through Embree
        }
    }
}

void find_crossings(const Tracer::Impl& scene, const ViewRay& ray, std::vector<Crossing>& crossings)
{
    crossings.clear();
    if (scene.triangles.empty()) return;
    const EntryRay entry = to_entry(scene.box, ray);

    // Collect every triangle on the ray in one traversal.
    CollectingContext context{{}, &crossings, false};
    rtcInitIntersectContext(&context.embree);
    RTCRayHit query{};
    query.ray.org_x = static_cast<float>(entry.origin.x);
    query.ray.org_y = static_cast<float>(entry.origin.y);
    query.ray.org_z = static_cast<float>(entry.origin.z);
    query.ray.dir_x = static_cast<float>(ray.direction.x);
    query.ray.dir_y = static_cast<float>(ray.direction.y);
    query.ray.dir_z = static_cast<float>(ray.direction.z);
    query.ray.tfar = std::numeric_limits<float>::infinity();
    query.ray.mask = ~0u;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    const RTCRay& r = query.ray;
    if (!castable({r.org_x, r.org_y, r.org_z}) || !castable({r.dir_x, r.dir_y, r.dir_z})) return;
    rtcIntersect1(scene.scene, &context.embree, &query);
    if (context.out_of_memory) throw Error(ErrorCode::too_large, "tracing: out of memory for the surfaces along one ray");

    // Place them in double precision, in order; ties by index, so that the order is one.
    std::erase_if(crossings, [&](Crossing& c) { return !meet(scene, ray, entry.moved, c) || !(c.depth > 0); });
    std::sort(crossings.begin(), crossings.end(),
              [](const Crossing& a, const Crossing& b) { return a.depth != b.depth ? a.depth < b.depth : a.triangle < b.triangle; });
    crossings.erase(std::unique(crossings.begin(), crossings.end(), same_crossing), crossings.end());
}

} // namespace penumbra
