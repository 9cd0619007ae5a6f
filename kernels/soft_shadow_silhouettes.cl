// Soft shadow volumes with silhouettes from each receiver: which of the 32 x 32 samples of a rectangle light triangles hide, by counting (Laine, Aila, Assarsson,
// Lehtinen and Akenine-Moller: Soft Shadow Volumes for Ray Tracing, 2005).
//
//     N(s) = the number of triangles between receiver and sample s;  s is seen where N(s) = 0
//
// N changes only where a path over the light crosses an edge, as the receiver sees it, by as many triangles as lie on the edge's one side more than on its other:
// two at a silhouette, one at a border, none at the edges between. The path is the same to all samples: from the light's corner O up its left side to the sample's
// height, then right. N(O) is counted triangle by triangle. So one edge adds its number to all samples to its right, at heights that it spans; where it crosses the
// left side, also to all above.
//
// What must agree does so to the bit, and nothing leaks: an edge runs from its vertex of the lower number to the other, whichever triangle asks; heights are spanned
// half open, by each end's own height; on which side of O an edge passes is `left_of`, for edges and for triangles; which side of a triangle's plane the receiver is
// on is `inside`, for its edges and itself. Elsewhere rounding only moves an edge.
//
// Specialisation constants: LANES, ITEM_ROWS, TILE_ROWS as in soft_shadow_map.cl
//
// Light space here: origin O, x and y in the light's width and height, so that the light is [0, 1]^2. A receiver is its tangents t = p.xy / p.z and its disparity
// d = 1 / p.z. It sees e at (X, Y, W) = (e.xy - t e.z, 1 - e.z d) in homogeneous coordinates of the light; W is positive before the receiver.
#include "common/choices.h"
#include "common/shared.h"
#include "occluders.cl"
#include "receivers.cl"
#include "common/lanes.clh"
#include "common/light_pattern.clh"
#include "common/stop.clh"
#include "common/bits.clh"
#include "common/wedge_receivers.clh"

#define COUNTER_BITS 8       // of N: triangles before one sample, modulo 256
#define NEAREST 0x1p-20f     // the least W of an edge: what is nearer to the receiver's own depth covers less than the light's 2^-20
#define CHOSEN (LANES == 1 ? 256 : 1024) // edges that a tile's rows share; at least those of a group of groups

// --- Culling -----------------

// Receivers: t in [x0, x1] x [y0, y1], disparity in [d0, d1].
typedef struct {
    float x0, x1, y0, y1, d0, d1;
    float rounding, place, bias_x, bias_y; // see `inside`
    int culling;
} Area;

// What 16 boxes of points (x / z, y / z, 1 / z) show to the area, seen from any place of the light (`reach` 1) or from O alone (0). Rows of 16 floats: low and high
// x, low and high y, high 1 / z. A point is before (u, v) of the light for t = x / z - u (1 / z - d).
inline int16 boxes_reach(const Area area, __global const float* boxes, const float reach)
{
    const float16 x0 = vload16(0, boxes), x1 = vload16(1, boxes), y0 = vload16(2, boxes), y1 = vload16(3, boxes), near = vload16(4, boxes);
    const float16 rise = reach * ((near - area.d0) + 0x1p-18f * near);
    const float16 margin_x = 0x1p-18f * (fabs(x0) + fabs(x1)), margin_y = 0x1p-18f * (fabs(y0) + fabs(y1));
    return (near >= area.d0) & (x1 + margin_x >= area.x0) & (x0 - rise - margin_x <= area.x1) & (y1 + margin_y >= area.y0) & (y0 - rise - margin_y <= area.y1);
}

// The least and the greatest of products of two ranges are added to (low, high).
inline void add_product(float16* low, float16* high, const float16 n0, const float16 n1, const float t0, const float t1)
{
    const float16 a = n0 * t0, b = n0 * t1, c = n1 * t0, e = n1 * t1;
    *low += fmin(fmin(a, b), fmin(c, e));
    *high += fmax(fmax(a, b), fmax(c, e));
}

