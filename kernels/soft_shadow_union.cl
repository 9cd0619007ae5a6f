// Soft Shadow Maps with a union: which of 32 x 32 samples of the light the micro-patches of one or two occluder maps hide, a bit each.
//
// Sums of patches (soft_shadow_map.cl) count twice what two patches hide, and leave gaps where they step; a union does neither. Which samples: see
// common/light_pattern.clh.
//
// Specialisation constants: LANES, ITEM_ROWS, TILE_ROWS as in soft_shadow_map.cl
#include "common/choices.h"
#include "common/shared.h"
#include "occluders.cl"
#include "receivers.cl"
#include "common/lanes.clh"
#include "common/light_pattern.clh"
#include "common/patch_limits.clh"
#include "common/patch_search.clh"
#include "common/stop.clh"

// --- Patches -----------------

#define JOINED_LEFT 1
#define JOINED_RIGHT 2
#define JOINED_BOTTOM 4
#define JOINED_TOP 8
#define FULL 16  // every texel is there, covered whole, and joined to those beside it
#define SOLID 32 // so is all around it, as far as it is wide, without bending much: nobody sees its outline

// Levels of patches above the texels: the last has 64 x 64 of them.
#define PATCH_LEVELS 6

// Whether a and b hide as one surface does: they are of one, or what shines between them is less than half a texel, wherever on the light it comes from.
// gap: the step between two texels that opens that much.
inline bool is_one(const float before, const float a, const float b, const float after, const float precision, const float gap)
{
    return a > 0.0f && b > 0.0f && (fabs(b - a) <= gap || is_joined(before, a, b, after, precision));
}

// What a texel's edges are found from: its own disparity and that of the other side of the body, the own one where there is none.
typedef struct {
    float d, other, precision;
} Rim;

// The disparity of the edge between a texel and the one beside it. inner, outer: the texels on either side, with those behind them; outwards: whether
// the edge is the texel's one away from the light's axis.
//
// Shared with a neighbour of the same surface it is the mean of the two. At a silhouette a surface that falls off towards its rim does so as a square
// root, of which the last texel's middle shows the slope; it ends where front and back meet. One that does not fall off ends at a corner: the light's
// centre sees past the nearer one where the edge points away from its axis, past the further one where it points towards it.
inline float edge_disparity(const Rim rim, const float behind_inner, const float inner, const float outer, const float behind_outer, const bool outwards, const float gap)
{
    const float d = rim.d;
    if (is_one(inner, d, outer, behind_outer, rim.precision, gap)) return 0.5f * (d + outer);
    const float middle = 0.5f * (d + rim.other), towards = middle - d;
    if (!is_one(behind_inner, inner, d, outer, rim.precision, gap)) return middle;
    const float slope = d - inner;
    const bool flat = fabs(slope) < 0.25f * fabs(towards), thin = fabs(rim.other - d) <= gap;
    if (flat && thin) return outwards ? fmax(d, rim.other) : fmin(d, rim.other);
    // Away from where front and back meet it is no rim but the plane's own slope.
    if (slope * towards <= 0.0f) return fmax(fma(0.5f, slope, d), 0.5f * d);
    return towards < 0.0f ? fmax(fma(1.4f, slope, d), middle) : fmin(fma(1.4f, slope, d), middle);
}

inline Along alone(const float d)
{
    const Along along = {d, d};
    return along;
}

inline Along none()
{
    const Along along = {MAXFLOAT, -MAXFLOAT};
    return along;
}

inline Along both(const Along a, const Along b)
{
    const Along result = {fmin(a.low, b.low), fmax(a.high, b.high)};
    return result;
}

inline float disparity_at(__global const float2* texels, const int2 size, const int x, const int y)
{
    return x >= 0 && y >= 0 && x < size.x && y < size.y ? texels[y * size.x + x].x : 0.0f;
}

