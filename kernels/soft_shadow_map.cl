// Soft Shadow Maps: micro-patch back-projection (Atty, Holzschuch, Lapierre, Hasenfratz, Hansen, Sillion 2006, Section 3).
//
// Specialisation constants
//   LANES        receivers that a work-item holds in a vector: 16 or 8 on CPU devices, 1 on GPUs
//   ITEM_ROWS    rows of receivers that a work-item owns: TILE_ROWS on CPU devices, 1 on GPUs
//   TILE_ROWS    rows of a tile; a tile is TILE_WIDTH x TILE_ROWS receivers and shares one search
//   ACCUMULATOR  what shares are summed in (common/choices.h): BINARY32, COMPENSATED (Kahan), BINARY16 (emulated; Appendix A)
//
// Precision: strict IEEE arithmetic, one correctly rounded division a pair. A share of the light is off by less than 2^-19 where the
// back-projected texel is no wider than the light (derived in tests/oracle).
#include "common/choices.h"
#include "common/shared.h"
#include "occluders.cl"
#include "receivers.cl"
#include "common/lanes.clh"
#include "common/half_rounding.clh"
#include "common/own_surface.clh"
#include "common/stop.clh"

// From which disparity on an occluder counts for a receiver whose own plane is not known: d + bias.
//
// A receiver on the occluder map's own surface must not be shadowed by the stairs that the micro-patches make of that surface. Take the
// surface as a plane with disparity steps (sx, sy) a texel, the receiver on it, and D = d_texel - d_receiver. A texel reaches the light only
// where |a - xi| <= h/2 + D/(2k) on both axes (the penumbra extent), and D = gx (a - xi) + gy (b - eta), so with g h = s
//     D (1 - sx / (2 kx hx) - sy / (2 ky hy)) <= (sx + sy) / 2.
// No texel of the plane counts, then, if the limit is that far above. Where the bracket is not positive the light's own plane is edge-on to
// the surface and no bound exists; it is held at 1/4 (a bias of two texel steps).
// Which texels are of the receiver's surface: common/own_surface.clh. Elsewhere only rounding counts.
inline floatn limits_of(const OccluderView occluders, const float bias, const float precision, __global const float2* texels,
                        __global const float2* steps, const floatn xi, const floatn eta, const floatn d, const intn known)
{
    float column[LANES], row[LANES], disparity[LANES], step_x[LANES], step_y[LANES];
    int skipped[LANES];
    store_int_lanes(known, skipped);
    store_lanes((xi + 1.0f) * (0.5f * occluders.width), column);
    store_lanes((1.0f - eta) * (0.5f * occluders.height), row);
    store_lanes(d, disparity);
    for (int lane = 0; lane < LANES; ++lane) {
        const float2 own = skipped[lane] ? (float2)(0.0f) : own_steps((int2)(occluders.width, occluders.height), texels, steps, (float2)(column[lane], row[lane]), disparity[lane], precision);
        step_x[lane] = own.x;
        step_y[lane] = own.y;
    }

    const floatn sx = load_lanes(step_x), sy = load_lanes(step_y);
    const floatn bracket = 1.0f - (sx * occluders.edge_on_x + sy * occluders.edge_on_y);
    const floatn slope = bias * 0.5f * (sx + sy) / select_lanes((floatn)(0.25f), bracket, bracket > 0.25f);
    return d + (8.0f * 0x1p-24f + 2.0f * precision) * d + slope;
}

// From which disparity on occluders count for receivers: above `least`, and above their own plane, which is level + slope_xi xi + slope_eta eta.
// A texel of the plane itself lies on it at the texel's middle; half a texel's steps more leave room for surfaces that bend.
// Where no plane is known the slopes are 0.
typedef struct {
    floatn least, level, slope_xi, slope_eta;
} Limits;

