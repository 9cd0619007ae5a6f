#include "technique/occluder_maps.hpp"

#include <algorithm>
#include <cmath>

namespace penumbra {
namespace {

constexpr double point_light_scale = 1e18;

float light_scale(double tangent, double half_extent)
{
    return static_cast<float>(half_extent > 0 ? std::min(tangent / (2 * half_extent), point_light_scale) : point_light_scale);
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
    const auto upload = [&](const DepthMap& map, const char* what) {
        if (result.uploaded.empty()) work.stage("upload occluders");
        depth.precision = std::max(depth.precision, map.precision);
        result.uploaded.push_back(work.lend(std::span<const float>(map.depth), what));
        return result.uploaded.back().memory();
    };
    if (front && from.front) depth.front = upload(*from.front, "front occluder depth");
    if (back && from.back) depth.back = upload(*from.back, "back occluder depth");
    for (const DepthMap& layer : from.layers.first(std::min(from.layers.size(), static_cast<std::size_t>(layers)))) depth.layers.push_back(upload(layer, "occluder depth behind the front"));
    if (result.uploaded.empty()) depth.precision = 0x1p-24;
    return result;
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

OccluderView occluder_view(const OccluderDepth& depth, MapSize size)
{
    const float scale_x = light_scale(depth.camera.half_extent.x, depth.light.half_u);
    const float scale_y = light_scale(depth.camera.half_extent.y, depth.light.half_v);
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