// Planes of ranges n0 to n1 (x, y, z, D): 1 where all of the area is inside (see `inside`) of all of them, -1 where it is outside, 0 where neither is certain.
inline int16 side_of_area(const Area area, const float16* n0, const float16* n1)
{
    float16 low = n0[2], high = n1[2];
    add_product(&low, &high, n0[0], n1[0], area.x0, area.x1);
    add_product(&low, &high, n0[1], n1[1], area.y0, area.y1);
    add_product(&low, &high, -n1[3], -n0[3], area.d0, area.d1);
    float16 most[4];
    for (int i = 0; i < 4; ++i) most[i] = fmax(fabs(n0[i]), fabs(n1[i]));
    const float x = fmax(fabs(area.x0), fabs(area.x1)), y = fmax(fabs(area.y0), fabs(area.y1));
    const float16 size = most[0] * x + most[1] * y + most[2] + most[3] * area.d1;
    const float16 place = area.place * area.d1 + 0x1p-22f * (x + y);
    const float16 own = 0x1p-18f * size, margin = own + 1.0625f * (area.rounding * size + (most[0] + most[1]) * place + most[0] * area.bias_x + most[1] * area.bias_y);
    return select((int16)(0), (int16)(1), low > margin) - select((int16)(0), (int16)(1), high < -own);
}

#define BOX_ROWS 13 // of 16 floats: a box, then low and high of its planes' x, y, z, D

// Which of 16 groups, or groups of groups, of edges may hold one that counts. A range of planes is wide open where a group holds edges that always count.
inline uint chosen_boxes(const Area area, __global const float* boxes)
{
    if (area.culling == CULLING_NONE) return 0xffffu;
    const int16 reach = boxes_reach(area, boxes, 1.0f);
    if (bits_of(reach) == 0u) return 0u;
    float16 n0[4], n1[4];
    for (int i = 0; i < 4; ++i) {
        n0[i] = vload16(5 + 2 * i, boxes);
        n1[i] = vload16(6 + 2 * i, boxes);
    }
    return bits_of(reach & (side_of_area(area, n0, n1) == (int16)(0)));
}

#define EDGE_ROWS 16 // of 16 floats: a.xyz, b.xyz, the planes (x, y, z, D) of two triangles, on which side of the edge each is (see `weight_of`)

// Which of a group's 16 edges count for some receiver of the area.
inline uint chosen_edges(const Area area, __global const float* set)
{
    const float16 s0 = vload16(14, set), s1 = vload16(15, set), zero = (float16)(0.0f);
    const int16 there = (s0 != zero) | (s1 != zero);
    if (area.culling == CULLING_NONE) return bits_of(there);
    const float16 az = vload16(2, set), bz = vload16(5, set);
    const float16 ad = 1.0f / az, bd = 1.0f / bz; // infinite in the light's plane
    const float16 ax = vload16(0, set) * ad, ay = vload16(1, set) * ad, bx = vload16(3, set) * bd, by = vload16(4, set) * bd;
    const int16 unbounded = (az < 0x1p-60f) | (bz < 0x1p-60f);
    const float16 near = fmax(ad, bd), margin = 0x1p-18f * (near + fabs(ax) + fabs(bx) + fabs(ay) + fabs(by));
    const float16 ar = fmax(ad - area.d0, zero), br = fmax(bd - area.d0, zero);
    int16 meet = (near >= area.d0) & (fmax(ax, bx) + margin >= area.x0) & (fmin(ax - ar, bx - br) - margin <= area.x1) & (fmax(ay, by) + margin >= area.y0) &
                 (fmin(ay - ar, by - br) - margin <= area.y1);
    // Across the edge: its ends hide the light's middle from c and e; the area's middle must not be further from the line between than both are wide.
    const float16 cx = ax - 0.5f * ar, cy = ay - 0.5f * ar, nx = (by - 0.5f * br) - cy, ny = cx - (bx - 0.5f * br);
    const float mx = 0.5f * (area.x0 + area.x1), my = 0.5f * (area.y0 + area.y1), wx = 0.5f * (area.x1 - area.x0), wy = 0.5f * (area.y1 - area.y0);
    const float16 wide = 0.5f * fmax(ar, br) + margin;
    meet &= fabs(nx * (mx - cx) + ny * (my - cy)) <= (fabs(nx) * (wx + wide) + fabs(ny) * (wy + wide)) * (1.0f + 0x1p-18f);
    meet = there & (meet | unbounded);
    if (bits_of(meet) == 0u) return 0u;
    int16 side[2];
    for (int face = 0; face < 2; ++face) {
        float16 n[4];
        for (int i = 0; i < 4; ++i) n[i] = vload16(6 + 4 * face + i, set);
        side[face] = side_of_area(area, n, n);
    }
    const int16 open = (s0 == zero) | (s1 == zero), same = s0 == s1;
    const int16 never = (side[0] != (int16)(0)) & (side[1] != (int16)(0)) & select(side[0] == side[1], side[0] != side[1], same) & ~open;
    return bits_of(meet & ~never);
}

