// Soft Shadow Maps with a union: which of 32 x 32 samples of the light the micro-patches of one or two occluder maps hide, a bit each.
//
// Sums of patches (soft_shadow_map.cl) count twice what two patches hide, and leave gaps where they step; a union does neither. Which samples: see
// common/light_pattern.clh.
//
// Specialisation constants: LANES, ITEM_ROWS, TILE_ROWS as in soft_shadow_map.cl
#include "common/choices.h"
#include "common/shared.h"
#include "micro_patches.cl"
#include "receivers.cl"
#include "common/lanes.clh"
#include "common/light_pattern.clh"
#include "common/patch_limits.clh"
#include "common/patch_search.clh"
#include "common/stop.clh"

// --- Bits -----------------

// 1 / x to 2 units in the last place, x a positive normal number: a linear guess of the bits and three Newton steps, a third of a division's time.
inline floatn reciprocal(const floatn x)
{
    floatn r = as_floatn((intn)(0x7ef311c7) - as_intn(x));
    for (int step = 0; step < 3; ++step) r = fma(r, fma(-x, r, (floatn)(1.0f)), r);
    return r;
}

// Where an edge lies in the light, in samples: 0 to SIDE, and up to one beyond.
inline floatn samples_at(const float edge, const floatn place, const floatn disparity, const floatn own, const floatn least, const float scale)
{
    const floatn d = select_lanes(least, disparity, disparity > least);
    const floatn at = fma((edge - place) * scale, (float)SIDE * reciprocal(d - own), (floatn)(0.5f * SIDE));
    const floatn low = select_lanes((floatn)(-1.0f), at, at > (floatn)(-1.0f));
    return select_lanes((floatn)(SIDE + 1), low, low < (floatn)(SIDE + 1));
}

// x rounded down, for x from -2^22 to 2^22.
inline intn whole_below(const floatn x) { return -rounded_up(-x); }

inline int lowest_of(const intn v)
{
#if LANES == 1
    return v;
#else
#if LANES == 16
    const int8 a = min(v.lo, v.hi);
#else
    const int8 a = v;
#endif
    const int4 b = min(a.lo, a.hi);
    const int2 c = min(b.lo, b.hi);
    return min(c.x, c.y);
#endif
}

// A rectangle of patches of one surface that a tile's receivers see as one.
typedef struct {
    float a0, a1, b0, b1; // its edges in xi and eta
    float middle;         // its disparity, and those of its edges
    Along left, right, bottom, top;
} Rectangle;

// Where the outermost place of an edge lies, the one at the lower end of the axis (`before`: of that axis) or at the upper end: nothing shines between two
// rectangles that share the edge.
inline floatn outermost(const float edge, const floatn place, const Along along, const bool lower, const floatn own, const floatn least, const float scale)
{
    const intn below = (floatn)(edge) < place;
    const floatn d = lower ? select_lanes((floatn)(along.high), (floatn)(along.low), below) : select_lanes((floatn)(along.low), (floatn)(along.high), below);
    return samples_at(edge, place, d, own, least, scale);
}

// Sets what a rectangle hides from LANES receivers.
inline void hide(uintn* bits, const Rectangle p, const float2 scale, const floatn xi, const floatn eta, const floatn d, const Limits limits)
{
    const floatn plane = fma((floatn)(0.5f * (p.a0 + p.a1)), limits.slope_xi, fma((floatn)(0.5f * (p.b0 + p.b1)), limits.slope_eta, limits.level));
    const intn counts = (p.middle > limits.least) & (p.middle > plane);
    const floatn v_bottom = outermost(p.b0, eta, p.bottom, true, d, limits.least, scale.y), v_top = outermost(p.b1, eta, p.top, false, d, limits.least, scale.y);
    const floatn v0 = select_lanes(v_bottom, v_top, v_top < v_bottom), v1 = select_lanes(v_top, v_bottom, v_top < v_bottom);
    const floatn u_left = outermost(p.a0, xi, p.left, true, d, limits.least, scale.x), u_right = outermost(p.a1, xi, p.right, false, d, limits.least, scale.x);
    const floatn u0 = select_lanes(u_left, u_right, u_right < u_left), u1 = select_lanes(u_right, u_left, u_right < u_left);
    const intn some = counts & (u1 > (floatn)(0.0f)) & (u0 < (floatn)(SIDE)) & (v1 > (floatn)(0.0f)) & (v0 < (floatn)(SIDE)) & (u1 > u0) & (v1 > v0);
    if (NONE(some)) return;

    const intn from_column = in_64ths(select_lanes((floatn)(0.0f), u0, u0 > (floatn)(0.0f))), to_column = in_64ths(select_lanes((floatn)(SIDE), u1, u1 < (floatn)(SIDE)));
    // Rows from -1 to SIDE; of the first and the last, some columns.
    const intn first = whole_below(v0), last = whole_below(v1);
    const uintn low = ~columns_in(v0 - convert_floatn(first)), high = columns_in(v1 - convert_floatn(last));
    const int from = max(lowest_of(select_lanes((intn)(SIDE), first, some)), 0), to = min(-lowest_of(select_lanes((intn)(0), -last, some)), SIDE - 1);
    const intn begin = select_lanes((intn)(SIDE), first, some);
    for (int k = from; k <= to; ++k) {
        uintn columns = columns_from(from_column, k) & ~columns_from(to_column, k);
        columns &= select_lanes(select_lanes((uintn)(0u), (uintn)(0xffffffffu), begin < k), low, begin == k);
        columns &= select_lanes(select_lanes((uintn)(0u), (uintn)(0xffffffffu), last > k), high, last == k);
        bits[k] |= columns;
    }
}

