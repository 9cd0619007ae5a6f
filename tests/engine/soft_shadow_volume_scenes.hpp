// Scenes that the tests of soft shadow volumes through the engine share, and larger casters.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include <penumbra/metrics.hpp>

#include "support/casters.hpp"
#include "support/maps.hpp"

namespace penumbra::test::wedges {

constexpr double pi = std::numbers::pi;

inline const Engine& engine()
{
    static const Engine shared;
    return shared;
}

// A surface over a grid of n x m that closes upon itself both ways.
inline TriangleMesh closed_grid(std::uint32_t n, std::uint32_t m, const std::function<Vec3(double, double)>& place)
{
    std::vector<Vec3> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < m; ++j) {
            points.push_back(place(2 * pi * i / n, 2 * pi * j / m));
            const std::uint32_t a = i * m + j, b = (i + 1) % n * m + j, c = (i + 1) % n * m + (j + 1) % m, d = i * m + (j + 1) % m;
            triangles.push_back({a, b, c});
            triangles.push_back({a, c, d});
        }
    return mesh_of(points, triangles);
}

// A (2, 3) torus knot about as large as the unit sphere, around `center`.
inline TriangleMesh torus_knot(const Vec3& center)
{
    const auto along = [](double s) {
        return Vec3((2 + std::cos(3 * s)) * std::cos(2 * s), (2 + std::cos(3 * s)) * std::sin(2 * s), std::sin(3 * s)) / 3;
    };
    return closed_grid(192, 24, [&](double s, double t) {
        const Vec3 tangent = (along(s + 1e-4) - along(s - 1e-4)).normalized();
        const Vec3 side = tangent.cross(along(s)).normalized();
        return center + along(s) + (side * std::cos(t) + tangent.cross(side) * std::sin(t)) * 0.15;
    });
}

inline Object casting(TriangleMesh mesh) { return {.name = "caster", .mesh = std::move(mesh), .casts = true, .receives = false}; }

inline Scene scene_of(const Light& light, const std::vector<TriangleMesh>& casters, const Receivers& r)
{
    Scene scene{.light = light, .objects = {}, .occluders = {}, .receivers = r, .technique = {}, .output = {}, .warnings = {}};
    for (const TriangleMesh& mesh : casters) scene.objects.push_back(casting(mesh));
    return scene;
}

inline Receivers floor_at(float z, int size = 64, double tangent = 1) { return receivers(light_view(tangent), flat(size, size, z)); }

inline Image mask_of(const Scene& scene, const Technique& technique = SoftShadowVolume{})
{
    return engine().mask(scene, technique).visibility;
}

// 34 roundings of an edge's coordinates, M of them over the least W, as tests/oracle/soft_shadow_volume_oracle.hpp derives it: here edges
// end within 20 half extents of the light, their W is 1/2, and there are 6 for each sheet of two triangles.
inline double bound_of(std::size_t sheets, double coordinates = 20)
{
    return static_cast<double>(sheets) * 6 * 34 * (coordinates / 0.5 + 1) * 0x1p-24;
}

inline Metrics against_rays(const Scene& scene, const SoftShadowVolume& settings = {})
{
    return compare(mask_of(scene, settings), mask_of(scene, RayTraced{.samples = 4096}));
}

inline void record(const std::string& name, const Metrics& m)
{
    std::printf("[  MEASURE ] %s: mae %.5f rmse %.5f bias %+.5f p99 %.4f max %.4f (shadow)\n", name.c_str(), m.mae_shadow, m.rmse_shadow,
                m.bias_shadow, m.p99_shadow, m.max);
}

// What 4096 stratified rays are themselves off by: 0.0015 (beyond 1024 rays RMSE is 0.0015 to 0.0034, and halves with four times as many).
constexpr double noise = 0.0015;

// A ball of rings between two poles.
inline TriangleMesh ball(const Vec3& center, double radius, std::uint32_t rings, std::uint32_t around)
{
    std::vector<Vec3> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::uint32_t i = 0; i <= rings; ++i)
        for (std::uint32_t j = 0; j < around; ++j) {
            const double u = pi * i / rings, v = 2 * pi * j / around, r = i == 0 || i == rings ? 0 : std::sin(u);
            points.push_back(center + Vec3(r * std::cos(v), r * std::sin(v), -std::cos(u)) * radius);
            if (i == rings) continue;
            const std::uint32_t a = i * around + j, b = i * around + (j + 1) % around;
            triangles.push_back({a, b, b + around});
            triangles.push_back({a, b + around, a + around});
        }
    return mesh_of(points, triangles);
}

} // namespace penumbra::test::wedges