inline Limits limits_with_planes(const OccluderView occluders, const float bias, const float precision, const int has_planes, __global const float2* texels,
                                 __global const float2* steps, const floatn slope_xi, const floatn slope_eta, const floatn xi, const floatn eta, const floatn d)
{
    const intn known = has_planes ? slope_xi != NO_PLANE : (intn)(0);
    const Limits flat = {limits_of(occluders, bias, precision, texels, steps, xi, eta, d, known), (floatn)(-MAXFLOAT), (floatn)(0.0f), (floatn)(0.0f)};
    if (!has_planes) return flat;
    const floatn gx = select_lanes((floatn)(0.0f), slope_xi, known), gy = select_lanes((floatn)(0.0f), slope_eta, known);
    const floatn least = d + (8.0f * 0x1p-24f + 2.0f * precision) * d;
    const floatn level = least + bias * 0.5f * (fabs(gx) * occluders.texel_x + fabs(gy) * occluders.texel_y) - gx * xi - gy * eta;
    const Limits limits = {select_lanes(flat.least, least, known), select_lanes(flat.level, level, known), gx, gy};
    return limits;
}

// Adds u v to a sum. With binary32 the product is not rounded on its own.
#if ACCUMULATOR == ACCUMULATOR_BINARY32
#define ACCUMULATE(sum, lost, u, v) (sum) = fma(u, v, sum)
#elif ACCUMULATOR == ACCUMULATOR_COMPENSATED
// Kahan: `lost` carries what rounding took from the sum so far.
#define ACCUMULATE(sum, lost, u, v)                                                                                                                \
    {                                                                                                                                              \
        const floatn wanted = fma(u, v, -(lost));                                                                                                  \
        const floatn next = (sum) + wanted;                                                                                                        \
        (lost) = (next - (sum)) - wanted;                                                                                                          \
        (sum) = next;                                                                                                                              \
    }
#else
// Blending into a 16-bit buffer: the fragment's value and the sum are both rounded to binary16.
#define ACCUMULATE(sum, lost, u, v) (sum) = round_to_half((sum) + round_to_half((u) * (v)))
#endif

// What a tile's search needs of the occluder map and the light.
typedef struct {
    float8 box;                // of the tile's receivers, as tile_bounds wrote it
    float2 half_inverse_scale; // 1 / (2 k)
    float2 texel;              // width and height in xi and eta
} Search;

// How far the penumbra of a texel at disparity `nearest` reaches beyond its edges on the tile's furthest receivers (through a
// point at d_p a receiver sees the light e = (d - d_p) / (2 k) to either side). Widened by 2^-20, which covers the rounding of this search and
// of the pairs that it spares: a texel that it drops would have added exactly 0. Negative: not above the furthest receiver, so none.
inline float2 penumbra_extent(const Search search, const float nearest)
{
    const float rise = nearest - search.box.s4;
    const float2 extent = rise * search.half_inverse_scale;
    return rise > 0.0f ? fma((float2)(0x1p-20f), 1.0f + extent, extent) : (float2)(-1.0f);
}

// The cells (texels, blocks, superblocks) whose penumbra can meet the tile's box: (first x, first y, last x, last y), the last ones not
// included. Cell (i, j) of size `cell` lies at xi = i cell.x - 1 and eta = 1 - (j + 1) cell.y; none holds anything nearer than `nearest`. Only cells
// from `low` to below `high`. The 1/16 of a cell covers the rounding of places: at 65536 texels a side, 3 roundings of 2^-24 come to 0.012.
inline int4 window(const Search search, const float nearest, const float2 cell, const int2 low, const int2 high)
{
    const float2 extent = penumbra_extent(search, nearest);
    if (extent.x < 0.0f) return (int4)(0);
    const float2 first = (float2)(search.box.s0 - extent.x + 1.0f, 1.0f - search.box.s3 - extent.y) / cell - (17.0f / 16.0f);
    const float2 last = (float2)(search.box.s1 + extent.x + 1.0f, 1.0f - search.box.s2 + extent.y) / cell + (17.0f / 16.0f);
    const float2 lowest = convert_float2(low), highest = convert_float2(high);
    return (int4)(convert_int2(ceil(clamp(first, lowest, highest))), convert_int2(floor(clamp(last, lowest, highest))));
}

// A texel that can hide some of the light from the tile, and where its left and right edges lie.
typedef struct {
    float d, covered, a0, a1, middle;
} Patch;