#define TRIANGLE_ROWS 16 // of 16 floats: a.xyz, b.xyz, c.xyz in order of their numbers; the plane (x, y, z, D); s (see `count_triangle`); whether O is inside

// Which of a group's 16 triangles may lie between O and some receiver of the area.
inline uint chosen_triangles(const Area area, __global const float* set)
{
    const int16 there = vload16(13, set) != (float16)(0.0f);
    if (area.culling == CULLING_NONE) return bits_of(there);
    float16 x0 = (float16)(0x1p60f), x1 = -x0, y0 = x0, y1 = x1, near = (float16)(0.0f);
    int16 unbounded = (int16)(0);
    for (int corner = 0; corner < 3; ++corner) {
        const float16 z = vload16(3 * corner + 2, set), d = 1.0f / z;
        const float16 x = vload16(3 * corner, set) * d, y = vload16(3 * corner + 1, set) * d;
        x0 = fmin(x0, x);
        x1 = fmax(x1, x);
        y0 = fmin(y0, y);
        y1 = fmax(y1, y);
        near = fmax(near, d);
        unbounded |= z < 0x1p-60f;
    }
    const float16 margin_x = 0x1p-18f * (fabs(x0) + fabs(x1)), margin_y = 0x1p-18f * (fabs(y0) + fabs(y1));
    const int16 meet = (near >= area.d0) & (x1 + margin_x >= area.x0) & (x0 - margin_x <= area.x1) & (y1 + margin_y >= area.y0) & (y0 - margin_y <= area.y1);
    return bits_of(there & (meet | unbounded));
}

// --- Which side -----------------

// The margins of `inside`: rounding, relative; of the receiver's place, in tangents a disparity; self-shadow of casters made from depth maps.
typedef struct {
    float rounding, place, bias_x, bias_y;
} Margins;

// Whether receivers are on the side of a triangle's plane N . p = D that N points to, by more than rounding explains. The host turns N to where a surface's own points
// should not be taken to be: into a closed one, away from the light's corner for another.
inline intn inside(const float nx, const float ny, const float nz, const float nd, const Receivers p, const Margins margins)
{
    const floatn x = nx * p.tx, y = ny * p.ty, size = fabs(x) + fabs(y) + (fabs(nz) + fabs(nd) * p.d);
    const floatn place = fma((floatn)(margins.place), p.d, 0x1p-22f * (fabs(p.tx) + fabs(p.ty)));
    const floatn margin = fma((floatn)(margins.rounding), size, (fabs(nx) + fabs(ny)) * place + (fabs(nx) * margins.bias_x + fabs(ny) * margins.bias_y));
    return fma((floatn)(-nd), p.d, x + (y + nz)) > margin;
}

// --- Counting -----------------

