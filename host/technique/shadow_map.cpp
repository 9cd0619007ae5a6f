#include "technique/shadow_map.hpp"

#include <algorithm>
#include <cmath>

#include "technique/keys.hpp"

namespace penumbra {
namespace {

constexpr Names<3> filter_names{"hard", "percentage_closer", "bicubic"};

opencl::Specialisation program() { return {"shadow_map.cl", {{"TILE_ROWS", std::to_string(tile_rows)}}}; }

bool is_empty(const DepthMap& map)
{
    return std::none_of(map.depth.begin(), map.depth.end(), [](float depth) { return depth > 0 && std::isfinite(depth); });
}

// Of one light: known before anything is computed.
WorkAmount most_work(const ShadowMap& settings, int width, int height)
{
    const int side = settings.filter == ShadowFilter::percentage_closer ? settings.taps : settings.filter == ShadowFilter::bicubic ? 4 : 1;
    return {.key = "receivers.resolution",
            .amount = static_cast<double>(width) * height * side * side,
            .unit = WorkAmount::Unit::pairs,
            .what = "pairs of occluder texel and receiver"};
}

} // namespace

TechniqueRow row(const ShadowMap&)
{
    using S = ShadowMap;
    return {.kind = "shadow_map",
            .summary = "Hard shadows from the light's centre, plain or with filtered edges; the light's extent is ignored.",
            .source = "Williams 1978; percentage-closer filtering: Reeves, Salesin, Cook 1987",
            .keys = {preset_key<S>(ShadowMap{.preset = Preset::paper}),
                 choice_key<S>("filter", &S::filter, filter_names,
                                   "one comparison, taps x taps equal ones, or 4 x 4 with cubic B-spline weights"),
                     integer_key<S>("taps", &S::taps, {1, 63}, "texels", "side of percentage_closer's window"),
                     real_key<S>("bias", &S::bias, {0, 16}, "derived bounds",
                                 "self-shadow bound from the surface's slope; 1 is the bound, 0 none"),
                 tolerance_key<S>()},
            .lights = {"rectangle", "sphere", "point", "directional"},
            .textured_lights = false,
            .inputs = "occluder depth (front) from the light's centre (or objects that cast); receiver depth (or objects)",
            .defaults = ShadowMap{}};
}

PreparedShadowMap prepare_shadow_map(opencl::Work& work, const OccluderDepth& given, const ShadowMap& settings)
{
    const EndlessDepth endless = endless_depth(work, given, program());
    const OccluderDepth& depth = endless.depth;
    const MapSize size{depth.width, depth.height};
    return {.settings = settings,
            .program = program(),
            .view = occluder_view(depth.light, depth.camera, size, endless.reach),
            .precision = depth.precision,
            .reach = endless.reach,
            .map = occluder_map(work, depth.front, size, size, Reduction::area, depth.precision, program())};
}

void shade_shadow_map(opencl::Work& work, const PreparedShadowMap& prepared, const ReceiverPoints& receivers, const cl::Buffer& visibility)
{
    const ReceiverView& view = receivers.view;
    const std::array<std::size_t, 2> grid{static_cast<std::size_t>(view.width), static_cast<std::size_t>(view.height)};
    const std::uint64_t bytes = grid[0] * grid[1] * 20;
    const float bias = static_cast<float>(prepared.settings.bias);
    const float precision = static_cast<float>(std::max(prepared.precision, receivers.precision));
    const opencl::Specialisation& program = prepared.program;
    const auto has_planes = static_cast<cl_int>(receivers.has_planes);
    if (prepared.settings.filter == ShadowFilter::bicubic) {
        work.launch(program, "shadow_map_bicubic", grid, {16, 8}, bytes, view, prepared.view, bias, precision, has_planes, prepared.map.texels,
                    prepared.map.steps, receivers.xi, receivers.eta, receivers.d, receivers.planes, visibility);
        return;
    }
    const cl_int taps = prepared.settings.filter == ShadowFilter::hard ? 1 : prepared.settings.taps;
    work.launch(program, "shadow_map_taps", grid, {16, 8}, bytes, view, prepared.view, bias, precision, has_planes, taps, prepared.map.texels,
                prepared.map.steps, receivers.xi, receivers.eta, receivers.d, receivers.planes, visibility, work.stop());
}

Needs needs(const ShadowMap&) { return {.front = true, .every_receiver = true}; } // hard, or as wide as its filter

PreparedShadowMap prepare(opencl::Work& work, const Casting& casting, const ShadowMap& settings, Findings& findings)
{
    if (const LightFrame frame = light_frame(casting.light); frame.half_u > 0 || frame.half_v > 0)
        findings.warnings.emplace_back("shadow_map takes the light as a point at its centre: its extent is ignored");
    if (casting.depth.front && is_empty(*casting.depth.front)) findings.warnings.emplace_back(empty_map);
    findings.view = casting.depth.camera;
    const DeviceDepth maps = on_device(work, casting, true, false);
    work.stage("prepare");
    return prepare_shadow_map(work, maps.depth, settings);
}

void shade(opencl::Work& work, const PreparedShadowMap& prepared, const Receiving& receivers, Shaded& shaded)
{
    const ReceiverPoints points = points_with_planes(work, receivers, prepared.program, prepared.reach);
    work.stage("shade");
    if (shaded.estimated) shaded.estimated(most_work(prepared.settings, points.view.width, points.view.height));
    shade_shadow_map(work, prepared, points, shaded.visibility);
    if (shaded.counts) shaded.counts->pairs = static_cast<std::uint64_t>(most_work(prepared.settings, points.view.width, points.view.height).amount);
}

std::vector<WorkAmount> work(const ShadowMap& settings, const MaskShape& shape)
{
    WorkAmount most = most_work(settings, shape.receivers.width, shape.receivers.height);
    most.amount *= shape.lights();
    return {most};
}

std::vector<opencl::Specialisation> specialisations(const ShadowMap&, int) { return {program()}; }

DeviceBuffers device_buffers(const ShadowMap&) { return {}; }

} // namespace penumbra
