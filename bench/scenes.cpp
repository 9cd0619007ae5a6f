#include "scenes.hpp"

#include <algorithm>

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

Scene paper_scene(Occluder occluder, const SceneOptions& options)
{
    Scene scene;
    const double half = options.light_side / 2;
    scene.light = RectangleLight{.center = {0, 8, 0}, .half_u = {half, 0, 0}, .half_v = {0, 0, -half}, .emission = {}};

    TriangleMesh mesh = model(occluder);
    for (auto& p : mesh.positions) p += Imath::V3f(Vec3(options.sideways, options.height, 0));
    scene.objects.push_back({.name = name(occluder), .mesh = std::move(mesh), .casts = true, .receives = false});
    scene.objects.push_back({.name = "plane", .mesh = quad({0, 0, 0}, {4, 0, 0}, {0, 0, -4}), .casts = false, .receives = true});

    const LightCamera view{.tan_half_fov = Vec2(0.5, 0.5), .half_extent = {}, .center = {}};
    scene.occluders.camera = view;
    scene.occluders.width = scene.occluders.height = options.occluder_resolution;
    scene.receivers.camera = view;
    scene.receivers.width = scene.receivers.height = options.receiver_resolution;
    return scene;
}

} // namespace penumbra::bench