// --- Patches that are seen as one -----------------

// How far the disparities of patches may differ that tile's receivers see as one: an edge, at most half the light from its middle, then moves by less than half a
// sample.
inline bool may_be_one(const Search search, const float reach, const float least) { return (reach - least) * (float)SIDE <= least - search.box.s5; }

// Beyond which nothing goes on, an edge lies in the middle of where it is.
inline Along edge_of(const Along along, const int joined)
{
    const Along edge = {joined ? along.low : 0.5f * (along.low + along.high), joined ? along.high : 0.5f * (along.low + along.high)};
    return edge;
}

inline Rectangle rectangle_of(const MicroPatch p, const int x, const int y, const float2 cell)
{
    const Rectangle rectangle = {(x + p.x0) * cell.x - 1.0f,
                                 (x + p.x1) * cell.x - 1.0f,
                                 1.0f - (y + p.y1) * cell.y,
                                 1.0f - (y + p.y0) * cell.y,
                                 p.middle,
                                 edge_of(p.left, p.flags & JOINED_LEFT),
                                 edge_of(p.right, p.flags & JOINED_RIGHT),
                                 edge_of(p.bottom, p.flags & JOINED_BOTTOM),
                                 edge_of(p.top, p.flags & JOINED_TOP)};
    return rectangle;
}

// Of a texel, which lies at x, y on its map; edges: its left, right, bottom and top one's disparities; part: what is covered, as MicroPatch has it.
inline Rectangle rectangle_of_texel(const float middle, const float4 edges, const float4 part, const int x, const int y, const float2 cell)
{
    const Rectangle rectangle = {(x + part.s0) * cell.x - 1.0f,
                                 (x + part.s1) * cell.x - 1.0f,
                                 1.0f - (y + part.s3) * cell.y,
                                 1.0f - (y + part.s2) * cell.y,
                                 middle,
                                 alone(edges.s0),
                                 alone(edges.s1),
                                 alone(edges.s2),
                                 alone(edges.s3)};
    return rectangle;
}

// Whether all of a patch counts for each of LANES receivers, or none of it.
inline bool on_one_side(const MicroPatch p, const Rectangle r, const Limits limits)
{
    const floatn middle = fma((floatn)(0.5f * (r.a0 + r.a1)), limits.slope_xi, fma((floatn)(0.5f * (r.b0 + r.b1)), limits.slope_eta, limits.level));
    const floatn half_plane = fma(fabs(limits.slope_xi), (floatn)(0.5f * (r.a1 - r.a0)), fabs(limits.slope_eta) * (0.5f * (r.b1 - r.b0)));
    const floatn low = middle - half_plane, high = middle + half_plane;
    const intn above = (p.least > limits.least) & (p.least > high), below = (p.reach <= limits.least) | (p.reach <= low);
    return ALL(above | below);
}

