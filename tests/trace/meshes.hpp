// Meshes, lights and maps that the tests of this room share.
#pragma once

#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "scene/camera.hpp"
#include "scene/light_space.hpp"
#include "trace/tracer.hpp"

namespace penumbra {

// A quad of two triangles; seen from outside along -cross(half_u, half_v).
inline TriangleMesh quad(const Vec3& center, const Vec3& half_u, const Vec3& half_v)
{
    TriangleMesh mesh;
    mesh.positions = {Imath::V3f(center - half_u - half_v), Imath::V3f(center + half_u - half_v), Imath::V3f(center + half_u + half_v),
                      Imath::V3f(center - half_u + half_v)};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

// A closed box of 12 triangles, counter-clockwise seen from outside.
inline TriangleMesh box(const Vec3& low, const Vec3& high)
{
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.positions.push_back(Imath::V3f(Vec3(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z)));
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}

// A sphere of 8 * 4^levels triangles (an octahedron, subdivided), counter-clockwise seen from outside, convex up to float32.
inline TriangleMesh sphere(const Vec3& center, double radius, int levels)
{
    std::vector<Vec3> p = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    std::vector<std::array<std::uint32_t, 3>> t = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [at, fresh] = middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(p.size()));
            if (fresh) p.push_back((p[a] + p[b]).normalized());
            return at->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : t) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        t = std::move(finer);
    }
    TriangleMesh mesh;
    mesh.triangles = t;
    for (const Vec3& v : p) mesh.positions.push_back(Imath::V3f(center + v * radius));
    return mesh;
}

inline TriangleMesh scaled(TriangleMesh mesh, double scale)
{
    for (Imath::V3f& p : mesh.positions) p = Imath::V3f(Vec3(p) * scale);
    return mesh;
}

inline Tracer tracer_of(const std::vector<TriangleMesh>& meshes, const Vec3& origin = Vec3(0, 0, 0))
{
    std::vector<const TriangleMesh*> pointers;
    for (const TriangleMesh& mesh : meshes) pointers.push_back(&mesh);
    return Tracer(pointers, origin);
}

// A rectangle light at the world's origin that shines down: light space x, y, z are world x, -z, -y.
inline RectangleLight rectangle_light(double half_u, double half_v)
{
    return {.center = {0, 0, 0}, .half_u = {half_u, 0, 0}, .half_v = {0, 0, -half_v}, .emission = {}};
}

inline Vec3 world_from_light(double x, double y, double z) { return {x, -z, -y}; }

// A quad parallel to that light, [x0, x1] x [y0, y1] at light-space depth z.
inline TriangleMesh parallel_quad(double x0, double x1, double y0, double y1, double z)
{
    return quad(world_from_light((x0 + x1) / 2, (y0 + y1) / 2, z), Vec3((x1 - x0) / 2, 0, 0), Vec3(0, 0, -(y1 - y0) / 2));
}

inline Camera camera_of(const Light& light, double tangent, const Vec3& center = Vec3(0, 0, 0))
{
    return light_camera(light_frame(light), Vec2(tangent, tangent), center);
}

// A camera at `eye` that looks at `target`.
inline Camera camera_at(const Vec3& eye, const Vec3& target, double tangent)
{
    const Vec3 z = (eye - target).normalized();
    const Vec3 x = (std::abs(z.y) < 0.9 ? Vec3(0, 1, 0) : Vec3(0, 0, -1)).cross(z).normalized();
    return {.frame = {.origin = eye, .x = x, .y = z.cross(x), .z = z}, .orthographic = false, .half_extent = {tangent, tangent}};
}

inline DepthMap flat_map(int width, int height, float depth)
{
    return {width, height, std::vector<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), depth)};
}

// The share of a unit disc beyond a line at signed distance t from its centre.
inline double disc_beyond(double t)
{
    if (t >= 1) return 0;
    if (t <= -1) return 1;
    return (std::acos(t) - t * std::sqrt(1 - t * t)) / std::numbers::pi;
}

} // namespace penumbra
