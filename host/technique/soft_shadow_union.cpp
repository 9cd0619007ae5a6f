#include "technique/soft_shadow_union.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "technique/tiling.hpp"

namespace penumbra {
namespace {

// How much of the light's width a patch may hide that stands for smaller ones: so many times the tolerance.
constexpr double coarse_per_tolerance = 6;
constexpr int patch_levels = 6; // PATCH_LEVELS of soft_shadow_union.cl

std::size_t count_of(MapSize size) { return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height); }
cl_int2 dimensions(MapSize size) { return {{size.width, size.height}}; }
std::array<std::size_t, 2> grid_of(MapSize size) { return {static_cast<std::size_t>(size.width), static_cast<std::size_t>(size.height)}; }

std::vector<MapSize> level_sizes(MapSize size)
{
    std::vector<MapSize> sizes{size};
    for (int level = 1; level <= patch_levels; ++level) sizes.push_back({(sizes.back().width + 1) / 2, (sizes.back().height + 1) / 2});
    return sizes;
}

// The step of disparity between two texels that lets half a texel of light through at the most, across and down.
cl_float2 gap_of(const OccluderView& view) { return {{view.light_scale_x * view.texel_x, view.light_scale_y * view.texel_y}}; }

// Where sample (i, k) of the light lies, 0 to 1 (kernels/common/light_pattern.clh).
std::pair<double, double> sample_place(unsigned i, unsigned k)
{
    constexpr std::array<std::uint32_t, 5> bits{LIGHT_COLUMN_BITS};
    unsigned reversed = 0, mapped = 0;
    for (unsigned b = 0; b < bits.size(); ++b) {
        reversed |= (k >> b & 1) << (4 - b);
        mapped |= (bits[b] >> i & 1) << b;
    }
    return {(i + (reversed + 0.5) / LIGHT_SIDE) / LIGHT_SIDE, (k + (mapped + 0.5) / LIGHT_SIDE) / LIGHT_SIDE};
}

// The samples that shine: all of a rectangle, of a disc those inside.
std::vector<cl_uint> light_rows(LightShape shape)
{
    std::vector<cl_uint> rows(LIGHT_SIDE, 0);
    for (unsigned k = 0; k < LIGHT_SIDE; ++k)
        for (unsigned i = 0; i < LIGHT_SIDE; ++i) {
            const auto [u, v] = sample_place(i, k);
            if (shape == LightShape::rectangle || (2 * u - 1) * (2 * u - 1) + (2 * v - 1) * (2 * v - 1) <= 1) rows[k] |= 1u << i;
        }
    return rows;
}

// One map on its way into patches.
struct Surfaces {
    OccluderMap map;
    opencl::Buffer<cl_float4> parts; // of a larger map: what the texels' surfaces cover
};

// A larger map becomes surfaces with what they cover of each texel: the mean of two surfaces is none of them.
Surfaces surfaces_of(opencl::Work& work, const UnionMaps& maps, const cl::Buffer& depth, const OccluderView& view, const opencl::Specialisation& program)
{
    const MapSize from = maps.from, size = maps.size;
    if (count_of(from) <= count_of(size)) return {.map = occluder_map(work, depth, from, size, Reduction::nearest, maps.precision, program), .parts = {}};
    Surfaces surfaces{.map = {.texels = work.buffer<cl_float2>(count_of(size), "occluder texels"), .steps = work.buffer<cl_float2>(count_of(size), "occluder slopes")},
                      .parts = work.buffer<cl_float4>(count_of(size), "covered parts of texels")};
    const cl_float2 gap = gap_of(view);
    work.launch(program, "surfaces_of_texels", grid_of(size), {16, 4}, count_of(from) * 4 + count_of(size) * 24, dimensions(from), depth, dimensions(size),
                std::min(gap.s[0], gap.s[1]), surfaces.map.texels, surfaces.parts);
    work.launch(program, "slope_steps", grid_of(size), {16, 8}, count_of(size) * 16, dimensions(size), static_cast<float>(maps.precision), surfaces.map.texels,
                surfaces.map.steps);
    return surfaces;
}

// The levels of map `number` above its texels.
void join_patches(opencl::Work& work, const PreparedUnion& prepared, const OccluderView& view, MapSize size, int number, const opencl::Specialisation& program)
{
    const std::vector<MapSize> sizes = level_sizes(size);
    std::size_t below = static_cast<std::size_t>(number) * prepared.per_map;
    for (std::size_t level = 1; level < sizes.size(); ++level) {
        const std::size_t begin = below + count_of(sizes[level - 1]);
        const float cells = std::ldexp(1.f, static_cast<int>(level));
        const cl_float2 moves{{0.5f / (view.light_scale_x * view.texel_x * cells), 0.5f / (view.light_scale_y * view.texel_y * cells)}};
        work.launch(program, "joined_patches", grid_of(sizes[level]), {16, 4}, count_of(sizes[level]) * 5 * sizeof(MicroPatch), dimensions(sizes[level - 1]),
                    dimensions(sizes[level]), static_cast<cl_int>(below), static_cast<cl_int>(begin), prepared.reach, prepared.patches);
        work.launch(program, "solid_patches", grid_of(sizes[level]), {16, 4}, count_of(sizes[level]) * 5 * sizeof(MicroPatch), dimensions(sizes[level]), moves,
                    static_cast<cl_int>(begin), prepared.reach, prepared.patches);
        below = begin;
    }
}

// The greatest disparity of all maps, from their last levels.
float nearest_of(opencl::Work& work, const PreparedUnion& prepared, MapSize size)
{
    const std::size_t last = count_of(level_sizes(size).back());
    float nearest = 0;
    for (int map = 1; map <= prepared.maps; ++map)
        for (const float reach : work.read(prepared.reach, static_cast<std::size_t>(map) * prepared.per_map - last, last)) nearest = std::max(nearest, reach);
    return nearest;
}

} // namespace

