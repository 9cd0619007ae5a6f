#include "technique/occluder_maps.hpp"

#include <algorithm>
#include <cmath>

#include "scene/fine_depth.hpp"

namespace penumbra {
namespace {

constexpr double point_light_scale = 1e18;

float light_scale(double tangent, double half_extent)
{
    return static_cast<float>(half_extent > 0 ? std::min(tangent / (2 * half_extent), point_light_scale) : point_light_scale);
}

// Only what every map has of the same texels: as an Engine renders them.
void upload_fine(opencl::Work& work, const std::vector<const DepthMap*>& maps, DeviceDepth& result)
{
    if (maps.empty() || !maps.front()->fine) return;
    const FineDepth& first = *maps.front()->fine;
    for (const DepthMap* map : maps)
        if (!map->fine || map->fine->side != first.side || map->fine->blocks != first.blocks || map->fine->depth.size() != first.depth.size()) return;
    if (first.blocks->size() != maps.front()->depth.size()) return;
    FineOnDevice& fine = result.depth.fine;
    fine.side = first.side;
    fine.samples = first.depth.size();
    result.blocks = work.lend(std::span<const cl_int>(*first.blocks), "texels with samples");
    fine.blocks = result.blocks.memory();
    for (const DepthMap* map : maps) {
        result.uploaded.push_back(work.lend(std::span<const float>(map->fine->depth), "samples of texels"));
        fine.depth.push_back(result.uploaded.back().memory());
    }
}

} // namespace

opencl::Specialisation occluders_program() { return {"occluders.cl", {}}; }

DeviceDepth on_device(opencl::Work& work, const Casting& casting, bool front, bool back, int layers)
{
    const LightDepth& from = casting.depth;
    DeviceDepth result{.depth = {.light = light_frame(casting.light),
                                 .camera = from.camera,
                                 .width = from.width,
                                 .height = from.height,
                                 .precision = 0,
                                 .front = from.device_front,
                                 .back = from.device_back,
                                 .layers = {}},
                       .uploaded = {}};
    OccluderDepth& depth = result.depth;
    std::vector<const DepthMap*> shown;
    const auto upload = [&](const DepthMap& map, const char* what) {
        if (result.uploaded.empty()) work.stage("upload occluders");
        depth.precision = std::max(depth.precision, map.precision);
        result.uploaded.push_back(work.lend(std::span<const float>(map.depth), what));
        shown.push_back(&map);
        return result.uploaded.back().memory();
    };
    if (front && from.front) depth.front = upload(*from.front, "front occluder depth");
    if (back && from.back) depth.back = upload(*from.back, "back occluder depth");
    for (const DepthMap& layer : from.layers.first(std::min(from.layers.size(), static_cast<std::size_t>(layers)))) depth.layers.push_back(upload(layer, "occluder depth behind the front"));
    if (result.uploaded.empty()) depth.precision = 0x1p-24;
    upload_fine(work, shown, result);
    return result;
}

EndlessDepth endless_depth(opencl::Work& work, const OccluderDepth& depth, const opencl::Specialisation& program)
{
    EndlessDepth endless{.depth = depth, .made = {}, .reach = 0};
    if (!depth.light.directional) return endless;
    std::vector<std::pair<cl::Buffer*, std::size_t>> maps;
    const std::size_t count = static_cast<std::size_t>(depth.width) * static_cast<std::size_t>(depth.height);
    for (cl::Buffer* map : {&endless.depth.front, &endless.depth.back})
        if ((*map)()) maps.emplace_back(map, count);
    for (cl::Buffer& map : endless.depth.layers) maps.emplace_back(&map, count);
    for (cl::Buffer& map : endless.depth.fine.depth) maps.emplace_back(&map, depth.fine.samples);

    constexpr std::size_t parts = 256;
    const auto greatest = work.upload(std::span<const float>(std::vector<float>(parts, 0.F)), "greatest depths");
    for (const auto& [map, samples] : maps) work.launch(program, "greatest_depths", {parts, 1}, {64, 1}, samples * 4, static_cast<cl_int>(samples), *map, greatest);
    for (const float most : work.read(greatest)) endless.reach = std::max(endless.reach, most);
    // Not less than the view is wide: what lies close to its plane would leave all other receivers thousands of disparities behind it.
    endless.reach = std::max(endless.reach, static_cast<float>(depth.camera.half_extent.length()));
    for (const auto& [map, samples] : maps) {
        endless.made.push_back(work.buffer<float>(samples, "depths of a directional light"));
        work.launch(program, "depths_of_endless", {samples, 1}, {256, 1}, samples * 8, static_cast<cl_int>(samples), endless.reach, *map, endless.made.back());
        *map = endless.made.back().memory();
    }
    return endless;
}

MapSize reduced_size(int width, int height, int resolution)
{
    const int longer = std::max(width, height);
    if (resolution == 0 || resolution >= longer) return {width, height};
    const auto scaled = [&](int side) {
        return std::max(1, static_cast<int>(std::lround(static_cast<double>(side) * resolution / longer)));
    };
    return {scaled(width), scaled(height)};
}

cl_float2 joining_gap(const OccluderView& view) { return {{view.light_scale_x * view.texel_x, view.light_scale_y * view.texel_y}}; }

OccluderView occluder_view(const LightFrame& light, const Camera& camera, MapSize size, float reach)
{
    const double per_disparity = reach > 0 ? static_cast<double>(reach) : 1;
    const float scale_x = light_scale(camera.half_extent.x / per_disparity, light.half_u);
    const float scale_y = light_scale(camera.half_extent.y / per_disparity, light.half_v);
    const float texel_x = 2.0f / static_cast<float>(size.width), texel_y = 2.0f / static_cast<float>(size.height);
    return {.width = size.width,
            .height = size.height,
            .texel_x = texel_x,
            .texel_y = texel_y,
            .light_scale_x = scale_x,
            .light_scale_y = scale_y,
            .edge_on_x = 0.5f / (scale_x * texel_x),
            .edge_on_y = 0.5f / (scale_y * texel_y)};
}

OccluderMap occluder_map(opencl::Work& work, const cl::Buffer& depth, MapSize from, MapSize size, Reduction reduction, double precision,
                         const opencl::Specialisation& program)
{
    const std::size_t count = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
    const std::size_t source = static_cast<std::size_t>(from.width) * static_cast<std::size_t>(from.height);
    const std::array<std::size_t, 2> grid{static_cast<std::size_t>(size.width), static_cast<std::size_t>(size.height)};
    const cl_int2 from_size{{from.width, from.height}}, to_size{{size.width, size.height}};

    OccluderMap map{.texels = work.buffer<cl_float2>(count, "occluder texels"), .steps = work.buffer<cl_float2>(count, "occluder slopes")};
    if (from.width == size.width && from.height == size.height)
        work.launch(program, "disparity_from_depth", grid, {16, 8}, count * 12, to_size, depth, map.texels);
    else
        work.launch(program, reduction == Reduction::area ? "reduce_area" : "reduce_nearest", grid, {16, 8}, source * 4 + count * 8,
                    from_size, depth, to_size, map.texels);
    work.launch(program, "slope_steps", grid, {16, 8}, count * 16, to_size, static_cast<float>(precision), map.texels, map.steps);
    return map;
}

} // namespace penumbra
