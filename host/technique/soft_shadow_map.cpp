#include "technique/soft_shadow_map.hpp"

#include <algorithm>
#include <cmath>

#include <penumbra/error.hpp>

#include "technique/keys.hpp"
#include "technique/tiling.hpp"
#include "technique/work_estimate.hpp"

namespace penumbra {
namespace {

constexpr WorkKind projections{"receivers.resolution", WorkAmount::Unit::pairs, "pairs of occluder texel and receiver"};

constexpr Names<2> visibility_names{"sum", "union"};
constexpr Names<3> sides_names{"front", "back", "both"};
constexpr Names<2> reduction_names{"area", "nearest"};
constexpr Names<3> accumulator_names{"binary32", "compensated", "binary16"};

MapSize blocks_of(MapSize size) { return {(size.width + BLOCK - 1) / BLOCK, (size.height + BLOCK - 1) / BLOCK}; }

std::size_t count_of(MapSize size) { return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height); }

cl_int2 dimensions(MapSize size) { return {{size.width, size.height}}; }

std::array<std::size_t, 2> grid_of(MapSize size) { return {static_cast<std::size_t>(size.width), static_cast<std::size_t>(size.height)}; }

// The levels above a side's texels.
void build_pyramid(opencl::Work& work, const PreparedSoftShadowMap& prepared, MapSize size, PreparedSoftShadowMap::Side& side)
{
    const MapSize level_1 = blocks_of(size), level_2 = blocks_of(level_1);
    side.blocks = work.buffer<float>(count_of(level_1), "depth pyramid, level 1");
    side.superblocks = work.buffer<float>(count_of(level_2), "depth pyramid, level 2");
    work.launch(prepared.program, "nearest_of_block", grid_of(level_1), {16, 4}, count_of(size) * 8, dimensions(size), 2, side.map.texels, dimensions(level_1), side.blocks);
    work.launch(prepared.program, "nearest_of_block", grid_of(level_2), {16, 4}, count_of(level_1) * 4, dimensions(level_1), 1, side.blocks, dimensions(level_2),
                side.superblocks);
}

PreparedSoftShadowMap::Side prepare_side(opencl::Work& work, const PreparedSoftShadowMap& prepared, const cl::Buffer& depth, MapSize from, MapSize size)
{
    PreparedSoftShadowMap::Side side{.map = occluder_map(work, depth, from, size, prepared.settings.reduction, prepared.precision, prepared.program), .blocks = {}, .superblocks = {}};
    build_pyramid(work, prepared, size, side);
    return side;
}

// Texels of all maps of a union together, as long as nobody asks for a resolution: five maps of 1024 x 1024, 51 bytes a texel. More become surfaces with what they
// cover of fewer, larger texels, 133 bytes each.
constexpr double most_union_texels = 6 << 20, most_reduced_texels = 1 << 21;

// Samples along one side of texels in which something begins or ends, of maps that are rendered (docs/soft_shadow_map.md).
constexpr int fine_side = 4;

// The size that a map is shaded with.
MapSize size_of(const OccluderDepth& depth, const SoftShadowMap& settings)
{
    if (settings.visibility == PatchVisibility::sum || settings.resolution > 0) return reduced_size(depth.width, depth.height, settings.resolution);
    const double maps = (settings.sides == Sides::both ? 2 : 1) + static_cast<double>(depth.layers.size());
    const double texels = static_cast<double>(depth.width) * depth.height * maps;
    if (texels <= most_union_texels) return {depth.width, depth.height};
    // By a whole number, so that samples lie alike in every texel.
    const int longer = std::max(depth.width, depth.height), by = static_cast<int>(std::ceil(std::sqrt(texels / most_reduced_texels)));
    return reduced_size(depth.width, depth.height, std::max(1, longer / by));
}

// Maps of a union, and of each the samples of some texels where there are such.
struct Shown {
    std::vector<cl::Buffer> depth, fine;
};

// Front and layers: entries and exits in turn.
Shown surfaces_in_order(const OccluderDepth& depth, bool back)
{
    Shown shown{{depth.front}, {}};
    shown.depth.insert(shown.depth.end(), depth.layers.begin(), depth.layers.end());
    shown.fine = depth.fine.depth;
    if (back && !shown.fine.empty()) shown.fine.erase(shown.fine.begin() + 1); // front, back, layers
    return shown;
}

// Adds the back map, unless the maps before it show all of it. Else it stays whole: surfaces in order change from one to another from texel to texel, the back map
// less so, and what is joined to its neighbours hides better.
bool add_back(opencl::Work& work, const OccluderDepth& depth, std::size_t number, Shown& maps)
{
    const cl::Buffer fine = depth.fine.depth.empty() ? cl::Buffer() : depth.fine.depth[number];
    if (maps.depth.size() > 1 && !shows_more(work, depth.back, maps.depth, count_of({depth.width, depth.height})) &&
        (!fine() || !shows_more(work, fine, maps.fine, depth.fine.samples)))
        return false;
    maps.depth.push_back(depth.back);
    if (fine()) maps.fine.push_back(fine);
    return true;
}

// The maps of a union: front and back, or entries and exits in turn, and the back for what lies behind them.
PreparedUnion united_maps(opencl::Work& work, const PreparedSoftShadowMap& prepared, const OccluderDepth& depth, MapSize from, MapSize size, const Image* emission)
{
    const Sides sides = prepared.settings.sides;
    Shown maps = sides == Sides::back ? Shown{} : surfaces_in_order(depth, sides == Sides::both);
    const int entries = static_cast<int>(maps.depth.size());
    std::vector<int> other;
    other.reserve(maps.depth.size() + 1);
    for (int i = 0; i < entries; ++i) other.push_back(entries > 1 ? ((i ^ 1) < entries ? i ^ 1 : -1) : sides == Sides::both ? 1 : -1);
    if (sides != Sides::front && add_back(work, depth, sides == Sides::both ? 1 : 0, maps)) other.push_back(entries > 0 ? 0 : -1);
    return prepare_union(work,
                         {.depth = maps.depth,
                          .fine = maps.fine,
                          .fine_side = depth.fine.side,
                          .fine_samples = depth.fine.samples,
                          .blocks = depth.fine.blocks,
                          .other = other,
                          .from = from,
                          .size = size,
                          .precision = prepared.precision,
                          .shape = depth.light.shape,
                          .emission = emission},
                         prepared.view);
}

// The program with every kernel that the technique launches.
opencl::Specialisation program(const SoftShadowMap& settings, int lanes)
{
    if (settings.visibility == PatchVisibility::united)
        return union_program(lanes);
    return {"soft_shadow_map.cl",
            {{"LANES", std::to_string(lanes)},
             {"ITEM_ROWS", std::to_string(item_rows(lanes))},
             {"TILE_ROWS", std::to_string(tile_rows)},
             choice_constant("ACCUMULATOR", accumulator_names, settings.accumulator)}};
}

// One pass over the receivers for one occluder map.
void shade_side(opencl::Work& work, const PreparedSoftShadowMap& prepared, const PreparedSoftShadowMap::Side& side, bool merge,
                const ReceiverPoints& receivers, const opencl::Buffer<cl_float8>& bounds, const cl::Buffer& visibility,
                const opencl::Buffer<cl_uint>& evaluated)
{
    const Tiling tiling = tiling_of(receivers.view, work.context().quirks().lanes);
    const float bias = static_cast<float>(prepared.settings.bias);
    const float precision = static_cast<float>(std::max(prepared.precision, receivers.precision));
    work.launch(prepared.program, "soft_shadow_map", tiling.items, tiling.group, tiling.bytes + side.map.texels.bytes(), receivers.view, prepared.view,
                static_cast<cl_int>(merge), prepared.nearest, bias, precision, static_cast<cl_int>(receivers.has_planes), side.map.texels, side.map.steps, side.blocks,
                side.superblocks, bounds, receivers.xi, receivers.eta, receivers.d, receivers.planes, visibility, evaluated, work.stop());
}

// Says what shading will take before it begins.
void shade_estimated(opencl::Work& work, const PreparedSoftShadowMap& prepared, const ReceiverPoints& points, const cl::Buffer& visibility, Shaded& shaded)
{
    if (shaded.estimated)
        shaded.estimated(estimate_by_sample(work, points, prepared.program, std::max(prepared.united.channels, 1), projections, [&](const ReceiverPoints& some, const cl::Buffer& to, ShadeCounts& counts) {
            shade_soft_shadow_map(work, prepared, some, to, &counts);
        }));
    shade_soft_shadow_map(work, prepared, points, visibility, shaded.counts);
}

// Shades what the light sees of the receivers, and samples that mask from the receivers' camera (3.1).
void shade_projected(opencl::Work& work, const PreparedSoftShadowMap& prepared, const Receiving& receivers, Shaded& shaded)
{
    const int side = prepared.settings.project_resolution;
    const DepthMap from_light = receivers.from_light(side);
    const ReceiverPoints lit_points = points_of(work, from_light, receivers.view, receivers.view, prepared.program, prepared.reach);
    const auto light_mask = work.buffer<float>(from_light.depth.size(), "light-space mask");
    work.stage("shade");
    shade_estimated(work, prepared, lit_points, light_mask.memory(), shaded);
    const ReceiverPoints points = points_of(work, receivers, prepared.program, prepared.reach);
    work.stage("project");
    sample_mask(work, points, light_mask.memory(), side, side, shaded.visibility, prepared.program);
}

// What only a union takes, or not together.
void check_light(const LightFrame& light, const Image* emission, const SoftShadowMap& settings)
{
    const bool sum = settings.visibility == PatchVisibility::sum;
    if (sum && light.shape == LightShape::disc)
        throw Error::at(ErrorCode::invalid_input, "technique.visibility", light.directional ? "is sum and the light directional" : "is sum and the light a sphere",
                        light.directional ? "expected union" : "expected union, or a rectangle of the same area: half-edges of 0.886 times the radius");
    if (sum && emission) throw Error::at(ErrorCode::invalid_input, "technique.visibility", "is sum and the light textured", "expected union");
    if (settings.project && emission) throw Error::at(ErrorCode::invalid_input, "technique.project", "is true and the light textured", "expected false");
}

// As published.
SoftShadowMap paper_settings()
{
    SoftShadowMap settings;
    settings.preset = Preset::paper;
    settings.visibility = PatchVisibility::sum;
    settings.layers = 0;
    settings.tolerance = 0;
    return settings;
}

} // namespace

