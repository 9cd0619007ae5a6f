// Casters and lights that the tests of soft shadow volumes share, by light-space coordinates: of the light of maps.hpp those are (x, y, -z)
// of the world.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra::test {

inline Vec3 world_of(double x, double y, double z) { return {x, y, -z}; }

inline SphereLight sphere_light(double radius)
{
    return {.center = {0, 0, 0}, .radius = radius, .direction = {0, 0, -1}, .up = Vec3(0, 1, 0)};
}

inline TriangleMesh mesh_of(const std::vector<Vec3>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles)
{
    TriangleMesh mesh;
    for (const Vec3& p : points) mesh.positions.emplace_back(world_of(p.x, p.y, p.z));
    mesh.triangles = triangles;
    return mesh;
}

// Rectangles: parallel to the light, and with four corners of their own.
inline TriangleMesh sheet(double x0, double x1, double y0, double y1, double z)
{
    return mesh_of({{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}}, {{0, 1, 2}, {0, 2, 3}});
}
inline TriangleMesh sheet(const std::array<Vec3, 4>& c) { return mesh_of({c[0], c[1], c[2], c[3]}, {{0, 1, 2}, {0, 2, 3}}); }

inline TriangleMesh closed_box(const Vec3& low, const Vec3& high)
{
    std::vector<Vec3> points;
    for (int i = 0; i < 8; ++i)
        points.emplace_back((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y, (i & 4) != 0 ? high.z : low.z);
    return mesh_of(points, {{0, 2, 3},
                            {0, 3, 1},
                            {4, 5, 7},
                            {4, 7, 6},
                            {0, 1, 5},
                            {0, 5, 4},
                            {2, 6, 7},
                            {2, 7, 3},
                            {0, 4, 6},
                            {0, 6, 2},
                            {1, 3, 7},
                            {1, 7, 5}});
}

} // namespace penumbra::test
