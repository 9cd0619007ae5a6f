#include "technique/shadow_map.hpp"

#include <algorithm>

#include "technique/constants.hpp"
#include "technique/keys.hpp"
#include "technique/rows.hpp"

namespace penumbra {

TechniqueRow shadow_map_row()
{
    using S = ShadowMap;
    return {.kind = "shadow_map",
            .summary = "Hard shadows from the light's centre, plain or with filtered edges; the light's extent is ignored.",
            .source = "Williams 1978; percentage-closer filtering: Reeves, Salesin, Cook 1987",
            .keys = {choice_key<S>("filter", &S::filter, {"hard", "percentage_closer", "bicubic"},
                                   "one comparison, taps x taps equal ones, or 4 x 4 with cubic B-spline weights"),
                     integer_key<S>("taps", &S::taps, {1, 63}, "texels", "side of percentage_closer's window"),
                     real_key<S>("bias", &S::bias, {0, 16}, "derived bounds",
                                 "self-shadow bound from the surface's slope; 1 is the bound, 0 none")},
            .lights = {"rectangle", "sphere", "point", "directional"},
            .textured_lights = false,
            .inputs = "occluder depth (front) from the light's centre (or objects that cast); receiver depth (or objects)",
            .defaults = ShadowMap{}};
}

PreparedShadowMap prepare_shadow_map(opencl::Work& work, const OccluderDepth& depth, const ShadowMap& settings)
{
    const MapSize size{depth.width, depth.height};
    const opencl::Specialisation program = ShadowMapConstants{}.specialisation();
    return {.settings = settings,
            .program = program,
            .view = occluder_view(depth, size),
            .precision = depth.precision,
            .map = occluder_map(work, depth.front, size, size, Reduction::area, depth.precision, program)};
}

void shade_shadow_map(opencl::Work& work, const PreparedShadowMap& prepared, const ReceiverPoints& receivers, const cl::Buffer& visibility)
{
    const ReceiverView& view = receivers.view;
    const std::array<std::size_t, 2> grid{static_cast<std::size_t>(view.width), static_cast<std::size_t>(view.height)};
    const std::uint64_t bytes = grid[0] * grid[1] * 20;
    const float bias = static_cast<float>(prepared.settings.bias);
    const float precision = static_cast<float>(std::max(prepared.precision, receivers.precision));
    const opencl::Specialisation& program = prepared.program;
    if (prepared.settings.filter == ShadowFilter::bicubic) {
        work.launch(program, "shadow_map_bicubic", grid, {16, 8}, bytes, view, prepared.view, bias, precision, prepared.map.texels,
                    prepared.map.steps, receivers.xi, receivers.eta, receivers.d, visibility);
        return;
    }
    const cl_int taps = prepared.settings.filter == ShadowFilter::hard ? 1 : prepared.settings.taps;
    work.launch(program, "shadow_map_taps", grid, {16, 8}, bytes, view, prepared.view, bias, precision, taps, prepared.map.texels,
                prepared.map.steps, receivers.xi, receivers.eta, receivers.d, visibility);
}

} // namespace penumbra