TechniqueRow row(const SoftShadowMap&)
{
    using S = SoftShadowMap;
    return {
        .kind = "soft_shadow_map",
        .summary = "Micro-patches: every texel of the occluder map is projected back onto the light and its share is summed.",
        .source = "Atty, Holzschuch, Lapierre, Hasenfratz, Hansen, Sillion: Soft Shadow Maps, 2006",
        .keys = {preset_key<S>(paper_settings()),
                 choice_key<S>("visibility", &S::visibility, visibility_names,
                               "how patches are joined: union hides each of 32 x 32 samples of the light once; sum adds shares up (3.4, 3.5)"),
                 integer_key<S>("layers", &S::layers, {0, 16}, "maps",
                                "of the union: surfaces behind the front that are used, peeled from the objects or given in occluders.depth.layers"),
                 choice_key<S>("sides", &S::sides, sides_names, "which occluder maps are used; both merges them by the larger occlusion"),
                 integer_key<S>("resolution", &S::resolution, {0, 65536}, "texels",
                                "longer side of the occluder map that is shaded with, made from the one given; 0: as it is, of the union up to 2^21 texels of all maps together"),
                 choice_key<S>("reduction", &S::reduction, reduction_names,
                               "how a larger map becomes `resolution`, for sum: by covered area, or by the texel at the centre; union keeps the two nearest surfaces of each texel"),
                 choice_key<S>("accumulator", &S::accumulator, accumulator_names,
                               "how shares are summed, for sum; binary16 is the 2006 hardware's blending, for study"),
                 real_key<S>("bias", &S::bias, {0, 16}, "derived bounds",
                             "self-shadow bound of receivers on the casters' own surface; 1 is the bound, 0 none"),
                 flag_key<S>("project", &S::project, "shade in the light's view, then sample that mask from the receivers' camera"),
                 integer_key<S>("project_resolution", &S::project_resolution, {1, 65536}, "pixels",
                                "side of the light's-view mask with project"),
                 tolerance_key<S>()},
        .lights = {"rectangle", "sphere", "point", "directional"},
        .textured_lights = true,
        .inputs = "occluder depth from the light's centre: front, back or both as `sides` says (or objects that cast); receiver depth "
                  "(or objects)",
        .defaults = SoftShadowMap{}};
}

