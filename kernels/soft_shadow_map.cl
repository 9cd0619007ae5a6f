// Soft Shadow Maps: micro-patch back-projection (Atty, Holzschuch, Lapierre, Hasenfratz, Hansen, Sillion 2006, Section 3).
//
// Specialisation constants
//   LANES        receivers that a work-item holds in a vector: 16 or 8 on CPU devices, 1 on GPUs
//   ITEM_ROWS    rows of receivers that a work-item owns: TILE_ROWS on CPU devices, 1 on GPUs
//   TILE_ROWS    rows of a tile; a tile is TILE_WIDTH x TILE_ROWS receivers and shares one search
//   ACCUMULATOR  0 binary32, 1 compensated (Kahan), 2 binary16 (emulated; Appendix A)
//
// Precision: strict IEEE arithmetic, one correctly rounded division a pair. A share of the light is off by less than 2^-19 where the
// back-projected texel is no wider than the light (derived in tests/oracle).
#include "common/shared.h"
#include "common/lanes.clh"
#include "common/half_rounding.clh"

// From which disparity on an occluder counts for a receiver: d + bias.
//
// A receiver on the occluder map's own surface must not be shadowed by the stairs that the micro-patches make of that surface. Take the
// surface as a plane with disparity steps (sx, sy) a texel, the receiver on it, and D = d_texel - d_receiver. A texel reaches the light only
// where |a - xi| <= h/2 + D/(2k) on both axes (the penumbra extent), and D = gx (a - xi) + gy (b - eta), so with g h = s
//     D (1 - sx / (2 kx hx) - sy / (2 ky hy)) <= (sx + sy) / 2.
// No texel of the plane counts, then, if the limit is that far above. Where the bracket is not positive the light's own plane is edge-on to
// the surface and no bound exists; it is held at 1/4 (a bias of two texel steps).
// A receiver is on the surface when its own texel's disparity differs by no more than one step each way can explain.
// Elsewhere only rounding counts: both disparities are right to a few units in the last place and to the depth's own `precision`.
inline floatn limits_of(const OccluderView occluders, const float bias, const float precision, __global const float2* texels,
                        __global const float2* steps, const floatn xi, const floatn eta, const floatn d)
{
    float column[LANES], row[LANES], surface[LANES], step_x[LANES], step_y[LANES];
    store_lanes((xi + 1.0f) * (0.5f * occluders.width), column);
    store_lanes((1.0f - eta) * (0.5f * occluders.height), row);
    for (int lane = 0; lane < LANES; ++lane) {
        const bool inside = column[lane] >= 0.0f && row[lane] >= 0.0f && column[lane] < (float)occluders.width && row[lane] < (float)occluders.height;
        const int texel = inside ? (int)row[lane] * occluders.width + (int)column[lane] : 0;
        surface[lane] = inside ? texels[texel].x : 0.0f;
        step_x[lane] = steps[texel].x;
        step_y[lane] = steps[texel].y;
    }

    const floatn own = load_lanes(surface), sx = load_lanes(step_x), sy = load_lanes(step_y);
    const floatn rounding = (8.0f * 0x1p-24f + 2.0f * precision) * d;
    const floatn bracket = 1.0f - (sx * occluders.edge_on_x + sy * occluders.edge_on_y);
    const floatn slope = bias * 0.5f * (sx + sy) / select_lanes((floatn)(0.25f), bracket, bracket > 0.25f);
    const floatn far = select_lanes((floatn)(0.0f), slope, fabs(own - d) <= sx + sy + rounding);
    return d + rounding + select_lanes((floatn)(0.0f), far, own > 0.0f);
}

// Adds u v to a sum. With binary32 the product is not rounded on its own.
#if ACCUMULATOR == 0
#define ACCUMULATE(sum, lost, u, v) (sum) = fma(u, v, sum)
#elif ACCUMULATOR == 1
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

