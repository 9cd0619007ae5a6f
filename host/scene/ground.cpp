#include "scene/ground.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "scene/camera.hpp"

namespace penumbra {
namespace {

// A plane: points where normal . p = offset.
struct Plane {
    Vec3 normal{0, 0, 0};
    double offset = 0;
};

// The plane that a mesh lies in, to a hundred-thousandth of its size; nothing when it lies in none.
std::optional<Plane> plane_of(const TriangleMesh& mesh)
{
    if (mesh.triangles.empty()) return {};
    Vec3 normal(0, 0, 0);
    for (const auto& [a, b, c] : mesh.triangles) {
        const Vec3 n = (Vec3(mesh.positions[b]) - Vec3(mesh.positions[a])).cross(Vec3(mesh.positions[c]) - Vec3(mesh.positions[a]));
        if (n.length() > normal.length()) normal = n;
    }
    if (!(normal.length() > 0)) return {};
    Plane plane{normal.normalized(), 0};
    plane.offset = plane.normal.dot(Vec3(mesh.positions[mesh.triangles.front()[0]]));
    const double tolerance = 1e-5 * (bounds(mesh).max - bounds(mesh).min).length();
    for (const Imath::V3f& p : mesh.positions)
        if (std::abs(plane.normal.dot(Vec3(p)) - plane.offset) > tolerance) return {};
    return plane;
}

// Whether all of the light is strictly before the plane: a light that reaches through it is hidden by it in part.
bool whole_light_before(const LightFrame& light, const Ground& ground)
{
    const double reach = std::abs(ground.normal.dot(light.u)) * light.half_u + std::abs(ground.normal.dot(light.v)) * light.half_v;
    if (light.directional) return -ground.normal.dot(light.direction) > reach;
    return ground.normal.dot(light.origin) - ground.offset > reach;
}

// How far a pixel's point lies behind is `constant` + depth x (`slope` + `slope_x` x column) in each row; orthographic: without the depth in the slopes.
bool shows_behind(const Ground& ground, const DepthMap& depth, const Camera& camera)
{
    const auto height_at = [&](double x, double y, double z) {
        return ground.offset - ground.normal.dot(world_point(camera, depth.width, depth.height, x, y, z));
    };
    std::size_t there = 0, near = 0, far = 0;
    for (int y = 0; y < depth.height; ++y) {
        const double row = y + .5, at_camera = height_at(.5, row, 0), at_one = height_at(.5, row, 1);
        const auto slope = static_cast<float>(at_one - at_camera), constant = static_cast<float>(at_camera);
        const double step = camera.orthographic ? height_at(1.5, row, 0) - at_camera : height_at(1.5, row, 1) - at_one;
        const auto across = static_cast<float>(camera.orthographic ? step : 0), spread = static_cast<float>(camera.orthographic ? 0 : step);
        const float* z = &depth.depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(depth.width)];
        for (int x = 0; x < depth.width; ++x) {
            const auto column = static_cast<float>(x);
            const float behind = constant + across * column + z[x] * (slope + spread * column);
            const bool seen = z[x] > 0 && z[x] < std::numeric_limits<float>::infinity();
            there += seen;
            near += seen && behind > .03f * z[x];
            far += seen && behind > .1f * z[x];
        }
    }
    return far > 0 || near * 500 > there;
}

bool all_before(const Object& object, const Ground& ground)
{
    const auto before = [&](const Vec3& p) { return ground.normal.dot(p) - ground.offset >= -1e-5 * (1 + p.length()); };
    for (const Imath::V3f& p : object.mesh.positions)
        if (!before(Vec3(p))) return false;
    return !object.seen || !shows_behind(ground, object.seen->depth, object.seen->camera);
}

} // namespace

std::vector<Ground> grounds_of(const LightFrame& light, const std::vector<Object>& objects)
{
    std::vector<Ground> grounds;
    for (std::size_t i = 0; i < objects.size(); ++i) {
        if (objects[i].seen) continue;
        const auto plane = plane_of(objects[i].mesh);
        if (!plane) continue;
        const double height = light.directional ? -plane->normal.dot(light.direction) : plane->normal.dot(light.origin) - plane->offset;
        const Ground ground = height > 0 ? Ground{i, plane->normal, plane->offset} : Ground{i, -plane->normal, -plane->offset};
        if (!whole_light_before(light, ground)) continue;
        const bool lowest = std::all_of(objects.begin(), objects.end(), [&](const Object& other) { return &other == &objects[i] || all_before(other, ground); });
        if (lowest) grounds.push_back(ground);
    }
    return grounds;
}

bool shows_behind(const std::vector<Ground>& grounds, const DepthMap& depth, const Camera& camera)
{
    return std::any_of(grounds.begin(), grounds.end(), [&](const Ground& ground) { return shows_behind(ground, depth, camera); });
}

} // namespace penumbra