// Whether the penumbra of a cell may meet the box of a tile. x, y: of the level whose cells are so large.
inline bool meets(const Search search, const float reach, const float2 cell, const int x, const int y)
{
    const float2 extent = penumbra_extent(search, reach);
    return extent.x >= 0.0f && x * cell.x - 1.0f - extent.x <= search.box.s1 + cell.x * 0.0625f && (x + 1) * cell.x - 1.0f + extent.x >= search.box.s0 - cell.x * 0.0625f
           && 1.0f - (y + 1) * cell.y - extent.y <= search.box.s3 + cell.y * 0.0625f && 1.0f - y * cell.y + extent.y >= search.box.s2 - cell.y * 0.0625f;
}

// Whether nothing is left to hide from LANES receivers.
inline bool all_hidden(const uintn* bits, const floatn d)
{
    uintn hidden = (uintn)(0xffffffffu);
    for (int k = 0; k < SIDE; ++k) hidden &= bits[k];
    return ALL((as_intn(hidden) == (intn)(-1)) | (d == (floatn)(NO_RECEIVER)));
}

// The box of LANES receivers, as tile_bounds has it of a tile's.
inline float8 box_of(__global const float* xi, __global const float* eta, __global const float* d)
{
    float8 box = (float8)(NO_RECEIVER, -NO_RECEIVER, NO_RECEIVER, -NO_RECEIVER, NO_RECEIVER, 0.0f, 0.0f, 0.0f);
    for (int lane = 0; lane < LANES; ++lane) {
        if (d[lane] == NO_RECEIVER) continue;
        box.s0 = xi[lane] < box.s0 ? xi[lane] : box.s0;
        box.s1 = xi[lane] > box.s1 ? xi[lane] : box.s1;
        box.s2 = eta[lane] < box.s2 ? eta[lane] : box.s2;
        box.s3 = eta[lane] > box.s3 ? eta[lane] : box.s3;
        box.s4 = d[lane] < box.s4 ? d[lane] : box.s4;
        box.s5 = d[lane] > box.s5 ? d[lane] : box.s5;
    }
    return box;
}