// The rectangle inside a box that has a share of the texel as its area, cut off where less is covered: left, right, top, bottom. middle: of what is covered.
inline float4 covered_rectangle(float2 begin, float2 end, const float share, const float2 middle)
{
    const float2 wide = end - begin, off = middle - 0.5f * (begin + end);
    const float missing = fmax(wide.x * wide.y - share, 0.0f);
    const bool across = fabs(off.x) * wide.y >= fabs(off.y) * wide.x;
    if (across && off.x >= 0.0f) begin.x += missing / wide.y;
    if (across && off.x < 0.0f) end.x -= missing / wide.y;
    if (!across && off.y >= 0.0f) begin.y += missing / wide.x;
    if (!across && off.y < 0.0f) end.y -= missing / wide.x;
    return (float4)(begin.x, end.x, begin.y, end.y);
}

// surfaces_of_texels: a larger map at a lower resolution, the nearest surface of each texel alone: what it covers of the texel, as a rectangle.
//
//   gap    steps of disparity up to which samples are of one surface
//   texels [size.y][size.x]  (mean disparity, covered share)
//   parts  [size.y][size.x]  the rectangle: left, right, top, bottom, as MicroPatch has them
//
// It lies where the covered samples do and has their share of the texel as its area. Means of different surfaces would be none of them.
__kernel void surfaces_of_texels(const int2 from, __global const float* restrict depth, const int2 size, const float gap, __global float2* restrict texels,
                                 __global float4* restrict parts)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    // The samples whose centres lie in the texel.
    const int2 first = (int2)((2 * x * from.x + size.x) / (2 * size.x), (2 * y * from.y + size.y) / (2 * size.y));
    const int2 last = (int2)((2 * (x + 1) * from.x + size.x) / (2 * size.x), (2 * (y + 1) * from.y + size.y) / (2 * size.y));
    float nearest = 0.0f, furthest = MAXFLOAT, all = 0.0f;
    for (int j = first.y; j < last.y; ++j)
        for (int i = first.x; i < last.x; ++i) {
            const float d = disparity_of(depth[j * from.x + i]);
            nearest = d > nearest ? d : nearest;
            furthest = d < furthest ? d : furthest;
            all += d;
        }
    const int at = y * size.x + x;
    const bool plain = furthest > 0.0f && nearest - furthest <= gap;
    if (plain || nearest == 0.0f) {
        texels[at] = plain ? (float2)(all / ((last.x - first.x) * (last.y - first.y)), 1.0f) : (float2)(0.0f);
        parts[at] = plain ? (float4)(0.0f, 1.0f, 0.0f, 1.0f) : (float4)(0.0f);
        return;
    }
    // The nearest surface: from the nearest sample on, as long as the next is no more than `gap` behind.
    float least = nearest, before = MAXFLOAT;
    while (least < before) {
        before = least;
        for (int j = first.y; j < last.y; ++j)
            for (int i = first.x; i < last.x; ++i) {
                const float d = disparity_of(depth[j * from.x + i]);
                least = d > 0.0f && d >= before - gap && d < least ? d : least;
            }
    }

    int count = 0;
    float sum = 0.0f;
    int2 low = last, high = first, places = (int2)(0);
    for (int j = first.y; j < last.y; ++j)
        for (int i = first.x; i < last.x; ++i) {
            const float d = disparity_of(depth[j * from.x + i]);
            if (!(d > 0.0f && d >= least)) continue;
            ++count;
            sum += d;
            low = min(low, (int2)(i, j));
            high = max(high, (int2)(i + 1, j + 1));
            places += (int2)(2 * i + 1, 2 * j + 1);
        }
    const float2 whole = convert_float2(last - first);
    const float share = count / (whole.x * whole.y);
    texels[at] = (float2)(sum / count, share);
    parts[at] = covered_rectangle(convert_float2(low - first) / whole, convert_float2(high - first) / whole, share,
                                  (0.5f * convert_float2(places) / count - convert_float2(first)) / whole);
}

