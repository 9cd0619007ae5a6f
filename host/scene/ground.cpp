#include "scene/ground.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "scene/camera.hpp"

namespace penumbra {
namespace {

// How far a point may lie from a plane and still be in it.
double tolerance_at(const Vec3& p) { return 1e-5 * (1 + p.length()); }

// What lies furthest each way of all objects: a plane with some of it on either side has not all objects on one.
class Extremes {
public:
    explicit Extremes(const std::vector<Object>& objects)
    {
        std::array<double, 2 * ways.size()> furthest;
        furthest.fill(-std::numeric_limits<double>::infinity());
        for (const Object& object : objects)
            for (const Imath::V3f& position : object.mesh.positions) {
                const Vec3 p(position);
                for (std::size_t i = 0; i < furthest.size(); ++i) {
                    const auto& way = ways[i / 2];
                    const double along = (way[0] * p.x + way[1] * p.y + way[2] * p.z) * (i % 2 ? -1 : 1);
                    if (along > furthest[i]) {
                        furthest[i] = along;
                        points_[i] = p;
                    }
                }
            }
    }

    bool on_one_side(const Vec3& normal, double offset) const
    {
        bool before = false, behind = false;
        for (const Vec3& p : points_) {
            const double height = normal.dot(p) - offset, tolerance = tolerance_at(p);
            before |= height > tolerance;
            behind |= height < -tolerance;
            if (before && behind) return false;
        }
        return true;
    }

private:
    // Along the axes, and along a cube's diagonals.
    static constexpr std::array<std::array<double, 3>, 7> ways{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {1, -1, -1}}};
    std::array<Vec3, 2 * ways.size()> points_{};
};

// Planes of a mesh's triangles with what is furthest on one side, those of most area first. A few are enough: what is not found to be ground is
// held in the view.
constexpr std::size_t most_planes = 8;
std::vector<Ground> planes_of(const TriangleMesh& mesh, const Extremes& extremes)
{
    struct Plane {
        double area = 0, largest = 0;
        Ground ground{};
    };
    // Triangles of one plane fall into one bin, or into two beside each other.
    const Imath::Box3d box = bounds(mesh);
    const double size = std::max((box.max - box.min).length(), 1e-30);
    std::map<std::array<long, 4>, Plane> bins;
    for (const auto& [a, b, c] : mesh.triangles) {
        const Vec3 at(mesh.positions[a]), cross = (Vec3(mesh.positions[b]) - at).cross(Vec3(mesh.positions[c]) - at);
        const double area = cross.length();
        if (!(area > 0) || !std::isfinite(area)) continue;
        Vec3 normal = cross / area;
        if (!extremes.on_one_side(normal, normal.dot(at))) continue;
        // Either way round.
        const double main = std::abs(normal.x) > .5 ? normal.x : std::abs(normal.y) > .5 ? normal.y : normal.z;
        if (main < 0) normal = -normal;
        const double offset = normal.dot(at);
        Plane& plane = bins[{std::lround(normal.x * 1024), std::lround(normal.y * 1024), std::lround(normal.z * 1024), std::lround(offset / size * 1024)}];
        plane.area += area;
        if (area > plane.largest) plane = {plane.area, area, {normal, offset}};
    }
    std::vector<Plane> sorted;
    sorted.reserve(bins.size());
    for (const auto& [key, plane] : bins) sorted.push_back(plane);
    std::stable_sort(sorted.begin(), sorted.end(), [](const Plane& a, const Plane& b) { return a.area > b.area; });
    std::vector<Ground> planes;
    for (std::size_t i = 0; i < std::min(sorted.size(), most_planes); ++i) planes.push_back(sorted[i].ground);
    return planes;
}

// Whether all of the light is strictly before the plane: a light that reaches through it is hidden by it in part.
bool whole_light_before(const LightFrame& light, const Ground& ground)
{
    const double reach = std::abs(ground.normal.dot(light.u)) * light.half_u + std::abs(ground.normal.dot(light.v)) * light.half_v;
    if (light.directional) return -ground.normal.dot(light.direction) > reach;
    return ground.normal.dot(light.origin) - ground.offset > reach;
}

// Whether some of the light goes through the ground's box on its way to a point that lies behind.
bool casts_on(const Ground& ground, const LightFrame& light, const Vec3& p)
{
    if (ground.box.isEmpty()) return true;
    const double behind = ground.offset - ground.normal.dot(p), radius = std::max(light.half_u, light.half_v) * 1.5;
    Vec3 crossing;
    double reach;
    if (light.directional) {
        const double way = behind / std::max(-ground.normal.dot(light.direction), 1e-9);
        crossing = p - light.direction * way;
        reach = radius * way * 2; // tangents of angles, slanted
    } else {
        const double above = ground.normal.dot(light.origin) - ground.offset, part = behind / (behind + above);
        crossing = p + (light.origin - p) * part;
        reach = radius * part;
    }
    reach += tolerance_at(crossing) * 10;
    const Vec3 wide(reach, reach, reach);
    return Imath::Box3d(ground.box.min - wide, ground.box.max + wide).intersects(crossing);
}

// How far a pixel's point lies behind is constant + depth x (slope + spread x column) in each row; orthographic: without the depth in the slopes.
bool shows_behind(const Ground& ground, const LightFrame& light, const DepthMap& depth, const Camera& camera)
{
    const auto point_at = [&](double x, double y, double z) { return world_point(camera, depth.width, depth.height, x, y, z); };
    const auto behind_at = [&](double x, double y, double z) { return ground.offset - ground.normal.dot(point_at(x, y, z)); };
    // How far behind a point of the ground itself may seem to lie: the rounding of binary32 and of its renderer, or the noise that images have or say
    // that they have. What lies further behind receives: were the ground left out, its shadow would be lost there.
    const auto margin = static_cast<float>(depth.from_image ? 4e-3 + 4 * std::max(depth.noise, depth.precision) : 1e-4);
    std::size_t there = 0, behind = 0;
    for (int y = 0; y < depth.height; ++y) {
        const double row = y + .5, at_camera = behind_at(.5, row, 0), at_one = behind_at(.5, row, 1);
        const auto slope = static_cast<float>(at_one - at_camera), constant = static_cast<float>(at_camera);
        const double step = camera.orthographic ? behind_at(1.5, row, 0) - at_camera : behind_at(1.5, row, 1) - at_one;
        const auto across = static_cast<float>(camera.orthographic ? step : 0), spread = static_cast<float>(camera.orthographic ? 0 : step);
        const float* z = &depth.depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(depth.width)];
        for (int x = 0; x < depth.width; ++x) {
            if (!(z[x] > 0 && z[x] < std::numeric_limits<float>::infinity())) continue;
            ++there;
            const auto column = static_cast<float>(x);
            if (constant + across * column + z[x] * (slope + spread * column) > margin * z[x]) behind += casts_on(ground, light, point_at(x + .5, row, z[x]));
        }
    }
    return depth.from_image ? behind * 500 > there : behind > 0;
}