// Adds what a group's triangle `i` adds to N(O). s: a, b, c turn counter-clockwise as the light shows them to receivers that are inside (1) or outside (-1).
inline void count_triangle(intn* count, __global const float* set, const int i, const Receivers p, const Margins margins)
{
    const float az = set[32 + i], bz = set[80 + i], cz = set[128 + i];
    const floatn ax = across(set[i], az, p.tx), ay = across(set[16 + i], az, p.ty);
    const floatn bx = across(set[48 + i], bz, p.tx), by = across(set[64 + i], bz, p.ty);
    const floatn cx = across(set[96 + i], cz, p.tx), cy = across(set[112 + i], cz, p.ty);
    const intn ab = left_of(ax, ay, bx, by) != 0, bc = left_of(bx, by, cx, cy) != 0, ac = left_of(ax, ay, cx, cy) != 0;
    const intn straight = ab & bc & (ac == 0), turned = (ab == 0) & (bc == 0) & ac;
    if (NONE(straight | turned)) return;
    const intn in = inside(set[144 + i], set[160 + i], set[176 + i], set[192 + i], p, margins) != 0;
    const floatn aw = fma((floatn)(-az), p.d, (floatn)(1.0f)), bw = fma((floatn)(-bz), p.d, (floatn)(1.0f)), cw = fma((floatn)(-cz), p.d, (floatn)(1.0f));
    // Before the receiver: all of it; none of it; else where receiver and O are on different sides.
    const floatn low = fmin(aw, fmin(bw, cw)), high = fmax(aw, fmax(bw, cw));
    const intn between = set[224 + i] > 0.0f ? in == 0 : in;
    const intn before = (low > (floatn)(0x1p-12f)) | ((high > (floatn)(NEAREST)) & (between != (intn)(0)));
    const float s = set[208 + i];
    const intn as_seen = s > 0.0f ? in : in == 0; // a, b, c should turn counter-clockwise
    const intn one = select_lanes((intn)(-1), (intn)(1), (as_seen != 0) == (straight != 0));
    *count += select_lanes((intn)(0), one, before & (straight | turned));
}

// N of every sample of LANES receivers, bit by bit.
typedef struct {
    uintn bits[SIDE][COUNTER_BITS];
} Counters;

inline void set_counters(Counters* n, const intn count)
{
    for (int bit = 0; bit < COUNTER_BITS; ++bit) {
        const uintn word = select_lanes((uintn)(0u), (uintn)(0xffffffffu), ((count >> bit) & 1) != (intn)(0));
        for (int k = 0; k < SIDE; ++k) n->bits[k][bit] = word;
    }
}

// Adds 2^first to the samples of row k in `columns`, or takes it off where `minus` has all bits set.
inline void add_to_row(Counters* n, const int k, uintn columns, const uintn minus, const int first)
{
    for (int bit = first; bit < COUNTER_BITS; ++bit) {
        const uintn before = n->bits[k][bit];
        n->bits[k][bit] = before ^ columns;
        columns &= before ^ minus;
        if (NONE(columns != (uintn)(0u))) return;
    }
}

#if LANES == 1
inline float highest_of(const floatn v) { return v; }
#else
inline float highest_of_four(const float4 v)
{
    const float2 a = select(v.lo, v.hi, v.hi > v.lo);
    return a.x > a.y ? a.x : a.y;
}
#if LANES == 8
inline float highest_of(const floatn v) { return highest_of_four(select(v.lo, v.hi, v.hi > v.lo)); }
#else
inline float highest_of(const floatn v)
{
    const float8 a = select(v.lo, v.hi, v.hi > v.lo);
    return highest_of_four(select(a.lo, a.hi, a.hi > a.lo));
}
#endif
#endif

// A part of an edge as receivers see it, from its lower end to its upper: heights v in rows, places u in columns, on the line u = at + slope v. `counts`: where there
// is one.
typedef struct {
    floatn u0, v0, u1, v1, at, slope;
    intn counts;
} Rise;

// Of the 32 heights of a row those below `part` of it, 0 to 1.
inline intn heights_below(const floatn part) { return convert_intn(ceil(fma(part, (floatn)(SIDE), (floatn)(-0.5f)))); }