void check_together(const SoftShadowMap& settings)
{
    if (settings.visibility == PatchVisibility::united && settings.accumulator != Accumulator::binary32)
        throw Error::at(ErrorCode::invalid_input, "technique.accumulator", "is " + std::string(accumulator_names[static_cast<std::size_t>(settings.accumulator)]) + " and visibility union",
                        "expected visibility sum: a union sums nothing up");
}

PreparedSoftShadowMap prepare_soft_shadow_map(opencl::Work& work, const OccluderDepth& given, const SoftShadowMap& settings, const Image* emission)
{
    check_together(settings);
    check_light(given.light, emission, settings);
    const EndlessDepth endless = endless_depth(work, given, program(settings, work.context().quirks().lanes));
    const OccluderDepth& depth = endless.depth;
    const MapSize from{depth.width, depth.height};
    const MapSize size = size_of(depth, settings);
    PreparedSoftShadowMap prepared{.settings = settings,
                                   .program = program(settings, work.context().quirks().lanes),
                                   .view = occluder_view(depth.light, depth.camera, size, endless.reach),
                                   .precision = depth.precision,
                                   .reach = endless.reach,
                                   .nearest = 0,
                                   .sides = {},
                                   .united = {}};
    if (settings.visibility == PatchVisibility::united) {
        prepared.united = united_maps(work, prepared, depth, from, size, emission);
        prepared.nearest = prepared.united.nearest;
        return prepared;
    }
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
    const bool united = prepared.settings.visibility == PatchVisibility::united; // counts by rows of a tile, sum by tiles
    if (united)
        shade_union(work, prepared.united, prepared.view, {.bias = prepared.settings.bias, .tolerance = prepared.settings.tolerance, .precision = prepared.precision}, receivers, bounds,
                    visibility, evaluated);
    for (std::size_t i = 0; i < prepared.sides.size(); ++i)
        shade_side(work, prepared, prepared.sides[i], i > 0, receivers, bounds, visibility, evaluated);

    if (!counts) return;
    work.read_later(bounds, [counts](const std::vector<cl_float8>& boxes) {
        for (const cl_float8& box : boxes) {
            counts->receivers += static_cast<std::uint64_t>(box.s[6]);
            counts->uncovered_receivers += static_cast<std::uint64_t>(box.s[7]);
        }
    });
    work.read_later(evaluated, [counts, united](const std::vector<cl_uint>& all) {
        for (const cl_uint texels : all) counts->pairs += std::uint64_t{texels} * TILE_WIDTH * (united ? 1 : tile_rows);
    });
}