bool all_before(const TriangleMesh& mesh, const Ground& ground)
{
    return std::all_of(mesh.positions.begin(), mesh.positions.end(), [&](const Imath::V3f& at) {
        const Vec3 p(at);
        return ground.normal.dot(p) - ground.offset >= -tolerance_at(p);
    });
}

bool lies_in(const Ground& ground, const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle)
{
    return std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t corner) {
        const Vec3 p(mesh.positions[corner]);
        return std::abs(ground.normal.dot(p) - ground.offset) <= tolerance_at(p);
    });
}

} // namespace

std::vector<Ground> grounds_of(const LightFrame& light, const std::vector<Object>& objects)
{
    std::vector<Ground> grounds;
    const Extremes extremes(objects);
    for (const Object& object : objects)
        for (const Ground& plane : planes_of(object.mesh, extremes)) {
            const double height = light.directional ? -plane.normal.dot(light.direction) : plane.normal.dot(light.origin) - plane.offset;
            Ground ground = height > 0 ? plane : Ground{-plane.normal, -plane.offset};
            if (!whole_light_before(light, ground)) continue;
            if (!std::all_of(objects.begin(), objects.end(), [&](const Object& other) { return all_before(other.mesh, ground); })) continue;
            for (const auto& triangle : object.mesh.triangles)
                if (lies_in(ground, object.mesh, triangle))
                    for (const std::uint32_t corner : triangle) ground.box.extendBy(Vec3(object.mesh.positions[corner]));
            const auto seen_behind = [&](const Object& other) { return other.seen && shows_behind(ground, light, other.seen->depth, other.seen->camera); };
            if (std::none_of(objects.begin(), objects.end(), seen_behind)) grounds.push_back(ground);
        }
    return grounds;
}

bool in_ground(const std::vector<Ground>& grounds, const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle)
{
    return std::any_of(grounds.begin(), grounds.end(), [&](const Ground& ground) { return lies_in(ground, mesh, triangle); });
}

bool in_ground(const std::vector<Ground>& grounds, const TriangleMesh& mesh)
{
    return !grounds.empty() && std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& triangle) { return in_ground(grounds, mesh, triangle); });
}

bool shows_behind(const std::vector<Ground>& grounds, const LightFrame& light, const DepthMap& depth, const Camera& camera)
{
    return std::any_of(grounds.begin(), grounds.end(), [&](const Ground& ground) { return shows_behind(ground, light, depth, camera); });
}

} // namespace penumbra