// Adds the shares of a row of patches for LANES receivers (3.4 and 4.2: back-project, intersect, multiply).
//     u(a) = 1/2 + (a - xi) k / (d - d_p)      on a light scaled to [0, 1]
// N.B. Every edge is projected on its own: neighbours then share it to the bit. u(a1) = u(a0) + h k / (d - d_p) would spare a subtraction but move
// the edge by 2^-24 of the texel, which is more than the whole light when that is a point, and a receiver on a border would see between texels.
inline void add_patches(floatn* sum, floatn* lost, const Patch* patches, const int count, const float b0, const float b1, const float2 scale,
                        const floatn xi, const floatn eta, const floatn d, const Limits limits)
{
    const floatn below = b0 - eta, above = b1 - eta;
    const floatn plane = fma((floatn)(0.5f * (b0 + b1)), limits.slope_eta, limits.level);
    floatn total = *sum, rest = *lost;
    for (int i = 0; i < count; ++i) {
        const Patch patch = patches[i];
        const floatn reach = 1.0f / (patch.d - d);
        const floatn du = scale.x * reach, dv = scale.y * reach;
        const floatn u = saturate(fma(patch.a1 - xi, du, (floatn)(0.5f))) - saturate(fma(patch.a0 - xi, du, (floatn)(0.5f)));
        const floatn v = saturate(fma(above, dv, (floatn)(0.5f))) - saturate(fma(below, dv, (floatn)(0.5f)));
        const intn before = (patch.d > limits.least) & (patch.d > fma((floatn)(patch.middle), limits.slope_xi, plane));
        const floatn counted = select_lanes((floatn)(0.0f), u, before);
        ACCUMULATE(total, rest, counted, v * patch.covered);
    }
    *sum = total;
    *lost = rest;
}

// The texels of row j from `first` to below `last` that are above the tile's furthest receiver; at most BLOCK.
inline int patches_of_row(Patch* patches, __global const float2* texels, const int width, const Search search, const int j, const int first, const int last)
{
    int found = 0;
    for (int i = first; i < last; ++i) {
        const float2 t = texels[j * width + i];
        if (!(t.x > search.box.s4)) continue;
        patches[found].d = t.x;
        patches[found].covered = t.y;
        patches[found].a0 = i * search.texel.x - 1.0f;
        patches[found].a1 = (i + 1) * search.texel.x - 1.0f;
        patches[found].middle = (i + 0.5f) * search.texel.x - 1.0f;
        ++found;
    }
    return found;
}

// Writes LANES values of a row, or as many of them as lie in it; with `merge` where they are smaller than what is there.
inline void write_visibility(__global float* to, const floatn seen, const int left, const int merge)
{
    if (left >= LANES) {
        const floatn before = merge ? load_lanes(to) : seen;
        store_lanes(select_lanes(before, seen, seen < before), to);
        return;
    }
    float lanes[LANES];
    store_lanes(seen, lanes);
    for (int lane = 0; lane < left; ++lane) to[lane] = merge && to[lane] < lanes[lane] ? to[lane] : lanes[lane];
}

