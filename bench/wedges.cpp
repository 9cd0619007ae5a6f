// soft_shadow_volume: error and cost of its settings beside shadow rays of the same run.
#include "cases.hpp"
#include "rows.hpp"
#include "scenes.hpp"
#include "silhouette/silhouette.hpp"

namespace penumbra::bench {
namespace {

void rays(const Engine& engine, const Scene& scene, const Image& reference, const char* bench)
{
    for (const bool adaptive : {false, true})
        for (const int samples : {4, 16, 64, 256, 1024}) {
            const RayTraced settings{.samples = samples, .adaptive = adaptive, .first_samples = 16, .seed = 1};
            if (!adaptive || samples > 16) emit(engine, scene, settings, reference, bench, samples, 3);
        }
}

const std::pair<const char*, std::string> models[] = {{"bunny", "/usr/share/glmark2/models/bunny.obj"},
                                                      {"horse", "/usr/share/glmark2/models/horse.3ds"},
                                                      {"wuson", "/usr/share/assimp/models/PLY/Wuson.ply"},
                                                      {"spider", "/usr/share/assimp/models/OBJ/spider.obj"},
                                                      {"engine", "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"}};

RayTraced adaptive(int samples) { return {.samples = samples, .adaptive = true, .first_samples = 16, .seed = 1}; }

// Edges of the silhouette that the light's centre sees.
std::size_t silhouette_edges(const TriangleMesh& mesh, const Vec3& from)
{
    const TriangleMesh* const list[] = {&mesh};
    return silhouette_of(Topology(list), from).edges.size();
}

// The receivers of a scene as a camera beside the light sees them.
Scene from_aside(Scene scene)
{
    const double s = 0.6, c = 0.8; // looks 53 degrees down, towards -z
    scene.receivers.camera =
        PinholeCamera{.frame = {.origin = {0, 8, 6}, .x = {1, 0, 0}, .y = {0, s, -c}, .z = {0, c, s}}, .tan_half_fov = {0.45, 0.45}};
    return scene;
}

} // namespace

void wedges(const Engine& engine)
{
    const Scene scene = paper_scene(Occluder::bunny, {});
    const Image reference = reference_of(engine, scene, 4096);
    for (const Overlap overlap : {Overlap::sum, Overlap::max, Overlap::half_min, Overlap::product})
        emit(engine, scene, SoftShadowVolume{.overlap = overlap}, reference, "wedges", 1, 15);
    for (const int splits : {2, 3, 4, 8}) emit(engine, scene, SoftShadowVolume{.light_splits = splits}, reference, "wedges", splits, 9);
    rays(engine, scene, reference, "wedges");

    // The same light as a sphere of its inscribed circle.
    Scene ball = scene;
    const RectangleLight& rectangle = std::get<RectangleLight>(scene.light);
    ball.light = SphereLight{.center = rectangle.center, .radius = rectangle.half_u.length(), .direction = {0, -1, 0}, .up = {}};
    const Image ball_reference = reference_of(engine, ball, 4096);
    for (const Coverage coverage : {Coverage::analytic, Coverage::linear})
        emit(engine, ball, SoftShadowVolume{.coverage = coverage}, ball_reference, "wedges_sphere", 1, 9);
    rays(engine, ball, ball_reference, "wedges_sphere");
}

void wedge_culling(const Engine& engine)
{
    const Scene scene = from_aside(paper_scene(Occluder::bunny, {}));
    const Image reference = reference_of(engine, scene, 256);
    for (const WedgeCulling culling : {WedgeCulling::tight, WedgeCulling::loose, WedgeCulling::far_depth, WedgeCulling::none})
        emit(engine, scene, SoftShadowVolume{.culling = culling}, reference, "wedge_culling", static_cast<double>(culling),
             culling == WedgeCulling::none ? 1 : 9);
    for (const double side : {0.01, 0.1, 0.2, 0.5, 1.0, 2.0, 3.0}) {
        const Scene at = paper_scene(Occluder::bunny, {.light_side = side});
        const Image seen = reference_of(engine, at, 1024);
        emit(engine, at, SoftShadowVolume{}, seen, "wedge_light_size", side, 9);
    }
}

void wedge_models(const Engine& engine)
{
    for (const auto& [name, path] : models) {
        const TriangleMesh mesh = fitted_mesh(path);
        const Scene scene = paper_scene(name, mesh, {});
        const Image reference = reference_of(engine, scene, 4096);
        for (const Overlap overlap : {Overlap::sum, Overlap::max})
            for (const int splits : {1, 2, 4})
                emit(engine, scene, SoftShadowVolume{.overlap = overlap, .light_splits = splits}, reference, "wedge_models", splits, 9);
        for (const int texels : {128, 512})
            for (const Sides sides : {Sides::front, Sides::both})
                emit(engine, paper_scene(name, mesh, {.occluder_resolution = texels}), SoftShadowMap{.sides = sides}, reference,
                     "wedge_models", texels, 9);
        emit(engine, scene, RayTraced{.samples = 16, .adaptive = false, .first_samples = 16, .seed = 1}, reference, "wedge_models", 16, 5);
        for (const int samples : {64, 256}) emit(engine, scene, adaptive(samples), reference, "wedge_models", samples, 3);
    }
}

void wedge_silhouettes(const Engine& engine)
{
    const SoftShadowVolume per_receiver{.silhouettes = Silhouettes::per_receiver};
    const auto rows = [&](const Scene& scene, double parameter, const char* bench) {
        const Image reference = reference_of(engine, scene, 4096);
        emit(engine, scene, SoftShadowVolume{}, reference, bench, parameter, 5);
        emit(engine, scene, SoftShadowVolume{.light_splits = 4}, reference, bench, parameter, 5);
        emit(engine, scene, per_receiver, reference, bench, parameter, 5);
        emit(engine, scene, RayTraced{.samples = 1024, .adaptive = true, .first_samples = 16, .seed = 1}, reference, bench, parameter, 3);
    };
    for (const auto& [name, path] : models) rows(paper_scene(name, fitted_mesh(path), {}), 1, "wedge_silhouettes");
    for (const double side : {0.1, 0.3, 3.0}) rows(paper_scene(Occluder::bunny, {.light_side = side}), side, "wedge_silhouettes_light");
    for (const std::uint32_t rings : {22U, 45U, 89U, 179U, 358U}) {
        const TriangleMesh mesh = bumpy_ball(rings);
        const Scene scene = paper_scene("ball", mesh, {});
        emit(engine, scene, per_receiver, reference_of(engine, scene, 1024), "wedge_silhouettes_growth", static_cast<double>(mesh.triangles.size()), 5);
    }
}

void wedge_growth(const Engine& engine)
{
    // Triangles: 1.8, 7.9, 31, 127, 511 thousand.
    for (const std::uint32_t rings : {22U, 45U, 89U, 179U, 358U}) {
        const TriangleMesh mesh = bumpy_ball(rings);
        Scene scene = paper_scene("ball", mesh, {});
        const std::size_t edges = silhouette_edges(scene.objects.front().mesh, std::get<RectangleLight>(scene.light).center);
        scene.objects.front().name = "ball of " + std::to_string(edges) + " silhouette edges";
        const Image reference = reference_of(engine, scene, 1024);
        for (const int splits : {1, 4})
            emit(engine, scene, SoftShadowVolume{.light_splits = splits}, reference, "wedge_growth",
                 static_cast<double>(mesh.triangles.size()), splits == 1 ? 9 : 5);
        emit(engine, scene, adaptive(64), reference, "wedge_growth", static_cast<double>(mesh.triangles.size()), 3);
    }
    for (const int side : {128, 256, 512, 1024, 2048}) {
        const Scene scene = paper_scene(Occluder::bunny, {.receiver_resolution = side});
        const Image reference = reference_of(engine, scene, 256);
        emit(engine, scene, SoftShadowVolume{}, reference, "wedge_receivers", side, 5);
        emit(engine, scene, adaptive(64), reference, "wedge_receivers", side, 3);
    }
}

} // namespace penumbra::bench