// Whether a block of texels from (a0, b0) to (a1, b1), none nearer to the light than `nearest`, can hide any of the light from any receiver
// of a tile: its penumbra extent on the furthest receivers (algorithms.md: e = (d - d_p) / (2 k)) meets the tile's box. The extent is widened
// by 2^-20, which covers the rounding of this test and of the pairs it spares: a texel that it drops would have added exactly 0.
inline bool reaches(const float nearest, const float a0, const float a1, const float b0, const float b1, const float8 box, const float2 half_inverse_scale)
{
    const float rise = nearest - box.s4;
    if (!(rise > 0.0f)) return false;
    const float ex = rise * half_inverse_scale.x, ey = rise * half_inverse_scale.y;
    const float wide_x = fma(0x1p-20f, 1.0f + ex, ex), wide_y = fma(0x1p-20f, 1.0f + ey, ey);
    return a0 - wide_x <= box.s1 && a1 + wide_x >= box.s0 && b0 - wide_y <= box.s3 && b1 + wide_y >= box.s2;
}

// A texel that can hide some of the light from the tile, and where its left and right edges lie.
typedef struct {
    float d, covered, a0, a1;
} Patch;

// Adds the shares of a row of patches for LANES receivers (3.4 and 4.2: back-project, intersect, multiply).
//     u(a) = 1/2 + (a - xi) k / (d - d_p)      on a light scaled to [0, 1]
// N.B. Every edge is projected on its own: neighbours then share it to the bit. u(a1) = u(a0) + h k / (d - d_p) would spare a subtraction but move
// the edge by 2^-24 of the texel, which is more than the whole light when that is a point, and a receiver on a border would see between texels.
inline void add_patches(floatn* sum, floatn* lost, const Patch* patches, const int count, const float b0, const float b1, const float2 scale,
                        const floatn xi, const floatn eta, const floatn d, const floatn limit)
{
    const floatn below = b0 - eta, above = b1 - eta;
    floatn total = *sum, rest = *lost;
    for (int i = 0; i < count; ++i) {
        const Patch patch = patches[i];
        const floatn reach = 1.0f / (patch.d - d);
        const floatn du = scale.x * reach, dv = scale.y * reach;
        const floatn u = saturate(fma(patch.a1 - xi, du, (floatn)(0.5f))) - saturate(fma(patch.a0 - xi, du, (floatn)(0.5f)));
        const floatn v = saturate(fma(above, dv, (floatn)(0.5f))) - saturate(fma(below, dv, (floatn)(0.5f)));
        const floatn counted = select_lanes((floatn)(0.0f), u, patch.d > limit);
        ACCUMULATE(total, rest, counted, v * patch.covered);
    }
    *sum = total;
    *lost = rest;
}