// Columns whose samples lie below so many heights.
inline uintn columns_under_heights(const intn heights) { return columns_under(as_uintn(heights)); }

// Adds 2^first to the samples that lie right of an edge's part at heights that it spans, or takes it off.
inline void add_rise(Counters* n, const Rise e, const uintn minus, const int first)
{
    const floatn zero = (floatn)(0.0f), top = (floatn)(SIDE);
    // In the light's rows, whatever a lane without an edge holds.
    const floatn low0 = select_lanes(zero, e.v0, e.v0 > zero), low1 = select_lanes(zero, e.v1, e.v1 > zero);
    const floatn v0 = select_lanes(top, low0, low0 < top), v1 = select_lanes(top, low1, low1 < top);
    const floatn row0 = floor(v0), row1 = floor(v1);
    const intn below = heights_below(v0 - row0), above = heights_below(v1 - row1);
    // Where it spans a sample's height at all.
    const intn some = e.counts & ((row1 > row0) | (above > below)) & (v1 > v0);
    if (NONE(some)) return;
    const uintn not_below = ~columns_under_heights(below), not_above = columns_under_heights(above);
    const floatn left = select_lanes(e.u1, e.u0, e.u0 < e.u1), right = select_lanes(e.u0, e.u1, e.u0 < e.u1);
    const int from = convert_int(-highest_of(select_lanes(-top, -row0, some))), to = min(convert_int(highest_of(select_lanes(zero, row1, some))), SIDE - 1);
    for (int k = from; k <= to; ++k) {
        const floatn row = (floatn)(k);
        const intn spans = some & (row >= row0) & (row <= row1);
        if (NONE(spans)) continue;
        // Columns that the edge goes through are asked one by one, those right of it for all receivers not at all.
        const floatn at_row = fma(row, e.slope, e.at), at_next = at_row + e.slope;
        const floatn low = clamp(select_lanes(at_next, at_row, at_row < at_next), left, right), high = clamp(select_lanes(at_row, at_next, at_row < at_next), left, right);
        const int first_column = convert_int(clamp(-highest_of(select_lanes(-top, -low, spans)), 0.0f, (float)SIDE));
        const int end_column = convert_int(clamp(highest_of(select_lanes(zero, high, spans)) + 1.0f, 0.0f, (float)SIDE));
        uintn columns = (uintn)(end_column < SIDE ? 0xffffffffu << end_column : 0u);
        for (int i = first_column; i < end_column; ++i) {
            const floatn at = fma(e.slope, (floatn)(heights[i]), at_row), u = select_lanes(right, select_lanes(left, at, at > left), at < right);
            columns |= select_lanes((uintn)(0u), (uintn)(1u << i), (floatn)((float)i + phases[k]) >= u);
        }
        columns &= select_lanes((uintn)(0xffffffffu), not_below, row == row0) & select_lanes((uintn)(0xffffffffu), not_above, row == row1);
        add_to_row(n, k, select_lanes((uintn)(0u), columns, spans), minus, first);
    }
}

// How many triangles more lie left of the edge from a to b than right of it, as receivers see it.
inline intn weight_of(__global const float* set, const int i, const Receivers p, const Margins margins)
{
    intn weight = (intn)(0);
    for (int face = 0; face < 2; ++face) {
        const int s = convert_int(set[(14 + face) * 16 + i]);
        if (s == 0) continue;
        __global const float* const plane = set + (6 + 4 * face) * 16 + i;
        weight += select_lanes((intn)(-s), (intn)(s), inside(plane[0], plane[16], plane[32], plane[48], p, margins) != 0);
    }
    return weight;
}