// micro_patches: the patches of a map.
//
//   gap            the step of disparity that opens half a texel, across and down
//   texels, others [height][width]   (disparity, covered share) of the map and of the other side's; has_others: whether there is one
//   begin          where the map's patches begin
//   parts [height][width]            of surfaces_of_texels, where has_parts; else texels are covered whole
//   reach, patches [height][width]   reach: the greatest disparity, 0 where nothing is; there no patch is written
__kernel void micro_patches(const int2 size, const float precision, const float2 gap, const int has_others, const int has_parts, const int begin, __global const float2* restrict texels,
                            __global const float2* restrict others, __global const float4* restrict parts, __global float* restrict reach,
                            __global MicroPatch* restrict patches)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    const int at = y * size.x + x;
    const float d = texels[at].x;
    reach[begin + at] = 0.0f;
    if (d > 0.0f) {
        MicroPatch patch = {0.0f, 0.0f, 0.0f, {0.0f, 0.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}, 0, 0.0f, 1.0f, 0.0f, 1.0f};
        const float other = has_others ? others[at].x : 0.0f;
        const Rim rim = {d, other > 0.0f ? other : d, precision};
        float row[5], column[5];
        for (int i = 0; i < 5; ++i) {
            row[i] = disparity_at(texels, size, x + i - 2, y);
            column[i] = disparity_at(texels, size, x, y + i - 2);
        }
        const bool right_half = 2 * x + 1 > size.x, lower_half = 2 * y + 1 > size.y;
        const float left = edge_disparity(rim, row[4], row[3], row[1], row[0], !right_half, gap.x);
        const float right = edge_disparity(rim, row[0], row[1], row[3], row[4], right_half, gap.x);
        const float top = edge_disparity(rim, column[4], column[3], column[1], column[0], !lower_half, gap.y);
        const float bottom = edge_disparity(rim, column[0], column[1], column[3], column[4], lower_half, gap.y);
        patch.middle = d;
        patch.left = alone(left);
        patch.right = alone(right);
        patch.top = alone(top);
        patch.bottom = alone(bottom);
        patch.reach = fmax(fmax(d, fmax(left, right)), fmax(top, bottom));
        patch.least = fmin(fmin(d, fmin(left, right)), fmin(top, bottom));
        patch.flags = FULL | (is_one(row[3], d, row[1], row[0], precision, gap.x) ? JOINED_LEFT : 0) | (is_one(row[1], d, row[3], row[4], precision, gap.x) ? JOINED_RIGHT : 0)
                      | (is_one(column[3], d, column[1], column[0], precision, gap.y) ? JOINED_TOP : 0)
                      | (is_one(column[1], d, column[3], column[4], precision, gap.y) ? JOINED_BOTTOM : 0);
        if (has_parts) {
            const float4 part = parts[at];
            patch.x0 = part.s0;
            patch.x1 = part.s1;
            patch.y0 = part.s2;
            patch.y1 = part.s3;
            if (part.s0 > 0.0f || part.s1 < 1.0f || part.s2 > 0.0f || part.s3 < 1.0f) patch.flags &= ~FULL;
        }
        patches[begin + at] = patch;
        reach[begin + at] = patch.reach;
    }
}