void sample_mask(opencl::Work& work, const ReceiverPoints& receivers, const cl::Buffer& mask, int mask_width, int mask_height,
                 const cl::Buffer& visibility, const opencl::Specialisation& program)
{
    const ReceiverView& view = receivers.view;
    const auto width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(view.height);
    work.launch(program, "sample_mask", {width, height}, {16, 8}, width * height * 20, view, receivers.xi, receivers.eta, receivers.d,
                cl_int2{{mask_width, mask_height}}, mask, visibility);
}

Needs needs(const SoftShadowMap& settings)
{
    return {.front = settings.sides != Sides::back,
            .back = settings.sides != Sides::front,
            .layers = settings.visibility == PatchVisibility::united && settings.sides != Sides::back ? settings.layers : 0,
            .receivers_from_light = settings.project,
            .fine = settings.visibility == PatchVisibility::united && settings.resolution == 0 ? fine_side : 0,
            .fine_texels = most_union_texels,
            .clips_light = settings.visibility == PatchVisibility::united && !settings.project,
            .maps_tell_all = settings.visibility == PatchVisibility::united}; // a sum's larger texels reach beyond what the maps show
}

PreparedSoftShadowMap prepare(opencl::Work& work, const Casting& casting, const SoftShadowMap& settings, Findings& findings)
{
    const Needs wanted = needs(settings);
    findings.view = casting.depth.camera;
    const DeviceDepth maps = on_device(work, casting, wanted.front, wanted.back, wanted.layers);
    work.stage("prepare");
    PreparedSoftShadowMap prepared = prepare_soft_shadow_map(work, maps.depth, settings, emission_of(casting.light));
    findings.channels = std::max(prepared.united.channels, 1);
    if (prepared.nearest == 0) findings.warnings.emplace_back(empty_map);
    return prepared;
}

PreparedSoftShadowMap with_emission(opencl::Work& work, const PreparedSoftShadowMap& prepared, const Light& light)
{
    const Image* const emission = emission_of(light);
    check_light(light_frame(light), emission, prepared.settings);
    work.stage("prepare");
    PreparedSoftShadowMap other = prepared;
    set_emission(work, emission, other.united);
    return other;
}

void shade(opencl::Work& work, const PreparedSoftShadowMap& prepared, const Receiving& receivers, Shaded& shaded)
{
    if (prepared.settings.project) {
        shade_projected(work, prepared, receivers, shaded);
        return;
    }
    const ReceiverPoints points = points_with_planes(work, receivers, prepared.program, prepared.reach);
    work.stage("shade");
    shade_estimated(work, prepared, points, shaded.visibility, shaded);
}

std::vector<WorkAmount> work(const SoftShadowMap& settings, const MaskShape& shape)
{
    double texels = 0;
    for (const MaskShape::Map& given : shape.occluders) {
        const MapSize map = reduced_size(given.width, given.height, settings.resolution);
        texels += static_cast<double>(map.width) * map.height * ((settings.sides == Sides::both ? 2 : 1) + settings.layers);
    }
    std::vector<WorkAmount> amounts;
    double points = shape.pixels();
    if (settings.project) {
        points = static_cast<double>(settings.project_resolution) * settings.project_resolution;
        amounts.push_back({"technique.project_resolution", points, WorkAmount::Unit::receivers, "pixels"});
    }
    amounts.push_back(projections.of(texels * points));
    return amounts;
}

std::vector<opencl::Specialisation> specialisations(const SoftShadowMap& settings, int lanes) { return {program(settings, lanes)}; }

DeviceBuffers device_buffers(const SoftShadowMap& settings)
{
    if (!settings.project) return {};
    return {.prepare = {},
            .shade =
                Error(ErrorCode::unsupported, "project renders the receivers from the light on the host and cannot shade device buffers",
                      "set project to false")};
}

} // namespace penumbra