// Adds a group's edge `i` to N of LANES receivers.
inline void count_edge(Counters* n, __global const float* set, const int i, const Receivers p, const intn there, const Margins margins)
{
    const intn weight = weight_of(set, i, p, margins);
    const intn counts = there & (weight != (intn)(0));
    if (NONE(counts)) return;
    const float az = set[32 + i], bz = set[80 + i];
    const floatn zero = (floatn)(0.0f), one = (floatn)(1.0f), nearest = (floatn)(NEAREST);
    floatn ax = across(set[i], az, p.tx), ay = across(set[16 + i], az, p.ty), aw = fma((floatn)(-az), p.d, one);
    floatn bx = across(set[48 + i], bz, p.tx), by = across(set[64 + i], bz, p.ty), bw = fma((floatn)(-bz), p.d, one);
    const intn left = left_of(ax, ay, bx, by) != 0;
    // The line through both, line_u u + line_v v + line_1 = 0 over the light, of the ends as they are: what comes next moves them.
    const floatn line_u = difference_of_products(ay, bw, by, aw), line_v = difference_of_products(bx, aw, ax, bw);
    const floatn line_1 = (float)SIDE * difference_of_products(ax, by, bx, ay);
    // What is before the receiver.
    const intn a_before = aw > nearest, b_before = bw > nearest;
    intn some = counts & (a_before | b_before);
    if (NONE(some)) return;
    if (!ALL(a_before & b_before)) {
        const floatn at = (nearest - aw) / (bw - aw), x = fma(at, bx - ax, ax), y = fma(at, by - ay, ay);
        ax = select_lanes(x, ax, a_before);
        ay = select_lanes(y, ay, a_before);
        aw = select_lanes(nearest, aw, a_before);
        bx = select_lanes(x, bx, b_before);
        by = select_lanes(y, by, b_before);
        bw = select_lanes(nearest, bw, b_before);
    }
    // Beside the light: nothing to the right, nothing at its heights, or nothing but what the count at O holds.
    const intn a_right = ax > zero, b_right = bx > zero;
    some &= (a_right | b_right) & ((ax < aw) | (bx < bw)) & ((ay > zero) | (by > zero)) & ((ay < aw) | (by < bw));
    if (NONE(some)) return;

    floatn au = (float)SIDE * ax / aw, av = (float)SIDE * ay / aw, bu = (float)SIDE * bx / bw, bv = (float)SIDE * by / bw;
    const intn crosses = some & (a_right != b_right);
    const int first = set[224 + i] != 0.0f && set[240 + i] != 0.0f ? 1 : 0;
    const intn positive = weight > (intn)(0);
    if (!NONE(crosses)) {
        // Where it crosses the light's left side: above O or below as left_of says.
        const floatn y = -line_1 / line_v;
        const intn above = crosses & ((b_right != 0) == (left == 0));
        const floatn height = select_lanes(select_lanes(zero, y, y < zero), select_lanes(zero, y, y > zero), above);
        au = select_lanes(au, zero, crosses & (a_right == 0));
        av = select_lanes(av, height, crosses & (a_right == 0));
        bu = select_lanes(bu, zero, crosses & (b_right == 0));
        bv = select_lanes(bv, height, crosses & (b_right == 0));
        // All above: as if it came down the left side, or went up there.
        const Rise side = {zero, height, zero, (floatn)(SIDE), zero, zero, above};
        add_rise(n, side, select_lanes((uintn)(0u), (uintn)(0xffffffffu), (b_right != 0) != positive), first);
    }
    const intn up = bv > av;
    const floatn per_u = -1.0f / line_u;
    const Rise e = {select_lanes(bu, au, up), select_lanes(bv, av, up), select_lanes(au, bu, up), select_lanes(av, bv, up), line_1 * per_u, line_v * per_u, some};
    add_rise(n, e, select_lanes((uintn)(0u), (uintn)(0xffffffffu), up == positive), first);
}

// --- Shading -----------------