// soft_shadow_map: the share of the light that each receiver sees past the micro-patches of one occluder map.
//
//   nearest                     the greatest disparity on the map
//   texels [height][width]      (disparity, covered share) of the occluder map; blocks, superblocks: its pyramid's two levels
//   steps [height][width]       disparity steps of the map's surface
//   bounds [tiles]              boxes of the tiles of receivers
//   bias, precision             see limits_of
//   has_planes, slope_xi, slope_eta   the receivers' own planes (receiver_planes), where they are known
//   visibility [height][width]  1 - occlusion, 0 to 1. With `merge` the smaller of that and what is there (3.5: the larger occlusion of two maps)
//   evaluated [tiles]           texels that were evaluated against the tile's receivers, added to what is there with `merge`
//   stop                        common/stop.clh, asked between superblocks
//
// Launched over work-items, (stride / LANES) x (rows / ITEM_ROWS). Texels are added in one order, whatever the tile, so the same receiver
// gets the same bits under any tiling.
__kernel void soft_shadow_map(const ReceiverView receivers, const OccluderView occluders, const int merge, const float nearest, const float bias,
                              const float precision, const int has_planes, __global const float2* restrict texels, __global const float2* restrict steps,
                              __global const float* restrict blocks, __global const float* restrict superblocks, __global const float8* restrict bounds,
                              __global const float* restrict xi, __global const float* restrict eta, __global const float* restrict d,
                              __global const float* restrict slope_xi, __global const float* restrict slope_eta, __global float* restrict visibility,
                              __global uint* restrict evaluated, __global const volatile int* stop)
{
    const int x = get_global_id(0) * LANES, y = get_global_id(1) * ITEM_ROWS;
    if (x >= receivers.stride || y >= receivers.rows) return;
    const int tile = (y / TILE_ROWS) * (receivers.stride / TILE_WIDTH) + x / TILE_WIDTH;

    floatn sum[ITEM_ROWS], lost[ITEM_ROWS];
    Limits limits[ITEM_ROWS];
    for (int row = 0; row < ITEM_ROWS; ++row) sum[row] = lost[row] = (floatn)(0.0f);
    uint count = 0;

    const float2 scale = (float2)(occluders.light_scale_x, occluders.light_scale_y);
    const Search search = {bounds[tile], 0.5f / scale, (float2)(occluders.texel_x, occluders.texel_y)};
    const int2 size = (int2)(occluders.width, occluders.height);
    const int2 block_count = (size + (BLOCK - 1)) / BLOCK, super_count = (block_count + (BLOCK - 1)) / BLOCK;

    // Down the pyramid: superblocks, blocks, texels, each only where a penumbra can meet the tile.
    const int4 supers = window(search, nearest, search.texel * (BLOCK * BLOCK), (int2)(0), super_count);
    for (int s = supers.y * super_count.x; s < supers.w * super_count.x; ++s) {
        const int2 super = (int2)(s % super_count.x, s / super_count.x);
        if (super.x < supers.x || super.x >= supers.z) continue;
        if (stopped(stop)) return;
        const int2 low = super * BLOCK;
        const int4 inside = window(search, superblocks[s], search.texel * BLOCK, low, min(low + BLOCK, block_count));
        for (int by = inside.y; by < inside.w; ++by)
            for (int bx = inside.x; bx < inside.z; ++bx) {
                const int2 first = (int2)(bx, by) * BLOCK;
                const int4 near = window(search, blocks[by * block_count.x + bx], search.texel, first, min(first + BLOCK, size));
                for (int j = near.y; j < near.w; ++j) {
                    Patch patches[BLOCK];
                    const int found = patches_of_row(patches, texels, size.x, search, j, near.x, near.z);

                    // Most tiles never get here, so the limits wait for the first that does.
                    const bool first_found = count == 0 && found > 0;
                    count += found;
                    for (int row = 0; row < ITEM_ROWS && found > 0; ++row) {
                        const int at = (y + row) * receivers.stride + x;
                        const floatn own_xi = load_lanes(xi + at), own_eta = load_lanes(eta + at), own_d = load_lanes(d + at);
                        if (first_found)
                            limits[row] = limits_with_planes(occluders, bias, precision, has_planes, texels, steps, has_planes ? load_lanes(slope_xi + at) : own_d,
                                                             has_planes ? load_lanes(slope_eta + at) : own_d, own_xi, own_eta, own_d);
                        add_patches(&sum[row], &lost[row], patches, found, 1.0f - (j + 1) * search.texel.y, 1.0f - j * search.texel.y, scale, own_xi,
                                    own_eta, own_d, limits[row]);
                    }
                }
            }
    }

    // Overlapping patches may sum to more than the whole light.
    if (merge && count == 0) return;
    for (int row = 0; row < ITEM_ROWS && y + row < receivers.height; ++row)
        write_visibility(visibility + (y + row) * receivers.width + x, 1.0f - saturate(sum[row]), receivers.width - x, merge);
    if (x % TILE_WIDTH == 0 && y % TILE_ROWS == 0) evaluated[tile] = merge ? evaluated[tile] + count : count;
}
