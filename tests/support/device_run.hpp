// Runs soft_shadow_map step by step on the device and reads back all that it saw, for comparison with the oracle.
#pragma once

#include <optional>
#include <vector>

#include "opencl/work.hpp"
#include "oracle/soft_shadow_map_oracle.hpp"
#include "scene/camera.hpp"
#include "technique/soft_shadow_map.hpp"

namespace penumbra::test {

inline std::shared_ptr<opencl::Context> device_context(bool canaries = false)
{
    auto context = opencl::Context::open("");
    context->canaries = canaries;
    return context;
}

// What is shaded: occluder maps from a rectangle light, receivers from the light's view or any other camera.
struct SoftCase {
    double half_u = 0.25, half_v = 0.25;
    Vec2 tangent{1, 1};
    DepthMap front;
    std::optional<DepthMap> back;
    SoftShadowMap settings{.visibility = PatchVisibility::sum};
    DepthMap receivers;
    std::optional<Camera> camera; // of the receivers; nothing: the light's view
};

struct SoftRun {
    std::vector<oracle::Map> maps;
    std::vector<oracle::Receiver> points; // of the pixels, row by row; those that are not there have d = NO_RECEIVER
    oracle::Settings settings;
    std::vector<float> visibility;
    ShadeCounts counts;
};

inline LightFrame frame_of(const SoftCase& c)
{
    return {.origin = {0, 0, 0}, .u = {1, 0, 0}, .v = {0, 1, 0}, .direction = {0, 0, -1}, .half_u = c.half_u, .half_v = c.half_v};
}

inline oracle::Map read_map(opencl::Work& work, const OccluderMap& map, int width, int height)
{
    oracle::Map result{.width = width, .height = height, .texels = {}};
    const auto texels = work.read(map.texels), steps = work.read(map.steps);
    for (std::size_t i = 0; i < texels.size(); ++i) result.texels.push_back({texels[i].s[0], texels[i].s[1], steps[i].s[0], steps[i].s[1]});
    return result;
}

// One of a union's maps; their steps, which the union finds where it needs them, by the kernel that has a test of its own.
inline oracle::Map read_map(opencl::Work& work, const PreparedUnion& united, int number, int width, int height, double precision)
{
    const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height), first = static_cast<std::size_t>(number) * count;
    const std::vector<cl_float2> texels = work.read(united.texels, first, count);
    const OccluderMap map{.texels = work.upload(std::span<const cl_float2>(texels), "texels"), .steps = work.buffer<cl_float2>(count, "steps")};
    work.launch(occluders_program(), "slope_steps", {static_cast<std::size_t>(width), static_cast<std::size_t>(height)}, {16, 8}, 0, cl_int2{{width, height}}, static_cast<float>(precision),
                map.texels, map.steps);
    return read_map(work, map, width, height);
}

inline std::vector<oracle::Receiver> read_points(opencl::Work& work, const ReceiverPoints& points)
{
    const auto xi = work.read(points.xi), eta = work.read(points.eta), d = work.read(points.d);
    std::vector<oracle::Receiver> result;
    for (int y = 0; y < points.view.height; ++y)
        for (int x = 0; x < points.view.width; ++x) {
            const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(points.view.stride) + static_cast<std::size_t>(x);
            result.push_back({xi[at], eta[at], d[at]});
        }
    return result;
}

inline SoftRun run(const std::shared_ptr<opencl::Context>& context, const SoftCase& c)
{
    opencl::Work work(context);
    const LightFrame light = frame_of(c);
    const Camera view = light_camera(light, c.tangent, light.origin);
    OccluderDepth depth{.light = light,
                        .camera = view,
                        .width = c.front.width,
                        .height = c.front.height,
                        .precision = c.front.precision,
                        .front = {},
                        .back = {},
                        .layers = {}};
    const auto front = work.upload(std::span<const float>(c.front.depth), "front");
    depth.front = front.memory();
    opencl::Buffer<float> back;
    if (c.back) {
        back = work.upload(std::span<const float>(c.back->depth), "back");
        depth.back = back.memory();
    }
    const PreparedSoftShadowMap prepared = prepare_soft_shadow_map(work, depth, c.settings);

    const auto receiver_depth = work.upload(std::span<const float>(c.receivers.depth), "receivers");
    const ReceiverView receiver = receiver_view(c.camera.value_or(view), c.receivers.width, c.receivers.height, view);
    const ReceiverPoints points = receiver_points(work, receiver, receiver_depth.memory(), c.receivers.precision);
    const auto visibility = work.buffer<float>(c.receivers.depth.size(), "visibility");
    SoftRun result;
    shade_soft_shadow_map(work, prepared, points, visibility.memory(), &result.counts);

    for (const auto& side : prepared.sides) result.maps.push_back(read_map(work, side.map, prepared.view.width, prepared.view.height));
    for (int map = 0; map < prepared.united.maps; ++map) result.maps.push_back(read_map(work, prepared.united, map, prepared.view.width, prepared.view.height, prepared.precision));
    result.points = read_points(work, points);
    result.visibility = work.read(visibility);
    result.settings = {.kx = prepared.view.light_scale_x,
                       .ky = prepared.view.light_scale_y,
                       .bias = c.settings.bias,
                       .precision = std::max(c.front.precision, c.receivers.precision),
                       .sum = c.settings.accumulator == Accumulator::compensated ? oracle::Sum::compensated : oracle::Sum::binary32};
    work.finish();
    return result;
}

} // namespace penumbra::test
