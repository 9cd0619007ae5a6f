#include "technique/soft_shadow_map.hpp"

#include <algorithm>

#include "technique/constants.hpp"
#include "technique/keys.hpp"
#include "technique/rows.hpp"

namespace penumbra {
namespace {

MapSize blocks_of(MapSize size) { return {(size.width + BLOCK - 1) / BLOCK, (size.height + BLOCK - 1) / BLOCK}; }

std::size_t count_of(MapSize size) { return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height); }

std::array<std::size_t, 2> grid_of(MapSize size) { return {static_cast<std::size_t>(size.width), static_cast<std::size_t>(size.height)}; }

PreparedSoftShadowMap::Side prepare_side(opencl::Work& work, const PreparedSoftShadowMap& prepared, const cl::Buffer& depth, MapSize from,
                                         MapSize size)
{
    const MapSize blocks = blocks_of(size), superblocks = blocks_of(blocks);
    PreparedSoftShadowMap::Side side{
        .map = occluder_map(work, depth, from, size, prepared.settings.reduction, prepared.precision, prepared.program),
        .blocks = work.buffer<float>(count_of(blocks), "depth pyramid, level 1"),
        .superblocks = work.buffer<float>(count_of(superblocks), "depth pyramid, level 2")};
    work.launch(prepared.program, "nearest_of_texels", grid_of(blocks), {16, 4}, count_of(size) * 8, cl_int2{{size.width, size.height}},
                side.map.texels, cl_int2{{blocks.width, blocks.height}}, side.blocks);
    work.launch(prepared.program, "nearest_of_blocks", grid_of(superblocks), {16, 4}, count_of(blocks) * 4,
                cl_int2{{blocks.width, blocks.height}}, side.blocks, cl_int2{{superblocks.width, superblocks.height}}, side.superblocks);
    return side;
}

SoftShadowMapConstants constants_of(const opencl::Context& context, const SoftShadowMap& settings)
{
    const int lanes = context.quirks().lanes;
    return {.lanes = lanes, .item_rows = lanes == 1 ? 1 : tile_rows, .accumulator = static_cast<int>(settings.accumulator)};
}

// One pass over the receivers for one occluder map.
void shade_side(opencl::Work& work, const PreparedSoftShadowMap& prepared, const PreparedSoftShadowMap::Side& side, bool merge,
                const ReceiverPoints& receivers, const opencl::Buffer<cl_float8>& bounds, const cl::Buffer& visibility,
                const opencl::Buffer<cl_uint>& evaluated)
{
    const SoftShadowMapConstants constants = constants_of(work.context(), prepared.settings);
    const auto width = static_cast<std::size_t>(receivers.view.stride), height = static_cast<std::size_t>(receivers.view.rows);
    const float bias = static_cast<float>(prepared.settings.bias);
    const float precision = static_cast<float>(std::max(prepared.precision, receivers.precision));

    // On a GPU a tile is a work-group; on a CPU device a work-item, and groups of one keep the share of each thread fine.
    const auto lanes = static_cast<std::size_t>(constants.lanes), rows = static_cast<std::size_t>(constants.item_rows);
    const std::array<std::size_t, 2> group =
        lanes == 1 ? std::array<std::size_t, 2>{TILE_WIDTH, tile_rows} : std::array<std::size_t, 2>{1, 1};
    const std::uint64_t bytes = width * height * 16 + side.map.texels.bytes();
    work.launch(prepared.program, "soft_shadow_map", {width / lanes, height / rows}, group, bytes, receivers.view, prepared.view,
                static_cast<cl_int>(merge), prepared.nearest, bias, precision, side.map.texels, side.map.steps, side.blocks,
                side.superblocks, bounds, receivers.xi, receivers.eta, receivers.d, visibility, evaluated);
}

} // namespace

