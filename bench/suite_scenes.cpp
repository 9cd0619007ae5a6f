#include "suite_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "scene/camera.hpp"
#include "scenes.hpp"

namespace penumbra::bench {
namespace {

void append(TriangleMesh& mesh, const TriangleMesh& more, const Vec3& by)
{
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const auto& p : more.positions) mesh.positions.emplace_back(Vec3(p) + by);
    for (const auto& t : more.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

TriangleMesh quad(const Vec3& half_u, const Vec3& half_v)
{
    TriangleMesh mesh;
    for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) mesh.positions.emplace_back(half_u * static_cast<double>(a) + half_v * static_cast<double>(b));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

TriangleMesh box(const Vec3& half)
{
    TriangleMesh mesh;
    for (const int axis : {0, 1, 2})
        for (const double side : {-1.0, 1.0}) {
            Vec3 n(0, 0, 0), u(0, 0, 0), v(0, 0, 0);
            n[axis] = side * half[axis];
            u[(axis + 1) % 3] = half[(axis + 1) % 3];
            v[(axis + 2) % 3] = side * half[(axis + 2) % 3];
            append(mesh, quad(u, v), n);
        }
    return mesh;
}

TriangleMesh scaled(TriangleMesh mesh, double by)
{
    for (auto& p : mesh.positions) p *= static_cast<float>(by);
    return mesh;
}

TriangleMesh balls()
{
    TriangleMesh mesh;
    const TriangleMesh ball = scaled(bumpy_ball(24), 0.22);
    for (const int x : {-1, 0, 1})
        for (const int y : {-1, 0, 1})
            for (const int z : {-1, 0, 1}) append(mesh, ball, Vec3(0.74 * x + 0.06 * y, 0.74 * y, 0.74 * z - 0.05 * x));
    return mesh;
}

TriangleMesh tilted_sheet()
{
    const double c = std::cos(0.6), s = std::sin(0.6);
    return quad({c, s, 0.2}, {0.1, 0, -1});
}

TriangleMesh plates()
{
    TriangleMesh mesh = quad({1, 0, 0}, {0, 0, -1});
    TriangleMesh lower = quad({0.8, 0, 0.3}, {0.3, 0, -0.8});
    append(mesh, lower, {0.35, -1.6, 0.2});
    return mesh;
}

TriangleMesh fence()
{
    TriangleMesh mesh;
    for (int i = -8; i <= 8; ++i) append(mesh, box({0.035, 0.02, 1.1}), {0.13 * i, 0, 0});
    append(mesh, box({1.15, 0.02, 0.05}), {0, 0.04, 0.9});
    append(mesh, box({1.15, 0.02, 0.05}), {0, 0.04, -0.9});
    return mesh;
}

Vec3 unit(std::mt19937& random)
{
    std::uniform_real_distribution<double> any(-1, 1);
    for (;;) {
        const Vec3 v(any(random), any(random), any(random));
        const double length = v.length();
        if (length > 0.1 && length < 1) return v / length;
    }
}

// Leaves: 3000 open squares turned anyhow in a ball.
TriangleMesh foliage()
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> share(0, 1);
    TriangleMesh mesh;
    for (int i = 0; i < 3000; ++i) {
        const Vec3 n = unit(random), u = n.cross(unit(random)).normalized(), v = n.cross(u);
        append(mesh, quad(u * 0.04, v * 0.025), unit(random) * std::cbrt(share(random)));
    }
    return mesh;
}

// A toy of open parts: half tubes and plates, turned anyhow.
TriangleMesh open_parts()
{
    std::mt19937 random(11);
    std::uniform_real_distribution<double> share(0, 1);
    TriangleMesh mesh;
    for (int i = 0; i < 60; ++i) {
        const Vec3 axis = unit(random), u = axis.cross(unit(random)).normalized(), v = axis.cross(u);
        const double radius = 0.05 + 0.15 * share(random), length = 0.1 + 0.3 * share(random);
        TriangleMesh part;
        constexpr std::uint32_t around = 12;
        for (std::uint32_t k = 0; k <= around; ++k) {
            const double angle = std::numbers::pi * k / around;
            const Vec3 rim = u * (radius * std::cos(angle)) + v * (radius * std::sin(angle));
            part.positions.emplace_back(rim - axis * length);
            part.positions.emplace_back(rim + axis * length);
        }
        for (std::uint32_t k = 0; k < around; ++k) {
            part.triangles.push_back({2 * k, 2 * k + 2, 2 * k + 3});
            part.triangles.push_back({2 * k, 2 * k + 3, 2 * k + 1});
        }
        append(mesh, part, unit(random) * (0.9 * std::cbrt(share(random))));
    }
    return mesh;
}

// The mesh moved so that it stands on the plane when its middle is `height` above it; how high that is.
double standing_height(const TriangleMesh& mesh) { return -bounds(mesh).min.y; }

} // namespace

std::vector<SuiteScene> suite_scenes(int texels, int receivers)
{
    const TriangleMesh bunny = fitted_mesh("/usr/share/glmark2/models/bunny.obj"), horse = fitted_mesh("/usr/share/glmark2/models/horse.3ds");
    std::vector<SuiteScene> scenes;
    const auto add = [&](const char* name, TriangleMesh mesh, double light, double height) {
        scenes.push_back({name, paper_scene(name, std::move(mesh), {.light_side = light, .height = height, .occluder_resolution = texels, .receiver_resolution = receivers})});
    };
    add("bunny", bunny, 1, 3);
    add("bunny_standing", bunny, 0.3, standing_height(bunny));
    add("horse", horse, 1, 3);
    add("balls", balls(), 1, 3);
    add("tilted_sheet", tilted_sheet(), 1.5, 3);
    add("plates", plates(), 1, 4);
    add("fence", fence(), 1, 3);
    add("foliage", foliage(), 0.5, 3);
    add("open_parts", open_parts(), 1, 3);
    add("wide_light", bunny, 5, 3);

    // On itself and on what it stands on, seen from beside.
    add("bunny_itself", bunny, 1, standing_height(bunny));
    Scene& itself = scenes.back().scene;
    itself.objects.front().receives = true;
    itself.receivers.camera = PinholeCamera{.frame = {.origin = {0, 3.5, 4.5}, .x = {1, 0, 0}, .y = {0, 0.8192, -0.5735}, .z = {0, 0.5735, 0.8192}}, .tan_half_fov = {0.4, 0.4}, .shift = {}};
    return scenes;
}

} // namespace penumbra::bench