inline Area area_of(const float8 box, const WedgeLight light)
{
    // Rounded as receivers_at does, which is monotone in both: the area holds its receivers to the bit.
    const float d0 = box.s4 * light.scale_d, d1 = box.s5 * light.scale_d;
    const float x0 = box.s0 * light.scale_x, x1 = box.s1 * light.scale_x, y0 = box.s2 * light.scale_y, y1 = box.s3 * light.scale_y;
    const Area area = {fmin(fma(-light.centre_x, d0, x0), fma(-light.centre_x, d1, x0)),
                       fmax(fma(-light.centre_x, d0, x1), fma(-light.centre_x, d1, x1)),
                       fmin(fma(-light.centre_y, d0, y0), fma(-light.centre_y, d1, y0)),
                       fmax(fma(-light.centre_y, d0, y1), fma(-light.centre_y, d1, y1)),
                       d0,
                       d1,
                       0x1p-22f + 2.0f * (light.precision + light.depth_error * d1),
                       light.position_error,
                       light.bias_x,
                       light.bias_y,
                       light.culling};
    return area;
}

// Bits of a block of 16 that are below `count` and not below `from`, both counted from its first.
inline uint within(const int from, const int count)
{
    const uint below = count >= 16 ? 0xffffu : (1u << count) - 1u;
    return from <= 0 ? below : from >= 16 ? 0u : below & ~((1u << from) - 1u);
}

// The numbers of edges that count for some receiver of the area, from group of groups `next` on: as many groups of groups as there is room for. `next` becomes the
// first that is left. Returns how many edges.
inline int choose_edges(int* chosen, int* next, const Area area, const int2 edges, __global const float* supers, __global const float* groups,
                        __global const float* sets)
{
    int found = 0;
    for (int block = *next & ~15; block < edges.x; block += 16) {
        uint super_bits = chosen_boxes(area, supers + block * BOX_ROWS) & within(*next - block, edges.x - block);
        while (super_bits) {
            const int super = block + take_bit(&super_bits);
            if (found + 256 > CHOSEN) {
                *next = super;
                return found;
            }
            uint group_bits = chosen_boxes(area, groups + super * 16 * BOX_ROWS) & within(0, edges.y - super * 16);
            while (group_bits) {
                const int group = super * 16 + take_bit(&group_bits);
                uint bits = chosen_edges(area, sets + group * 16 * EDGE_ROWS);
                while (bits) chosen[found++] = group * 16 + take_bit(&bits);
            }
        }
    }
    *next = edges.x;
    return found;
}

// N(O) of a tile's rows.
inline uint count_at_corner(intn* counts, const Area area, const Receivers* p, const Margins margins, const int2 triangles, __global const float* supers,
                            __global const float* groups, __global const float* sets)
{
    uint looked_at = 0;
    for (int block = 0; block < triangles.x; block += 16) {
        uint super_bits = within(0, triangles.x - block) & (area.culling == CULLING_NONE ? 0xffffu : bits_of(boxes_reach(area, supers + block * 5, 0.0f)));
        while (super_bits) {
            const int super = block + take_bit(&super_bits);
            uint group_bits =
                within(0, triangles.y - super * 16) & (area.culling == CULLING_NONE ? 0xffffu : bits_of(boxes_reach(area, groups + super * 80, 0.0f)));
            while (group_bits) {
                __global const float* const set = sets + (super * 16 + take_bit(&group_bits)) * 16 * TRIANGLE_ROWS;
                uint bits = chosen_triangles(area, set);
                while (bits) {
                    const int i = take_bit(&bits);
                    ++looked_at;
                    for (int row = 0; row < ITEM_ROWS; ++row) count_triangle(&counts[row], set, i, p[row], margins);
                }
            }
        }
    }
    return looked_at;
}