// soft_shadow_union: the share of the light that each receiver sees past the micro-patches of `maps` occluder maps of one size.
//
//   coarse                             how much of the light's width a patch may hide that is not FULL
//   nearest                            the greatest disparity on the maps
//   texels, edges, texel_reach, parts [maps][height][width], reach, patches [maps][above]   as micro_patches.cl has them; parts: null where texels are whole
//   light_rows [SIDE], light_samples   which samples shine, and how many: all, of a disc those inside
//   the rest                           as in soft_shadow_map.cl
__kernel void soft_shadow_union(const ReceiverView receivers, const OccluderView occluders, const int maps, const int above, const float nearest, const float bias,
                                const float precision, const int has_planes, const int lists, const float coarse, __global const float* restrict reach,
                                __global const MicroPatch* restrict patches, __global const float2* restrict texels, __global const float4* restrict edges,
                                __global const float* restrict texel_reach, __global const float4* restrict parts, __global const float8* restrict bounds,
                                __global const float* restrict xi, __global const float* restrict eta, __global const float* restrict d,
                                __global const float* restrict slope_xi, __global const float* restrict slope_eta, __global const uint* restrict light_rows, const int light_samples,
                                __global float* restrict visibility, __global uint* restrict evaluated, __global const volatile int* stop)
{
    const int x = get_global_id(0) * LANES, y = get_global_id(1) * ITEM_ROWS;
    if (x >= receivers.stride || y >= receivers.rows) return;
    const int tile = (y / TILE_ROWS) * (receivers.stride / TILE_WIDTH) + x / TILE_WIDTH;

    const float2 scale = (float2)(occluders.light_scale_x, occluders.light_scale_y);
    const int2 size = (int2)(occluders.width, occluders.height);
    const Levels levels = levels_of(size);
    uint count = 0;
    const int together = lists ? 1 : ITEM_ROWS;
    for (int top = 0; top < ITEM_ROWS; top += together) {
        const Search search = {lists ? box_of(xi + (y + top) * receivers.stride + x, eta + (y + top) * receivers.stride + x, d + (y + top) * receivers.stride + x) : bounds[tile],
                               0.5f / scale, (float2)(occluders.texel_x, occluders.texel_y)};
        uintn bits[ITEM_ROWS][SIDE];
        bool over[ITEM_ROWS]; // nothing is left to hide
        for (int row = 0; row < together; ++row) {
            for (int k = 0; k < SIDE; ++k) bits[row][k] = (uintn)(~light_rows[k]);
            over[row] = false;
        }
        int rows_left = together;
        const int2 last_size = levels.sizes[PATCH_LEVELS];
        const int4 roots = window(search, nearest, search.texel * (1 << PATCH_LEVELS), (int2)(0), last_size);
        for (int map = 0; map < maps && rows_left > 0; ++map) {
            const int first_texel = map * size.x * size.y, first_patch = map * above;
            Limits limits[ITEM_ROWS];
            bool has_limits = false;
            for (int root = roots.y * last_size.x; root < roots.w * last_size.x && rows_left > 0; ++root) {
                if (root % last_size.x < roots.x || root % last_size.x >= roots.z) continue;
                if (stopped(stop)) return;
                // Depth first.
                int3 cells[3 * PATCH_LEVELS + 1]; // x, y, level
                int left = 1;
                cells[0] = (int3)(root % last_size.x, root / last_size.x, PATCH_LEVELS);
                while (left > 0 && rows_left > 0) {
                    const int3 at = cells[--left];
                    const int number = (at.z == 0 ? first_texel : first_patch) + levels.begins[at.z] + at.y * levels.sizes[at.z].x + at.x;
                    const float2 cell = search.texel * (1 << at.z);
                    if (!meets(search, at.z == 0 ? texel_reach[number] : reach[number], cell, at.x, at.y)) continue;
                    if (!has_limits) {
                        for (int row = 0; row < together; ++row) {
                            const int place = (y + top + row) * receivers.stride + x;
                            limits[row] = limits_with_planes(occluders, bias, precision, has_planes, texels + first_texel, 0,
                                                             load_lanes((has_planes ? slope_xi : d) + place), load_lanes((has_planes ? slope_eta : d) + place), load_lanes(xi + place),
                                                             load_lanes(eta + place), load_lanes(d + place));
                        }
                        has_limits = true;
                    }
                    bool whole = true;
                    Rectangle rectangle;
                    if (at.z == 0) {
                        rectangle = rectangle_of_texel(texels[number].x, edges[number], parts ? parts[number] : (float4)(0.0f, 1.0f, 0.0f, 1.0f), at.x, at.y, cell);
                    } else {
                        // A part of a patch will do where the patch is small, as the receivers see it.
                        __global const MicroPatch* const p = patches + number;
                        const float over_receivers = p->least - search.box.s5;
                        const bool small = cell.x * scale.x <= coarse * over_receivers && cell.y * scale.y <= coarse * over_receivers && p->reach - p->least <= coarse * over_receivers;
                        whole = small || (p->flags & SOLID) || ((p->flags & FULL) && may_be_one(search, p->reach, p->least));
                        if (whole) {
                            const MicroPatch patch = *p;
                            rectangle = rectangle_of(patch, at.x, at.y, cell);
                            for (int row = 0; row < together && whole; ++row) whole = over[row] || on_one_side(patch, rectangle, limits[row]);
                        }
                    }
                    if (!whole) {
                        for (int child = 0; child < 4; ++child) {
                            const int3 to = (int3)(2 * at.x + (child & 1), 2 * at.y + (child >> 1), at.z - 1);
                            if (to.x < levels.sizes[to.z].x && to.y < levels.sizes[to.z].y) cells[left++] = to;
                        }
                        continue;
                    }
                    count += together;
                    for (int row = 0; row < together; ++row) {
                        if (over[row]) continue;
                        const int place = (y + top + row) * receivers.stride + x;
                        const floatn own_d = load_lanes(d + place);
                        hide(bits[row], rectangle, scale, load_lanes(xi + place), load_lanes(eta + place), own_d, limits[row]);
                        if (at.z < 3 || !all_hidden(bits[row], own_d)) continue;
                        over[row] = true;
                        --rows_left;
                    }
                }
                for (int row = 0; row < together && has_limits; ++row)
                    if (!over[row] && all_hidden(bits[row], load_lanes(d + (y + top + row) * receivers.stride + x))) {
                        over[row] = true;
                        --rows_left;
                    }
            }
        }

        for (int row = top; row < top + together && y + row < receivers.height; ++row) {
            uintn hidden = (uintn)(0u);
            for (int k = 0; k < SIDE; ++k) hidden += popcount(bits[row - top][k]);
            write_visibility(visibility + (y + row) * receivers.width + x, convert_floatn((uintn)(SIDE * SIDE) - hidden) * (1.0f / light_samples), receivers.width - x, 0);
        }
    }
    if (x % TILE_WIDTH == 0 && y % TILE_ROWS == 0) evaluated[tile] = count;
}