TechniqueRow soft_shadow_map_row()
{
    using S = SoftShadowMap;
    return {.kind = "soft_shadow_map",
            .summary = "Micro-patches: every texel of the occluder map is projected back onto the light and its share is summed.",
            .source = "Atty, Holzschuch, Lapierre, Hasenfratz, Hansen, Sillion: Soft Shadow Maps, 2006",
            .keys = {choice_key<S>("sides", &S::sides, {"front", "back", "both"},
                                   "which occluder maps are used; both merges them by the larger occlusion"),
                     integer_key<S>("resolution", &S::resolution, {0, 65536}, "texels",
                                    "longer side of the occluder map that is shaded with, made from the one given; 0: as it is"),
                     choice_key<S>("reduction", &S::reduction, {"area", "nearest"},
                                   "how a larger map becomes `resolution`: by covered area, or by the texel at the centre"),
                     choice_key<S>("accumulator", &S::accumulator, {"binary32", "compensated", "binary16"},
                                   "how shares are summed; binary16 is the 2006 hardware's blending, for study"),
                     real_key<S>("bias", &S::bias, {0, 16}, "derived bounds",
                                 "self-shadow bound of receivers on the casters' own surface; 1 is the bound, 0 none"),
                     flag_key<S>("project", &S::project, "shade in the light's view, then sample that mask from the receivers' camera"),
                     integer_key<S>("project_resolution", &S::project_resolution, {1, 65536}, "pixels",
                                    "side of the light's-view mask with project")},
            .lights = {"rectangle", "point"},
            .textured_lights = false,
            .inputs = "occluder depth from the light's centre: front, back or both as `sides` says (or objects that cast); receiver depth "
                      "(or objects)",
            .defaults = SoftShadowMap{}};
}

opencl::Specialisation program_of(const opencl::Context& context, const SoftShadowMap& settings)
{
    return constants_of(context, settings).specialisation();
}

PreparedSoftShadowMap prepare_soft_shadow_map(opencl::Work& work, const OccluderDepth& depth, const SoftShadowMap& settings)
{
    const MapSize from{depth.width, depth.height};
    const MapSize size = reduced_size(depth.width, depth.height, settings.resolution);
    PreparedSoftShadowMap prepared{.settings = settings,
                                   .program = program_of(work.context(), settings),
                                   .view = occluder_view(depth, size),
                                   .precision = depth.precision,
                                   .nearest = 0,
                                   .sides = {}};
    if (settings.sides != Sides::back) prepared.sides.push_back(prepare_side(work, prepared, depth.front, from, size));
    if (settings.sides != Sides::front) prepared.sides.push_back(prepare_side(work, prepared, depth.back, from, size));

    for (const auto& side : prepared.sides)
        for (const float d : work.read(side.superblocks)) prepared.nearest = std::max(prepared.nearest, d);
    return prepared;
}

void shade_soft_shadow_map(opencl::Work& work, const PreparedSoftShadowMap& prepared, const ReceiverPoints& receivers,
                           const cl::Buffer& visibility, ShadeCounts* counts)
{
    const std::size_t tiles_x = static_cast<std::size_t>(receivers.view.stride / TILE_WIDTH);
    const std::size_t tiles_y = static_cast<std::size_t>(receivers.view.rows / tile_rows);
    const auto bounds = work.buffer<cl_float8>(tiles_x * tiles_y, "tile bounds");
    const auto evaluated = work.buffer<cl_uint>(tiles_x * tiles_y, "evaluated texels");
    const cl_float2 half_inverse_scale{{0.5f / prepared.view.light_scale_x, 0.5f / prepared.view.light_scale_y}};

    work.launch(prepared.program, "tile_bounds", {tiles_x, tiles_y}, {16, 1}, receivers.d.bytes() * 3, receivers.view, prepared.nearest,
                half_inverse_scale, receivers.xi, receivers.eta, receivers.d, bounds);
    for (std::size_t i = 0; i < prepared.sides.size(); ++i)
        shade_side(work, prepared, prepared.sides[i], i > 0, receivers, bounds, visibility, evaluated);

    if (!counts) return;
    for (const cl_float8& box : work.read(bounds)) {
        counts->receivers += static_cast<std::uint64_t>(box.s[6]);
        counts->uncovered_receivers += static_cast<std::uint64_t>(box.s[7]);
    }
    for (const cl_uint texels : work.read(evaluated)) counts->pairs += std::uint64_t{texels} * TILE_WIDTH * tile_rows;
}

void sample_mask(opencl::Work& work, const ReceiverPoints& receivers, const cl::Buffer& mask, int mask_width, int mask_height,
                 const cl::Buffer& visibility, const opencl::Specialisation& program)
{
    const ReceiverView& view = receivers.view;
    const auto width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(view.height);
    work.launch(program, "sample_mask", {width, height}, {16, 8}, width * height * 20, view, receivers.xi, receivers.eta, receivers.d,
                cl_int2{{mask_width, mask_height}}, mask, visibility);
}

} // namespace penumbra
