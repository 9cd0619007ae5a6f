#include "engine/depth_sources.hpp"
#include "engine/geometry.hpp"
#include "engine/prepare.hpp"
#include "engine/state.hpp"
#include "silhouette/silhouette.hpp"

namespace penumbra {
namespace {

// Surfaces that the occluder maps show, where there are no objects: every map's sheets of texels.
Topology topology_of_maps(const Occluders& occluders, const Camera& camera)
{
    std::vector<TriangleMesh> meshes{mesh_of_texels(*occluders.front, camera)};
    for (const DepthMap& layer : occluders.layers) meshes.push_back(mesh_of_texels(layer, camera));
    std::vector<const TriangleMesh*> pointers;
    for (const TriangleMesh& mesh : meshes) pointers.push_back(&mesh);
    return Topology(pointers);
}

void warn_of_edges(const Topology& topology, Prepared::State& state)
{
    const auto warn = [&](std::uint64_t count, const char* what) {
        if (count > 0) state.warnings.push_back(std::to_string(count) + what);
    };
    warn(topology.open_edges(),
         " edges of the casters have one triangle alone: they count as silhouettes, and both sides of such a surface cast "
         "(overlap sum: of the two the one that hides more counts)");
    warn(topology.nonmanifold_edges(),
         " edges of the casters have more than two triangles: they count as silhouettes where the facing ones do not cancel");
    warn(topology.left_out(), " triangles without area were left out");
}

} // namespace

std::shared_ptr<Prepared::State> prepare_wedges(std::shared_ptr<Prepared::State> state, const Occluders& given, const Geometry& geometry,
                                                const SoftShadowVolume& settings)
{
    const Light& light = state->light;
    const bool meshes = casts_or_shown(geometry, given, "soft_shadow_volume");
    state->light_view = wedge_view(light);
    state->covered = true;

    Stopwatch watch;
    std::shared_ptr<const Topology> topology;
    Vec2 texel{0, 0};
    if (meshes) {
        topology = geometry.state().topology();
        warn_of_edges(*topology, *state);
    } else {
        check_size(*given.front, given.width, given.height, "occluders.depth.front");
        const Camera camera = occluder_camera(light, given.camera, {}, given.width, given.height);
        topology = std::make_shared<const Topology>(topology_of_maps(given, camera));
        texel = {2 * camera.half_extent.x / given.width, 2 * camera.half_extent.y / given.height};
    }
    state->stages.push_back({"topology", watch.ms(), 0, topology->bytes()});

    opencl::Work work(state->context);
    work.stage("prepare");
    PreparedSoftShadowVolume prepared = prepare_soft_shadow_volume(work, light, {.topology = *topology, .texel = texel}, settings);
    state->warnings.insert(state->warnings.end(), prepared.warnings.begin(), prepared.warnings.end());
    if (prepared.triangles == 0) state->warnings.push_back("no triangle faces the light: nothing casts shadows");
    state->data = std::move(prepared);
    finish_prepare(work, *state);
    return state;
}

} // namespace penumbra