// soft_shadow_map: the share of the light that each receiver sees past the micro-patches of one occluder map.
//
//   texels [height][width]      (disparity, covered share) of the occluder map; blocks, superblocks: its pyramid's two levels
//   steps [height][width]       disparity steps of the map's surface
//   bounds [tiles]              boxes of the tiles of receivers
//   bias, precision             see limits_of
//   visibility [height][width]  1 - occlusion, 0 to 1. With `merge` the smaller of that and what is there (3.5: the larger occlusion of two maps)
//   evaluated [tiles]           texels that were evaluated against the tile's receivers, added to what is there with `merge`
//
// Launched over work-items, (stride / LANES) x (rows / ITEM_ROWS). Texels are added in one order, whatever the tile, so the same receiver
// gets the same bits under any tiling.
__kernel void soft_shadow_map(const ReceiverView receivers, const OccluderView occluders, const int merge, const float bias, const float precision,
                              __global const float2* restrict texels, __global const float2* restrict steps, __global const float* restrict blocks, __global const float* restrict superblocks,
                              __global const float8* restrict bounds, __global const float* restrict xi, __global const float* restrict eta,
                              __global const float* restrict d, __global float* restrict visibility,
                              __global uint* restrict evaluated)
{
    const int x = get_global_id(0) * LANES, y = get_global_id(1) * ITEM_ROWS;
    if (x >= receivers.stride || y >= receivers.rows) return;
    const int tile = (y / TILE_ROWS) * (receivers.stride / TILE_WIDTH) + x / TILE_WIDTH;
    const float8 box = bounds[tile];

    floatn sum[ITEM_ROWS], lost[ITEM_ROWS], limit[ITEM_ROWS];
    for (int row = 0; row < ITEM_ROWS; ++row) sum[row] = lost[row] = (floatn)(0.0f);

    const float2 scale = (float2)(occluders.light_scale_x, occluders.light_scale_y);
    const float2 half_inverse_scale = 0.5f / scale;
    const float2 texel = (float2)(occluders.texel_x, occluders.texel_y);
    const int2 size = (int2)(occluders.width, occluders.height);
    const int2 block_count = (size + (BLOCK - 1)) / BLOCK;
    const int2 super_count = (block_count + (BLOCK - 1)) / BLOCK;
    uint count = 0;

    // Down the pyramid: superblocks, blocks, texels. Edge i of the map lies at xi = i * texel_x - 1 and at eta = 1 - i * texel_y.
    for (int s = 0; s < super_count.x * super_count.y; ++s) {
        const int2 super = (int2)(s % super_count.x, s / super_count.x);
        const int2 first_block = super * BLOCK, last_block = min(first_block + BLOCK, block_count);
        const int2 low = first_block * BLOCK, high = min(last_block * BLOCK, size);
        if (!reaches(superblocks[s], low.x * texel.x - 1.0f, high.x * texel.x - 1.0f, 1.0f - high.y * texel.y, 1.0f - low.y * texel.y, box, half_inverse_scale))
            continue;
        for (int by = first_block.y; by < last_block.y; ++by)
            for (int bx = first_block.x; bx < last_block.x; ++bx) {
                const int2 from = (int2)(bx, by) * BLOCK, to = min(from + BLOCK, size);
                if (!reaches(blocks[by * block_count.x + bx], from.x * texel.x - 1.0f, to.x * texel.x - 1.0f, 1.0f - to.y * texel.y,
                             1.0f - from.y * texel.y, box, half_inverse_scale))
                    continue;
                for (int j = from.y; j < to.y; ++j) {
                    // The texels of this row that matter to the tile, then all of them for each row of receivers.
                    const float b0 = 1.0f - (j + 1) * texel.y, b1 = 1.0f - j * texel.y;
                    Patch patches[BLOCK];
                    int found = 0;
                    for (int i = from.x; i < to.x; ++i) {
                        const float2 t = texels[j * size.x + i];
                        const float a0 = i * texel.x - 1.0f, a1 = (i + 1) * texel.x - 1.0f;
                        if (!reaches(t.x, a0, a1, b0, b1, box, half_inverse_scale)) continue;
                        patches[found].d = t.x;
                        patches[found].covered = t.y;
                        patches[found].a0 = a0;
                        patches[found].a1 = a1;
                        ++found;
                    }
                    // Most tiles never get here, so the limits wait for the first that does.
                    if (count == 0 && found > 0)
                        for (int row = 0; row < ITEM_ROWS; ++row) {
                            const int at = (y + row) * receivers.stride + x;
                            limit[row] = limits_of(occluders, bias, precision, texels, steps, load_lanes(xi + at), load_lanes(eta + at), load_lanes(d + at));
                        }
                    count += found;
                    for (int row = 0; row < ITEM_ROWS && found > 0; ++row) {
                        const int at = (y + row) * receivers.stride + x;
                        add_patches(&sum[row], &lost[row], patches, found, b0, b1, scale, load_lanes(xi + at), load_lanes(eta + at),
                                    load_lanes(d + at), limit[row]);
                    }
                }
            }
    }

    // Overlapping patches may sum to more than the whole light.
    for (int row = 0; row < ITEM_ROWS; ++row) {
        float seen[LANES];
        store_lanes(1.0f - saturate(sum[row]), seen);
        for (int lane = 0; lane < LANES; ++lane) {
            if (x + lane >= receivers.width || y + row >= receivers.height) continue;
            const int at = (y + row) * receivers.width + x + lane;
            visibility[at] = merge ? fmin(visibility[at], seen[lane]) : seen[lane];
        }
    }
    if (x % TILE_WIDTH == 0 && y % TILE_ROWS == 0) evaluated[tile] = merge ? evaluated[tile] + count : count;
}
