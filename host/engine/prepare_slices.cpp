#include "engine/depth_sources.hpp"
#include "engine/geometry.hpp"
#include "engine/prepare.hpp"
#include "engine/state.hpp"
#include "silhouette/silhouette.hpp"

namespace penumbra {
namespace {

// What the maps show as triangles: of both sides of the solid, and of further layers.
std::vector<TriangleMesh> surfaces_of(const Occluders& occluders, const Camera& camera)
{
    std::vector<TriangleMesh> meshes{mesh_of_texels(*occluders.front, camera)};
    if (occluders.back) meshes.push_back(mesh_of_texels(*occluders.back, camera));
    for (const DepthMap& layer : occluders.layers) meshes.push_back(mesh_of_texels(layer, camera));
    return meshes;
}

void check_maps(const Occluders& given)
{
    check_size(*given.front, given.width, given.height, "occluders.depth.front");
    if (given.back) check_size(*given.back, given.width, given.height, "occluders.depth.back");
    for (std::size_t i = 0; i < given.layers.size(); ++i)
        check_size(given.layers[i], given.width, given.height, "occluders.depth.layers[" + std::to_string(i) + "]");
}

} // namespace

std::shared_ptr<Prepared::State> prepare_slices(std::shared_ptr<Prepared::State> state, const Occluders& given, const Geometry& geometry,
                                                const OcclusionTexture& settings)
{
    const Light& light = state->light;
    const bool objects = casts_or_shown(geometry, given, "occlusion_texture");
    state->covered = true;

    std::vector<TriangleMesh> surfaces;
    std::vector<const TriangleMesh*> meshes;
    Camera camera;
    if (objects) {
        for (const Object& object : geometry.objects())
            if (object.casts) meshes.push_back(&object.mesh);
    } else {
        check_maps(given);
        camera = occluder_camera(light, given.camera, {}, given.width, given.height);
        const Stopwatch watch;
        surfaces = surfaces_of(given, camera);
        for (const TriangleMesh& mesh : surfaces) meshes.push_back(&mesh);
        state->stages.push_back({"surfaces of depth maps", watch.ms(), 0, 0});
    }

    opencl::Work work(state->context);
    const bool solid = !objects && given.back;
    const SolidMaps maps{.front = solid ? *given.front : DepthMap{}, .back = solid ? *given.back : DepthMap{}, .camera = camera};
    PreparedOcclusionTexture prepared = prepare_occlusion_texture(work, light, meshes, solid ? &maps : nullptr, settings);
    state->light_view = prepared.view;
    state->warnings.insert(state->warnings.end(), prepared.warnings.begin(), prepared.warnings.end());
    state->notes = prepared.notes;
    state->data = std::move(prepared);
    finish_prepare(work, *state);
    return state;
}

} // namespace penumbra