// joined_patches: a level of patches from the one below.
//
//   reach, patches  every level; [below_size.y][below_size.x] of one begin at `below_begin`, [size.y][size.x] of the next at `level_begin`
//
// A patch that is not FULL has its surfaces' area, where they lie.
__kernel void joined_patches(const int2 below_size, const int2 size, const int below_begin, const int level_begin, __global float* reach,
                             __global MicroPatch* patches)
{
    __global const MicroPatch* const below = patches + below_begin;
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    MicroPatch all = {0.0f, 0.0f, 0.0f, {0.0f, 0.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}, 0, 0.0f, 1.0f, 0.0f, 1.0f};
    float area = 0.0f, depths = 0.0f;
    float2 begin = (float2)(1.0f), end = (float2)(0.0f), middle = (float2)(0.0f);
    int flags[4];
    all.least = MAXFLOAT;
    all.left = all.right = all.top = all.bottom = none();
    for (int i = 0; i < 4; ++i) {
        const int column = 2 * x + (i & 1), row = 2 * y + (i >> 1);
        flags[i] = 0;
        if (column >= below_size.x || row >= below_size.y) continue;
        if (reach[below_begin + row * below_size.x + column] == 0.0f) continue;
        const MicroPatch p = below[row * below_size.x + column];
        flags[i] = p.flags;
        all.reach = fmax(all.reach, p.reach);
        all.least = fmin(all.least, p.least);
        const float2 low = 0.5f * (float2)((i & 1) + p.x0, (i >> 1) + p.y0), high = 0.5f * (float2)((i & 1) + p.x1, (i >> 1) + p.y1);
        const float covered = (high.x - low.x) * (high.y - low.y);
        area += covered;
        depths = fma(covered, p.middle, depths);
        middle += covered * 0.5f * (low + high);
        begin = fmin(begin, low);
        end = fmax(end, high);
        if (i & 1)
            all.right = both(all.right, p.right);
        else
            all.left = both(all.left, p.left);
        if (i >> 1)
            all.bottom = both(all.bottom, p.bottom);
        else
            all.top = both(all.top, p.top);
    }
    if (area > 0.0f) {
        const bool whole = (flags[0] & flags[1] & flags[2] & flags[3] & FULL) && (flags[0] & flags[2] & JOINED_RIGHT) && (flags[0] & flags[1] & JOINED_BOTTOM);
        all.middle = depths / area;
        // An edge of a part lies in the middle of where it is: outermost places add up.
        all.flags = whole ? FULL | (flags[0] & flags[2] & JOINED_LEFT) | (flags[1] & flags[3] & JOINED_RIGHT) | (flags[0] & flags[1] & JOINED_TOP) | (flags[2] & flags[3] & JOINED_BOTTOM) : 0;
        const float4 part = whole ? (float4)(0.0f, 1.0f, 0.0f, 1.0f) : covered_rectangle(begin, end, area, middle / area);
        all.x0 = part.s0;
        all.x1 = part.s1;
        all.y0 = part.s2;
        all.y1 = part.s3;
        if (all.left.low > all.left.high) all.left = alone(all.middle);
        if (all.right.low > all.right.high) all.right = alone(all.middle);
        if (all.top.low > all.top.high) all.top = alone(all.middle);
        if (all.bottom.low > all.bottom.high) all.bottom = alone(all.middle);
        patches[level_begin + y * size.x + x] = all;
    }
    reach[level_begin + y * size.x + x] = all.reach;
}

