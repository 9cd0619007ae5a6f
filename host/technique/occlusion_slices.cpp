#include "technique/occlusion_slices.hpp"

#include <algorithm>
#include <cmath>

#include "technique/occlusion_levels.hpp"

namespace penumbra {
namespace {

constexpr double most_taps = 16;

// From where to where a slice comes to count for a receiver (3.4.2).
struct Fade {
    double from, to;
};

// A receiver on a plane itself does not count as beyond it, whatever rounding made of its depth.
double beyond(double far) { return far + 0x1p-20 * std::abs(far); }

Fade fade_of(const std::vector<float>& depths, std::size_t slice, SelfShadow self_shadow)
{
    const double near = depths[slice], far = depths[slice + 1];
    if (self_shadow == SelfShadow::own) return {near, far};
    // What lies beyond the last caster is none of them: there a slice counts in full.
    const bool last = slice + 2 == depths.size();
    if (last || self_shadow == SelfShadow::omit) return {beyond(far), beyond(far)};
    return {beyond(far), static_cast<double>(depths[slice + 2])};
}

// The slices' planes as shading needs them, all layers of each.
std::vector<OcclusionPlane> planes_of(const SliceView& view, const std::vector<float>& depths, const SlicePart& part,
                                      const OcclusionTexture& settings, SelfShadow self_shadow)
{
    const bool layered = is_layered(settings);
    std::vector<OcclusionPlane> planes;
    for (std::size_t k = 0; k + 1 < depths.size(); ++k) {
        const double far = depths[k + 1];
        const double per = view.orthographic ? 1 : 1 / (far + static_cast<double>(view.behind));
        const double along = view.orthographic ? 1 : far * per;
        const Fade fade = fade_of(depths, k, self_shadow);
        OcclusionPlane plane{.slice = static_cast<int>(k),
                             .layer = -1,
                             .levels = 1,
                             .at_x = static_cast<float>(along * view.per_x),
                             .at_y = static_cast<float>(along * view.per_y),
                             .half_x = static_cast<float>(part.half_u * per * view.per_x),
                             .half_y = static_cast<float>(part.half_v * per * view.per_y),
                             .far = static_cast<float>(far),
                             .fade_from = static_cast<float>(fade.from),
                             .per_fade = fade.to > fade.from ? static_cast<float>(std::min(1 / (fade.to - fade.from), 1e30)) : 1e30F};
        for (int layer = 0; layer < (layered ? settings.layers : 1); ++layer) {
            if (layered) plane.layer = layer;
            planes.push_back(plane);
        }
    }
    return planes;
}

// Lookups along each axis: kernels that are longer than wide are made of square ones.
std::array<int, 2> taps_of(const std::vector<OcclusionPlane>& planes)
{
    double x = 1, y = 1;
    for (const OcclusionPlane& plane : planes) {
        x = std::max(x, 2.0 * plane.half_x);
        y = std::max(y, 2.0 * plane.half_y);
    }
    const auto taps = [](double ratio) { return static_cast<int>(std::clamp(std::ceil(ratio * (1 - 0x1p-20)), 1.0, most_taps)); };
    return {taps(x / y), taps(y / x)};
}

// A receiver that does not cast has no slice of its own.
SelfShadow self_shadow_of(const OcclusionTexture& settings, bool receivers_cast)
{
    if (settings.self_shadow != SelfShadow::automatic) return settings.self_shadow;
    return receivers_cast ? SelfShadow::fade : SelfShadow::own;
}

void mark_triangles(opencl::Work& work, const opencl::Specialisation& program, const SliceScenery& scenery, const SliceView& view,
                    const opencl::Buffer<cl_uint>& occupancy)
{
    const std::size_t count = scenery.casters.triangles.size() / 3;
    if (count == 0) return;
    const cl_int none = 0;
    const auto listed = work.upload(std::span<const cl_int>(&none, 1), "number of large triangles");
    work.launch(program, "slice_triangles", {count, 1}, {64, 1}, count * 48, view, static_cast<cl_int>(count), scenery.vertices,
                scenery.triangles, scenery.planes, occupancy, scenery.large, listed);
    work.launch(program, "slice_large", {4096, 1}, {64, 1}, 0, view, scenery.vertices, scenery.triangles, scenery.planes, occupancy,
                scenery.large, listed);
}

void mark_solid(opencl::Work& work, const opencl::Specialisation& program, const SliceScenery& scenery, const SliceView& view,
                const opencl::Buffer<cl_uint>& occupancy)
{
    if (!scenery.solid) return;
    const auto& [front, back, camera] = *scenery.solid;
    const cl_float2 per{
        {static_cast<float>(front.width / (2 * camera.half_extent.x)), static_cast<float>(front.height / (2 * camera.half_extent.y))}};
    const Vec3 origin = light_from_world(scenery.light, camera.frame.origin);
    const cl_float4 from{{static_cast<float>(origin.x), static_cast<float>(origin.y), static_cast<float>(origin.z), 0}};
    const std::size_t side = static_cast<std::size_t>(view.width);
    work.launch(program, "fill_between", {side, side}, {16, 1}, side * side * 8, view, cl_int2{{front.width, front.height}}, per, from,
                scenery.front, scenery.back, scenery.planes, occupancy);
}

} // namespace

SliceScenery slice_scenery(opencl::Work& work, const LightFrame& frame, std::span<const TriangleMesh* const> meshes, const SolidMaps* solid,
                           const OcclusionTexture& settings, bool receivers_cast)
{
    SliceScenery scenery{.light = frame,
                         .casters = slice_casters(frame, meshes),
                         .range = {},
                         .depths = {},
                         .vertices = {},
                         .planes = {},
                         .triangles = {},
                         .large = {},
                         .solid = solid,
                         .self_shadow = self_shadow_of(settings, receivers_cast),
                         .front = {},
                         .back = {}};
    scenery.range = slice_range(scenery.casters, frame.directional);
    if (!(scenery.range.near <= scenery.range.far) || (!frame.directional && !(scenery.range.far > 0))) return scenery;
    scenery.depths = slice_depths(scenery.casters, scenery.range, settings.slices, settings.placement, frame.directional);
    scenery.vertices = work.upload(std::span<const float>(scenery.casters.vertices), "vertices");
    scenery.triangles = work.upload(std::span<const cl_int>(scenery.casters.triangles), "triangles");
    scenery.large = work.buffer<cl_int>(scenery.casters.triangles.size() / 3, "large triangles");
    scenery.planes = work.upload(std::span<const float>(scenery.depths), "depths of slices");
    if (solid) {
        scenery.front = work.upload(std::span<const float>(solid->front.depth), "front occluder depth");
        scenery.back = work.upload(std::span<const float>(solid->back.depth), "back occluder depth");
    }
    return scenery;
}

std::vector<SlicePart> slice_parts(const LightFrame& light, int splits)
{
    std::vector<SlicePart> parts;
    const double half_u = light.half_u / splits, half_v = light.half_v / splits;
    for (int j = 0; j < splits; ++j)
        for (int i = 0; i < splits; ++i)
            parts.push_back(
                {.centre_x = (2 * i + 1 - splits) * half_u, .centre_y = (2 * j + 1 - splits) * half_v, .half_u = half_u, .half_v = half_v});
    return parts;
}

MarkedSlices marked_slices(opencl::Work& work, const opencl::Specialisation& program, const SliceScenery& scenery, const SlicePart& part,
                           const OcclusionTexture& settings)
{
    MarkedSlices marked;
    marked.view = slice_view(scenery.casters, scenery.range, part, settings, scenery.light.directional);
    const std::size_t side = static_cast<std::size_t>(settings.resolution);
    marked.occupancy = work.upload(std::span<const cl_uint>(std::vector<cl_uint>(2 * side * side)), "slices");
    mark_triangles(work, program, scenery, marked.view, marked.occupancy);
    mark_solid(work, program, scenery, marked.view, marked.occupancy);

    const std::vector<OcclusionPlane> all = planes_of(marked.view, scenery.depths, part, settings, scenery.self_shadow);
    marked.taps = taps_of(all);
    const auto planes = work.upload(std::span<const OcclusionPlane>(all), "planes of slices");
    const auto counts = work.upload(std::span<const cl_int>(std::vector<cl_int>(all.size())), "filled texels");
    work.launch(program, "count_filled", {side, all.size()}, {16, 1}, side * side * 8 * all.size(), size_of(marked.view),
                static_cast<cl_int>(all.size()), static_cast<cl_int>(settings.layers - 1), static_cast<cl_int>(settings.leak_fix), planes,
                marked.occupancy, counts);
    const std::vector<cl_int> filled = work.read(counts);
    for (std::size_t i = 0; i < all.size(); ++i)
        if (filled[i] > 0) marked.planes.push_back(all[i]);
    return marked;
}

} // namespace penumbra
