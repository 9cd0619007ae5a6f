#include <algorithm>

#include "engine/depth_sources.hpp"
#include "engine/geometry.hpp"
#include "engine/prepare.hpp"
#include "engine/state.hpp"

namespace penumbra {
namespace {

// The light's centre; of a directional light a point so far against its direction that its rays are parallel to a ten-thousandth.
Vec3 viewpoint(const LightFrame& frame, const Camera& camera, const Topology& topology)
{
    if (!frame.directional) return frame.origin;
    double reach = 0;
    for (const Imath::V3f& vertex : topology.vertices()) reach = std::max(reach, (Vec3(vertex) - camera.frame.origin).length());
    return camera.frame.origin - frame.direction * (1e4 * reach);
}

} // namespace

std::shared_ptr<Prepared::State> prepare_smoothies(std::shared_ptr<Prepared::State> state, const Occluders& occluders,
                                                   const Geometry& geometry, const Smoothie& settings)
{
    const Light& light = state->light;
    check_size(*occluders.front, occluders.width, occluders.height, "occluders.depth.front");
    const LightFrame frame = light_frame(light);
    state->light_view = occluder_camera(light, occluders.camera, geometry.objects(), occluders.width, occluders.height);
    state->covered = true;

    Stopwatch watch;
    const bool objects = geometry.state().any(&Object::casts);
    if (!objects && settings.silhouettes == SilhouetteSource::object)
        state->warnings.push_back("there are no objects that cast: silhouettes are those of the depth map (silhouettes image)");
    std::shared_ptr<const Topology> topology;
    if (objects && settings.silhouettes == SilhouetteSource::object) {
        topology = geometry.state().topology();
    } else {
        const TriangleMesh surfaces = mesh_of_texels(*occluders.front, state->light_view);
        const TriangleMesh* const meshes[] = {&surfaces};
        topology = std::make_shared<const Topology>(meshes);
    }
    state->stages.push_back({"topology", watch.ms(), 0, topology->bytes()});

    Stopwatch finding;
    const Silhouette silhouette = silhouette_of(*topology, viewpoint(frame, state->light_view, *topology));
    const SmoothieEdges edges = smoothie_edges(*topology, silhouette, state->light_view);
    state->stages.push_back({"silhouettes", finding.ms(), 0, edges.edges.size() * sizeof(float)});
    state->notes.push_back(std::to_string(edges.count) + " silhouette edges wear smoothies");
    if (edges.count == 0) state->warnings.push_back("there are no silhouettes before the light: shadows have hard edges");

    opencl::Work work(state->context);
    work.stage("upload occluders");
    const auto front = work.upload(std::span<const float>(occluders.front->depth), "front occluder depth");
    work.stage("shadow map");
    state->data = prepare_smoothie(work,
                                   {.light = frame,
                                    .camera = state->light_view,
                                    .width = occluders.width,
                                    .height = occluders.height,
                                    .precision = occluders.front->precision,
                                    .front = front.memory(),
                                    .back = {}},
                                   edges, settings);
    finish_prepare(work, *state);
    return state;
}

} // namespace penumbra