// solid_patches: marks what is SOLID of a level. A receiver sees the outermost places of a patch's edges; they lie beyond the true ones by no more than the
// patch's range of disparities moves a place on the map. Where the same surface goes on for twice that, it hides what lies between.
//
//   moves  by how many of the level's patches one unit of disparity moves a place on the map, for light from the light's edge
__kernel void solid_patches(const int2 size, const float2 moves, const int begin, __global const float* restrict all_reach, __global MicroPatch* all_patches)
{
    __global MicroPatch* const patches = all_patches + begin;
    const int x = get_global_id(0), y = get_global_id(1);
    if (x < 1 || y < 1 || x >= size.x - 1 || y >= size.y - 1) return;
    if (all_reach[begin + y * size.x + x] == 0.0f || !(patches[y * size.x + x].flags & FULL)) return;
    float reach = 0.0f, least = MAXFLOAT;
    int all = FULL;
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
            if (all_reach[begin + (y + j) * size.x + x + i] == 0.0f) return;
            __global const MicroPatch* const p = patches + (y + j) * size.x + x + i;
            const int flags = p->flags, beside = (i < 1 ? JOINED_RIGHT : 0) | (j < 1 ? JOINED_BOTTOM : 0);
            if ((flags & beside) != beside) all = 0;
            all &= flags;
            reach = fmax(reach, p->reach);
            least = fmin(least, p->least);
        }
    if (all && (reach - least) * fmax(moves.x, moves.y) <= 0.5f) patches[y * size.x + x].flags |= SOLID;
}

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
//   reach, patches [maps][per_map]     every level of patches, the texels' first
//   texels, steps [maps][height][width]  for receivers whose plane is not known
//   light_rows [SIDE], light_samples   which samples shine, and how many: all, of a disc those inside
//   the rest                           as in soft_shadow_map.cl
__kernel void soft_shadow_union(const ReceiverView receivers, const OccluderView occluders, const int maps, const int per_map, const float nearest, const float bias,
                                const float precision, const int has_planes, const int lists, const float coarse, __global const float* restrict reach,
                                __global const MicroPatch* restrict patches, __global const float2* restrict texels, __global const float2* restrict steps, __global const float8* restrict bounds,
                                __global const float* restrict xi, __global const float* restrict eta, __global const float* restrict d,
                                __global const float* restrict slope_xi, __global const float* restrict slope_eta, __global const uint* restrict light_rows, const int light_samples,
                                __global float* restrict visibility, __global uint* restrict evaluated, __global const volatile int* stop)
{
    const int x = get_global_id(0) * LANES, y = get_global_id(1) * ITEM_ROWS;
    if (x >= receivers.stride || y >= receivers.rows) return;
    const int tile = (y / TILE_ROWS) * (receivers.stride / TILE_WIDTH) + x / TILE_WIDTH;

    const float2 scale = (float2)(occluders.light_scale_x, occluders.light_scale_y);
    const int2 size = (int2)(occluders.width, occluders.height);
    int2 sizes[PATCH_LEVELS + 1];
    int begins[PATCH_LEVELS + 1];
    sizes[0] = size;
    begins[0] = 0;
    for (int level = 1; level <= PATCH_LEVELS; ++level) {
        sizes[level] = (sizes[level - 1] + 1) / 2;
        begins[level] = begins[level - 1] + sizes[level - 1].x * sizes[level - 1].y;
    }
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
        const int2 last_size = sizes[PATCH_LEVELS];
        const int4 roots = window(search, nearest, search.texel * (1 << PATCH_LEVELS), (int2)(0), last_size);
        for (int map = 0; map < maps && rows_left > 0; ++map) {
            __global const MicroPatch* const own_patches = patches + map * per_map;
            __global const float* const own_reach = reach + map * per_map;
            __global const float2* const own_texels = texels + map * size.x * size.y;
            __global const float2* const own_steps_there = steps + map * size.x * size.y;
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
                    const int2 level_size = sizes[at.z];
                    const int number = begins[at.z] + at.y * level_size.x + at.x;
                    const float2 cell = search.texel * (1 << at.z);
                    if (!meets(search, own_reach[number], cell, at.x, at.y)) continue;
                    __global const MicroPatch* const p = own_patches + number;
                    if (!has_limits) {
                        for (int row = 0; row < together; ++row) {
                            const int place = (y + top + row) * receivers.stride + x;
                            limits[row] = limits_with_planes(occluders, bias, precision, has_planes, own_texels, own_steps_there,
                                                             load_lanes((has_planes ? slope_xi : d) + place), load_lanes((has_planes ? slope_eta : d) + place), load_lanes(xi + place),
                                                             load_lanes(eta + place), load_lanes(d + place));
                        }
                        has_limits = true;
                    }
                    // A part of a patch will do where the patch is small, as the receivers see it.
                    const float above = p->least - search.box.s5;
                    const bool small = cell.x * scale.x <= coarse * above && cell.y * scale.y <= coarse * above && p->reach - p->least <= coarse * above;
                    bool whole = at.z == 0 || small || (p->flags & SOLID) || ((p->flags & FULL) && may_be_one(search, p->reach, p->least));
                    Rectangle rectangle;
                    if (whole) {
                        const MicroPatch patch = *p;
                        rectangle = rectangle_of(patch, at.x, at.y, cell);
                        for (int row = 0; row < together && whole && at.z > 0; ++row) whole = over[row] || on_one_side(patch, rectangle, limits[row]);
                    }
                    if (!whole) {
                        for (int child = 0; child < 4; ++child) {
                            const int3 to = (int3)(2 * at.x + (child & 1), 2 * at.y + (child >> 1), at.z - 1);
                            if (to.x < sizes[to.z].x && to.y < sizes[to.z].y) cells[left++] = to;
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
