#include "technique/soft_shadow_union.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <penumbra/error.hpp>

#include "technique/tiling.hpp"

namespace penumbra {
namespace {

// How much of the light's width a patch may hide that stands for smaller ones: so many times the tolerance. Measured
// (docs/tolerance.md): without such patches the largest differences are the same.
constexpr double coarse_per_tolerance = 1;
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
using LightRows = std::array<cl_uint, LIGHT_SIDE>;
LightRows rows_of(LightShape shape)
{
    LightRows rows{};
    for (unsigned k = 0; k < LIGHT_SIDE; ++k)
        for (unsigned i = 0; i < LIGHT_SIDE; ++i) {
            const auto [u, v] = sample_place(i, k);
            if (shape == LightShape::rectangle || (2 * u - 1) * (2 * u - 1) + (2 * v - 1) * (2 * v - 1) <= 1) rows[k] |= 1u << i;
        }
    return rows;
}
const LightRows& light_rows(LightShape shape)
{
    static const LightRows rectangle = rows_of(LightShape::rectangle), disc = rows_of(LightShape::disc);
    return shape == LightShape::rectangle ? rectangle : disc;
}

// The texels of all maps. Where more is known of them than a depth, by a larger map or by samples, a map becomes two: the nearest surfaces of its texels, and
// those behind them.
void add_texels(opencl::Work& work, const UnionMaps& maps, const OccluderView& view, const opencl::Specialisation& program, PreparedUnion& prepared)
{
    const MapSize from = maps.from, size = maps.size;
    const std::size_t count = count_of(size), given = maps.depth.size();
    const bool reduced = count_of(from) > count, sampled = !reduced && maps.fine.size() == given;
    const std::size_t all = (reduced || sampled ? 2 : 1) * given;
    if (std::max(all * count, count_of(from)) > std::numeric_limits<cl_int>::max())
        throw Error::at(ErrorCode::too_large, "technique.resolution", "comes to " + std::to_string(all * count) + " texels of all maps", "expected less than 2^31, from maps of less than that");
    prepared.maps = static_cast<int>(all);
    prepared.texels = work.buffer<cl_float2>(all * count, "occluder texels");
    if (reduced || sampled) prepared.parts = work.buffer<cl_float4>(all * count, "covered parts of texels");
    const cl_float2 gaps = joining_gap(view);
    const float gap = std::min(gaps.s[0], gaps.s[1]);
    const auto disparities_of = [&](const cl::Buffer& depth, std::size_t samples) {
        auto disparities = work.buffer<float>(samples, "disparities");
        work.launch(program, "disparities_of_map", {samples, 1}, {256, 1}, samples * 8, static_cast<cl_int>(samples), depth, disparities);
        return disparities;
    };
    for (std::size_t i = 0; i < given; ++i) {
        const auto begin = static_cast<cl_int>(i * count), second = static_cast<cl_int>((given + i) * count);
        if (reduced)
            work.launch(program, "surfaces_of_texels", grid_of(size), {16, 4}, count_of(from) * 4 + count * 48, dimensions(from), disparities_of(maps.depth[i], count_of(from)), dimensions(size),
                        begin, second, gap, prepared.texels, prepared.parts);
        else if (sampled)
            work.launch(program, "surfaces_of_samples", grid_of(size), {16, 4}, maps.fine_samples * 4 + count * 56, dimensions(size), begin, second, gap, maps.fine_side, maps.blocks, maps.depth[i],
                        disparities_of(maps.fine[i], maps.fine_samples), prepared.texels, prepared.parts);
        else
            work.launch(program, "texels_of_map", grid_of(size), {16, 8}, count * 12, dimensions(size), begin, maps.depth[i], prepared.texels);
    }
}

// Sides of a work-group that joins what lies below one of the last level's patches.
constexpr std::array<std::size_t, 2> joining{8, 8};

// The patches of all maps, and their greatest disparity.
void add_patches(opencl::Work& work, const UnionMaps& maps, const OccluderView& view, const opencl::Specialisation& program, PreparedUnion& prepared)
{
    const std::vector<MapSize> sizes = level_sizes(maps.size);
    const std::size_t texels = count_of(maps.size), count = static_cast<std::size_t>(prepared.maps), last = count_of(sizes.back());
    for (std::size_t level = 1; level < sizes.size(); ++level) prepared.above += count_of(sizes[level]);
    prepared.edges = work.buffer<cl_float4>(count * texels, "occluder texels' edges");
    prepared.texel_reach = work.buffer<float>(count * texels, "occluder texels' reach");
    prepared.reach = work.buffer<float>(count * prepared.above, "micro-patches' reach");
    prepared.patches = work.buffer<MicroPatch>(count * prepared.above, "micro-patches");
    std::vector<cl_int> others(maps.other.begin(), maps.other.end());
    others.resize(count, -1); // a surface behind another one: its other side is not told
    const auto other = work.lend(std::span<const cl_int>(others), "maps of the other sides");
    const auto nearest = work.buffer<float>(count * last, "greatest disparities");

    const cl_int2 size = dimensions(maps.size);
    const auto all = static_cast<cl_int>(count), above = static_cast<cl_int>(prepared.above);
    const auto width = static_cast<std::size_t>(sizes[1].width), height = static_cast<std::size_t>(sizes[1].height);
    work.launch(program, "micro_patches", {width, height * count}, {16, 4}, count * texels * (28 + sizeof(MicroPatch) / 4), size, all, above, static_cast<float>(maps.precision), joining_gap(view),
                static_cast<cl_int>(static_cast<bool>(prepared.parts)), other, prepared.texels, prepared.parts, prepared.edges, prepared.texel_reach, prepared.reach, prepared.patches);
    work.launch(program, "joined_patches", {static_cast<std::size_t>(sizes.back().width) * joining[0], static_cast<std::size_t>(sizes.back().height) * count * joining[1]}, joining,
                count * prepared.above * sizeof(MicroPatch), size, all, above, prepared.reach, prepared.patches, nearest);
    const cl_float2 moves{{0.5f / (view.light_scale_x * view.texel_x), 0.5f / (view.light_scale_y * view.texel_y)}};
    work.launch(program, "solid_patches", {prepared.above, count}, {64, 1}, count * prepared.above * sizeof(MicroPatch), size, all, above, moves, prepared.reach, prepared.patches);
    for (const float reach : work.read(nearest)) prepared.nearest = std::max(prepared.nearest, reach);
}

} // namespace

opencl::Specialisation union_program(int lanes)
{
    return {"soft_shadow_union.cl",
            {{"LANES", std::to_string(lanes)}, {"ITEM_ROWS", std::to_string(item_rows(lanes))}, {"TILE_ROWS", std::to_string(tile_rows)}}};
}

bool shows_more(opencl::Work& work, const cl::Buffer& depth, std::span<const cl::Buffer> others, std::size_t count)
{
    const opencl::Specialisation program = union_program(work.context().quirks().lanes);
    const auto unshown = work.buffer<float>(count, "depth that other maps do not show");
    constexpr std::array<cl_int, 1> none{0};
    opencl::Buffer<cl_int> some;
    for (std::size_t i = 0; i < others.size(); ++i) {
        // Of the last alone: what is left when all are taken off.
        some = work.upload(std::span<const cl_int>(none), "whether something is left");
        work.launch(program, "unshown_depth", {count, 1}, {256, 1}, count * 12, static_cast<cl_int>(count), i == 0 ? depth : unshown.memory(), others[i], unshown, some);
    }
    return work.read(some).front() != 0;
}

void set_emission(opencl::Work& work, const Image* emission, PreparedUnion& prepared)
{
    prepared.channels = emission ? emission->channels : 0;
    // The program wants a buffer.
    std::vector<float> shares(static_cast<std::size_t>(std::max(prepared.channels, 1)) * LIGHT_SIDE * LIGHT_SIDE);
    if (emission) {
        const EmissionSums sums = emission_sums(emission, LIGHT_SIDE);
        const EmissionPart whole = emission_part(sums, 0, 0, 1);
        for (std::size_t k = 0; k < LIGHT_SIDE; ++k)
            for (std::size_t i = 0; i < LIGHT_SIDE; ++i) {
                const auto middle = [](std::size_t cell) { return (2. * static_cast<double>(cell) + 1) / LIGHT_SIDE - 1; };
                const EmissionPart cell = emission_part(sums, middle(i), middle(k), 1. / LIGHT_SIDE);
                for (std::size_t c = 0; c < static_cast<std::size_t>(prepared.channels); ++c)
                    shares[(c * LIGHT_SIDE + k) * LIGHT_SIDE + i] = static_cast<float>(cell.light[c] / whole.light[c]);
            }
    }
    prepared.emission = work.upload(std::span<const float>(shares), "a texture's share of each sample");
}

PreparedUnion prepare_union(opencl::Work& work, const UnionMaps& maps, const OccluderView& view)
{
    const opencl::Specialisation program = union_program(work.context().quirks().lanes);
    PreparedUnion prepared;
    const LightRows& rows = light_rows(maps.shape);
    prepared.light_rows = work.lend(std::span<const cl_uint>(rows), "samples of the light");
    for (const cl_uint row : rows) prepared.light_samples += std::popcount(row);
    set_emission(work, maps.emission, prepared);
    add_texels(work, maps, view, program, prepared);
    add_patches(work, maps, view, program, prepared);
    return prepared;
}

void shade_union(opencl::Work& work, const PreparedUnion& prepared, const OccluderView& view, const UnionShading& shading, const ReceiverPoints& receivers,
                 const opencl::Buffer<cl_float8>& bounds, const cl::Buffer& visibility, const opencl::Buffer<cl_uint>& evaluated)
{
    const int lanes = work.context().quirks().lanes;
    const Tiling tiling = tiling_of(receivers.view, lanes);
    work.launch(union_program(lanes), "soft_shadow_union", tiling.items, tiling.group, tiling.bytes + prepared.patches.bytes(), receivers.view, view, static_cast<cl_int>(prepared.maps),
                static_cast<cl_int>(prepared.above), prepared.nearest, static_cast<float>(shading.bias), static_cast<float>(std::max(shading.precision, receivers.precision)),
                static_cast<cl_int>(receivers.has_planes), static_cast<cl_int>(receivers.is_list && lanes > 1), static_cast<float>(coarse_per_tolerance * shading.tolerance), prepared.reach,
                prepared.patches, prepared.texels, prepared.edges, prepared.texel_reach, prepared.parts, bounds, receivers.xi, receivers.eta, receivers.d, receivers.planes, prepared.light_rows,
                static_cast<cl_int>(prepared.light_samples), static_cast<cl_int>(prepared.channels), prepared.emission, visibility, evaluated, work.stop());
}

} // namespace penumbra