// soft_shadow_silhouettes: the share of a rectangle light that each receiver sees.
//
//   light                                as in soft_shadow_volume.cl, its centre being the corner O and its half extents the light's width and height
//   edges, triangles                     how many groups of groups, and groups
//   edge_supers, edge_groups [/16][13][16]    boxes of groups of 16 groups, and of groups of 16 edges (BOX_ROWS)
//   edge_sets [groups][16][16]           EDGE_ROWS
//   triangle_supers, triangle_groups [/16][5][16]   boxes of the same
//   triangle_sets [groups][16][16]       TRIANGLE_ROWS
//   the rest                             as in soft_shadow_volume.cl
//
// Launched over work-items, (stride / LANES) x (rows / ITEM_ROWS). Counts are integers: no order of edges changes a bit.
__kernel void soft_shadow_silhouettes(const ReceiverView view, const WedgeLight light, const int2 edges, const int2 triangles,
                                      __global const float* restrict edge_supers, __global const float* restrict edge_groups, __global const float* restrict edge_sets,
                                      __global const float* restrict triangle_supers, __global const float* restrict triangle_groups,
                                      __global const float* restrict triangle_sets, __global const float8* restrict bounds, __global const float* restrict xi,
                                      __global const float* restrict eta, __global const float* restrict d, __global float* restrict visibility,
                                      __global uint2* restrict evaluated, __global const volatile int* stop)
{
    const int x = get_global_id(0) * LANES, y = get_global_id(1) * ITEM_ROWS;
    if (x >= view.stride || y >= view.rows) return;
    const int number = (y / TILE_ROWS) * (view.stride / TILE_WIDTH) + x / TILE_WIDTH;
    const Area area = area_of(bounds[number], light);
    const Margins margins = {area.rounding, area.place, area.bias_x, area.bias_y};
    const floatn zero = (floatn)(0.0f);

    Receivers p[ITEM_ROWS];
    intn there[ITEM_ROWS], corner[ITEM_ROWS];
    for (int row = 0; row < ITEM_ROWS; ++row) {
        p[row] = receivers_at(light, view.stride, xi, eta, d, x, y + row);
        there[row] = load_lanes(d + (y + row) * view.stride + x) < (floatn)(NO_RECEIVER);
        p[row].tx = select_lanes(zero, p[row].tx, there[row]);
        p[row].ty = select_lanes(zero, p[row].ty, there[row]);
        p[row].d = select_lanes(zero, p[row].d, there[row]);
        corner[row] = (intn)(0);
    }
    uint2 count = (uint2)(0u);
    int chosen[CHOSEN], next = 0, found = 0;
    if (bounds[number].s6 != 0.0f) {
        count.y = count_at_corner(corner, area, p, margins, triangles, triangle_supers, triangle_groups, triangle_sets);
        found = choose_edges(chosen, &next, area, edges, edge_supers, edge_groups, edge_sets);
        count.x = found;
    }
    const int first_next = next, first_found = found;
    bool first_chosen = true; // `chosen` holds what was chosen first
    for (int row = 0; row < ITEM_ROWS; ++row) {
        Counters n;
        set_counters(&n, select_lanes((intn)(0), corner[row], there[row]));
        if (!first_chosen) {
            next = 0;
            found = choose_edges(chosen, &next, area, edges, edge_supers, edge_groups, edge_sets);
            first_chosen = true;
        } else {
            next = first_next;
            found = first_found;
        }
        for (;;) {
            if (stopped(stop)) return;
            for (int i = 0; i < found; ++i)
                count_edge(&n, edge_sets + (chosen[i] & ~15) * EDGE_ROWS, chosen[i] & 15, p[row], there[row], margins);
            if (next >= edges.x || bounds[number].s6 == 0.0f) break;
            found = choose_edges(chosen, &next, area, edges, edge_supers, edge_groups, edge_sets);
            first_chosen = false;
            if (row == 0) count.x += found;
        }
        uintn hidden = (uintn)(0u);
        for (int k = 0; k < SIDE; ++k) {
            uintn any = (uintn)(0u);
            for (int bit = 0; bit < COUNTER_BITS; ++bit) any |= n.bits[k][bit];
            hidden += popcount(any);
        }
        if (y + row < view.height)
            write_visibility(visibility + (y + row) * view.width + x, 1.0f - convert_floatn(hidden) * (1.0f / (SIDE * SIDE)), view.width - x, 0);
    }
    if (x % TILE_WIDTH == 0 && y % TILE_ROWS == 0) evaluated[number] = count;
}