opencl::Specialisation union_program(int lanes)
{
    return {"soft_shadow_union.cl",
            {{"LANES", std::to_string(lanes)}, {"ITEM_ROWS", std::to_string(item_rows(lanes))}, {"TILE_ROWS", std::to_string(tile_rows)}}};
}

PreparedUnion prepare_union(opencl::Work& work, const UnionMaps& maps, const OccluderView& view)
{
    const opencl::Specialisation program = union_program(work.context().quirks().lanes);
    std::vector<Surfaces> surfaces;
    for (const cl::Buffer& depth : maps.depth) surfaces.push_back(surfaces_of(work, maps, depth, view, program));

    const std::size_t texels = count_of(maps.size), count = surfaces.size();
    PreparedUnion prepared{.texels = {}, .steps = {}, .reach = {}, .patches = {}, .light_rows = {}, .maps = static_cast<int>(count)};
    const std::vector<cl_uint> rows = light_rows(maps.shape);
    prepared.light_rows = work.upload(std::span<const cl_uint>(rows), "samples of the light");
    for (const cl_uint row : rows) prepared.light_samples += std::popcount(row);
    for (const MapSize level : level_sizes(maps.size)) prepared.per_map += count_of(level);
    prepared.texels = work.buffer<cl_float2>(count * texels, "occluder texels");
    prepared.steps = work.buffer<cl_float2>(count * texels, "occluder slopes");
    prepared.reach = work.buffer<float>(count * prepared.per_map, "micro-patches' reach");
    prepared.patches = work.buffer<MicroPatch>(count * prepared.per_map, "micro-patches");
    for (std::size_t i = 0; i < count; ++i) {
        const int other = maps.other[i];
        work.copy(surfaces[i].map.texels, prepared.texels, i * texels);
        work.copy(surfaces[i].map.steps, prepared.steps, i * texels);
        work.launch(program, "micro_patches", grid_of(maps.size), {16, 4}, texels * (16 + sizeof(MicroPatch)), dimensions(maps.size), static_cast<float>(maps.precision), gap_of(view),
                    static_cast<cl_int>(other >= 0), static_cast<cl_int>(static_cast<bool>(surfaces[i].parts)), static_cast<cl_int>(i * prepared.per_map), surfaces[i].map.texels,
                    other >= 0 ? surfaces[static_cast<std::size_t>(other)].map.texels.memory() : cl::Buffer(), surfaces[i].parts, prepared.reach, prepared.patches);
        join_patches(work, prepared, view, maps.size, static_cast<int>(i), program);
    }
    prepared.nearest = nearest_of(work, prepared, maps.size);
    return prepared;
}

void shade_union(opencl::Work& work, const PreparedUnion& prepared, const OccluderView& view, const UnionShading& shading, const ReceiverPoints& receivers,
                 const opencl::Buffer<cl_float8>& bounds, const cl::Buffer& visibility, const opencl::Buffer<cl_uint>& evaluated)
{
    const int lanes = work.context().quirks().lanes;
    const Tiling tiling = tiling_of(receivers.view, lanes);
    work.launch(union_program(lanes), "soft_shadow_union", tiling.items, tiling.group, tiling.bytes + prepared.patches.bytes(), receivers.view, view, static_cast<cl_int>(prepared.maps),
                static_cast<cl_int>(prepared.per_map), prepared.nearest, static_cast<float>(shading.bias), static_cast<float>(std::max(shading.precision, receivers.precision)),
                static_cast<cl_int>(receivers.has_planes), static_cast<cl_int>(receivers.is_list && lanes > 1), static_cast<float>(coarse_per_tolerance * shading.tolerance), prepared.reach,
                prepared.patches, prepared.texels, prepared.steps, bounds, receivers.xi, receivers.eta, receivers.d, receivers.slope_xi, receivers.slope_eta, prepared.light_rows,
                static_cast<cl_int>(prepared.light_samples), visibility, evaluated, work.stop());
}

} // namespace penumbra
