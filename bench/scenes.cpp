#include "scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/mesh_io.hpp"
#include "scene/camera.hpp"

namespace penumbra::bench {
namespace {

TriangleMesh quad(const Vec3& center, const Vec3& half_u, const Vec3& half_v)
{
    TriangleMesh mesh;
    for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
        mesh.positions.emplace_back(center + half_u * static_cast<double>(a) + half_v * static_cast<double>(b));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

// The mesh in a cube of side 2 around the origin.
TriangleMesh fitted(TriangleMesh mesh)
{
    const Imath::Box3d box = bounds(mesh);
    const Vec3 size = box.size();
    const double scale = 2 / std::max({size.x, size.y, size.z});
    for (auto& p : mesh.positions) p = Imath::V3f((Vec3(p) - box.center()) * scale);
    return mesh;
}

const TriangleMesh& model(Occluder occluder)
{
    static const TriangleMesh square = quad({0, 0, 0}, {1, 0, 0}, {0, 0, -1});
    if (occluder == Occluder::square) return square;
    static const TriangleMesh bunny = fitted(read_mesh("/usr/share/glmark2/models/bunny.obj", "bunny"));
    static const TriangleMesh horse = fitted(read_mesh("/usr/share/glmark2/models/horse.3ds", "horse"));
    return occluder == Occluder::bunny ? bunny : horse;
}

} // namespace

const char* name(Occluder occluder) { return occluder == Occluder::square ? "square" : occluder == Occluder::bunny ? "bunny" : "horse"; }

Scene paper_scene(Occluder occluder, const SceneOptions& options) { return paper_scene(name(occluder), model(occluder), options); }

Scene paper_scene(const std::string& name, TriangleMesh mesh, const SceneOptions& options)
{
    Scene scene;
    const double half = options.light_side / 2;
    scene.light = RectangleLight{.center = {0, 8, 0}, .half_u = {half, 0, 0}, .half_v = {0, 0, -half}, .emission = {}};

    for (auto& p : mesh.positions) p += Imath::V3f(Vec3(options.sideways, options.height, 0));
    scene.objects.push_back({.name = name, .mesh = std::move(mesh), .casts = true, .receives = false});
    scene.objects.push_back({.name = "plane", .mesh = quad({0, 0, 0}, {4, 0, 0}, {0, 0, -4}), .casts = false, .receives = true});

    const LightCamera view{.tan_half_fov = Vec2(0.5, 0.5), .half_extent = {}, .center = {}};
    scene.occluders.camera = view;
    scene.occluders.width = scene.occluders.height = options.occluder_resolution;
    scene.receivers.camera = view;
    scene.receivers.width = scene.receivers.height = options.receiver_resolution;
    return scene;
}

TriangleMesh fitted_mesh(const std::string& path) { return fitted(read_mesh(path, path)); }

TriangleMesh bumpy_ball(std::uint32_t rings)
{
    const std::uint32_t around = 2 * rings;
    TriangleMesh mesh;
    const auto add = [&](double u, double v) {
        const double radius = 1 + 0.1 * std::sin(8 * u) * std::cos(8 * v);
        mesh.positions.emplace_back(Vec3(std::sin(u) * std::cos(v), std::cos(u), std::sin(u) * std::sin(v)) * radius);
    };
    add(0, 0);
    for (std::uint32_t i = 1; i < rings; ++i)
        for (std::uint32_t k = 0; k < around; ++k) add(std::numbers::pi * i / rings, 2 * std::numbers::pi * k / around);
    add(std::numbers::pi, 0);

    // Rings of quads between two caps; outside is counter-clockwise.
    const std::uint32_t last = (rings - 1) * around + 1;
    const auto at = [&](std::uint32_t ring, std::uint32_t k) { return 1 + (ring - 1) * around + k % around; };
    for (std::uint32_t k = 0; k < around; ++k) {
        mesh.triangles.push_back({0, at(1, k + 1), at(1, k)});
        for (std::uint32_t i = 1; i + 1 < rings; ++i) {
            mesh.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k + 1)});
            mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i + 1, k)});
        }
        mesh.triangles.push_back({last, at(rings - 1, k), at(rings - 1, k + 1)});
    }
    return mesh;
}

} // namespace penumbra::bench
