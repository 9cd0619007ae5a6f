// smoothie: Table 1 of its paper beside shadow maps of the same run; its width, its sources of silhouettes, the light's size.
#include "cases.hpp"
#include "rows.hpp"
#include "scenes.hpp"
#include "silhouette/silhouette.hpp"

namespace penumbra::bench {
namespace {

struct Model {
    std::string name;
    TriangleMesh mesh;
};

// Balls of 1.8, 7.9 and 31 thousand triangles and the bunny (69,666), with how many edges the light's centre sees as silhouette.
std::vector<Model> models()
{
    std::vector<Model> list;
    for (const std::uint32_t rings : {22U, 45U, 89U}) list.push_back({"ball", bumpy_ball(rings)});
    list.push_back({"bunny", fitted_mesh("/usr/share/glmark2/models/bunny.obj")});
    for (Model& model : list) {
        const Scene scene = paper_scene(model.name, model.mesh, {});
        const TriangleMesh* const meshes[] = {&scene.objects.front().mesh};
        const std::size_t edges = silhouette_of(Topology(meshes), std::get<RectangleLight>(scene.light).center).edges.size();
        model.name +=
            " of " + std::to_string(model.mesh.triangles.size()) + " triangles and " + std::to_string(edges) + " silhouette edges";
    }
    return list;
}

constexpr double small_light = 0.2;

} // namespace

void smoothies(const Engine& engine)
{
    for (const Model& model : models()) {
        const auto scene_of = [&](int texels) {
            return paper_scene(model.name, model.mesh, {.light_side = small_light, .occluder_resolution = texels});
        };
        const Image reference = reference_of(engine, scene_of(256), 1024);
        for (const int texels : {256, 512, 1024}) {
            const Scene scene = scene_of(texels);
            const auto row = [&](const Technique& technique) { emit(engine, scene, technique, reference, "smoothies", texels, 9); };
            row(ShadowMap{});
            row(ShadowMap{.filter = ShadowFilter::bicubic});
            row(Smoothie{.two_sided = false});
            row(Smoothie{.two_sided = true});
            row(Smoothie{.silhouettes = SilhouetteSource::image, .two_sided = false});
        }
        for (const double t : {0.02, 0.05, 0.1, 0.2})
            emit(engine, scene_of(1024), Smoothie{.t_from = SmoothieWidth::t, .t = t, .two_sided = false}, reference, "smoothie_width", t, 9);
    }
}

void smoothie_light_size(const Engine& engine)
{
    for (const Occluder occluder : {Occluder::square, Occluder::bunny})
        for (const double side : {0.01, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0}) {
            const Scene scene = paper_scene(occluder, {.light_side = side, .occluder_resolution = 512});
            const Image reference = reference_of(engine, scene, 1024);
            const auto row = [&](const Technique& technique) { emit(engine, scene, technique, reference, "smoothie_light_size", side, 5); };
            row(ShadowMap{});
            row(Smoothie{.two_sided = false});
            row(Smoothie{.two_sided = true});
            row(SoftShadowMap{.sides = occluder == Occluder::square ? Sides::front : Sides::both});
        }
}

} // namespace penumbra::bench
