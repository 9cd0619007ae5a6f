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
#include "common/patch_limits.clh"
#include "common/patch_search.clh"
#include "common/stop.clh"

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
    const floatn plane = fma((floatn)(0.5f * (b0 + b1)), limits.lean_eta, -limits.level);
    floatn total = *sum, rest = *lost;
    for (int i = 0; i < count; ++i) {
        const Patch patch = patches[i];
        const floatn reach = 1.0f / (patch.d - d);
        const floatn du = scale.x * reach, dv = scale.y * reach;
        const floatn u = saturate(fma(patch.a1 - xi, du, (floatn)(0.5f))) - saturate(fma(patch.a0 - xi, du, (floatn)(0.5f)));
        const floatn v = saturate(fma(above, dv, (floatn)(0.5f))) - saturate(fma(below, dv, (floatn)(0.5f)));
        const intn before = (patch.d > limits.least) & (fma((floatn)(patch.middle), limits.lean_xi, plane) > limits.facing * patch.d);
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

// soft_shadow_map: the share of the light that each receiver sees past the micro-patches of one occluder map.
//
//   nearest                     the greatest disparity on the map
//   texels [height][width]      (disparity, covered share) of the occluder map; blocks, superblocks: its pyramid's two levels
//   steps [height][width]       disparity steps of the map's surface
//   bounds [tiles]              boxes of the tiles of receivers
//   bias, precision             see limits_of
//   has_planes, planes          the receivers' own planes (common/receiver_plane.clh), where they are known
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
                              __global const float* restrict planes, __global float* restrict visibility,
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
                            limits[row] = limits_with_planes(occluders, bias, bias, receiver_precisions(receivers, precision, own_d), planes_of(has_planes, planes, receivers.stride * receivers.rows, at), texels,
                                                             steps, own_xi, own_eta, own_d);
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
