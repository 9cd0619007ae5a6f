// Micro-patches of occluder maps for soft_shadow_union.cl: what each texel covers, its edges' disparities, and a quadtree of patches above them.
//
// Texels keep four disparities; patches of 2 x 2, 4 x 4, ... of them are MicroPatch structs. Patches of the texels themselves are never stored: they take
// 64 bytes each, most of them are never looked at, and the four disparities say the same.
#include "common/shared.h"
#include "occluders.cl"

#define JOINED_LEFT 1
#define JOINED_RIGHT 2
#define JOINED_BOTTOM 4
#define JOINED_TOP 8
#define FULL 16  // every texel is there, covered whole, and joined to those beside it
#define SOLID 32 // so is all around it, as far as it is wide, without bending much: nobody sees its outline

// Levels of patches above the texels: the last has 64 x 64 of them.
#define PATCH_LEVELS 6

// The patches of a map, level by level. sizes[0]: the texels; begins[level]: of its first patch, of texels in the map's own.
typedef struct {
    int2 sizes[PATCH_LEVELS + 1];
    int begins[PATCH_LEVELS + 1];
} Levels;

inline Levels levels_of(const int2 size)
{
    Levels levels;
    levels.sizes[0] = size;
    levels.begins[0] = levels.begins[1] = 0;
    for (int level = 1; level <= PATCH_LEVELS; ++level) {
        levels.sizes[level] = (levels.sizes[level - 1] + 1) / 2;
        if (level > 1) levels.begins[level] = levels.begins[level - 1] + levels.sizes[level - 1].x * levels.sizes[level - 1].y;
    }
    return levels;
}

// How many patches a map has above its texels.
inline int patches_above(const Levels levels) { return levels.begins[PATCH_LEVELS] + levels.sizes[PATCH_LEVELS].x * levels.sizes[PATCH_LEVELS].y; }

// --- Texels -----------------

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

// texels_of_map: a map as it is.
//
//   depth  [size.y][size.x]  planar
//   texels [size.y][size.x]  from `begin` on: (disparity, covered share)
__kernel void texels_of_map(const int2 size, const int begin, __global const float* restrict depth, __global float2* restrict texels)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    const float d = disparity_of(depth[y * size.x + x]);
    texels[begin + y * size.x + x] = (float2)(d, d > 0.0f ? 1.0f : 0.0f);
}

// unshown_depth: what a map shows that another one does not.
//
//   depth, shown [count]  planar; `depth` and `unshown` may be one
//   some  [1]  set to 1 where something is left
__kernel void unshown_depth(const int count, __global const float* depth, __global const float* restrict shown, __global float* unshown, __global int* some)
{
    const int at = get_global_id(0);
    if (at >= count) return;
    const float d = depth[at];
    const bool left = d != shown[at];
    unshown[at] = left ? d : INFINITY;
    if (left && disparity_of(d) > 0.0f) *some = 1;
}

// disparities_of_map: what surfaces_of_texels reads, several times each.
__kernel void disparities_of_map(const int count, __global const float* restrict depth, __global float* restrict disparities)
{
    const int at = get_global_id(0);
    if (at < count) disparities[at] = disparity_of(depth[at]);
}

// The samples of a larger map whose centres lie in a texel.
typedef struct {
    int2 from, first, last;
    __global const float* disparities;
    float2 middle; // of the texel, as the larger map has places
} Samples;
inline float sample_at(const Samples samples, const int i, const int j) { return samples.disparities[j * samples.from.x + i]; }

// One surface of a texel: the mean of its samples' disparities, what it covers as a share and, where that is less than 1, as a rectangle; its least disparity.
typedef struct {
    float d, share, least;
    float4 part;
} Surface;

// The nearest surface of a texel below a disparity: from the nearest sample there on, as long as the next is no more than `gap` behind. It lies where those
// samples do and has their share of the texel as its area. d 0: there is none.
inline Surface surface_below(const Samples samples, const float limit, const float gap)
{
    Surface surface = {0.0f, 0.0f, 0.0f, (float4)(0.0f)};
    float nearest = 0.0f;
    for (int j = samples.first.y; j < samples.last.y; ++j)
        for (int i = samples.first.x; i < samples.last.x; ++i) {
            const float d = sample_at(samples, i, j);
            nearest = d < limit && d > nearest ? d : nearest;
        }
    if (nearest == 0.0f) return surface;
    float least = nearest, before = MAXFLOAT;
    while (least < before) {
        before = least;
        for (int j = samples.first.y; j < samples.last.y; ++j)
            for (int i = samples.first.x; i < samples.last.x; ++i) {
                const float d = sample_at(samples, i, j);
                least = d > 0.0f && d >= before - gap && d < least ? d : least;
            }
    }

    int count = 0;
    float sum = 0.0f;
    int2 low = samples.last, high = samples.first, places = (int2)(0);
    for (int j = samples.first.y; j < samples.last.y; ++j)
        for (int i = samples.first.x; i < samples.last.x; ++i) {
            const float d = sample_at(samples, i, j);
            if (!(d > 0.0f && d >= least && d < limit)) continue;
            ++count;
            sum += d;
            low = min(low, (int2)(i, j));
            high = max(high, (int2)(i + 1, j + 1));
            places += (int2)(2 * i + 1, 2 * j + 1);
        }
    const float2 first = convert_float2(samples.first), whole = convert_float2(samples.last - samples.first);
    surface.d = sum / count;
    surface.share = count / (whole.x * whole.y);
    surface.least = least;
    surface.part = covered_rectangle((convert_float2(low) - first) / whole, (convert_float2(high) - first) / whole, surface.share, (0.5f * convert_float2(places) / count - first) / whole);
    return surface;
}

// A surface's step along one axis: the lesser of those to either side, so that no edge counts as one.
inline float step_between(const float before, const float d, const float after)
{
    const float down = d - before, up = after - d;
    return before > 0.0f && after > 0.0f && down * up > 0.0f ? (fabs(up) < fabs(down) ? up : down) : 0.0f;
}

// How much the disparity changes from the middle of a texel's samples to the texel's own: they differ where the larger map's size is not a multiple.
inline float to_middle(const Samples samples)
{
    const float2 off = samples.middle - 0.5f * convert_float2(samples.first + samples.last);
    if (off.x == 0.0f && off.y == 0.0f) return 0.0f;
    const int2 at = samples.first, low = max(at - 1, (int2)(0)), high = min(at + 1, samples.from - 1);
    const float d = sample_at(samples, at.x, at.y);
    return off.x * step_between(sample_at(samples, low.x, at.y), d, sample_at(samples, high.x, at.y)) + off.y * step_between(sample_at(samples, at.x, low.y), d, sample_at(samples, at.x, high.y));
}

// The two nearest surfaces of a texel, each with what it covers of it. Means of different surfaces would be none of them, and without the second what lies
// beside an edge would be lost.
typedef struct {
    Surface first, behind;
} Surfaces;
inline Surfaces surfaces_of(const Samples samples, const float gap)
{
    float nearest = 0.0f, furthest = MAXFLOAT, all = 0.0f;
    float8 near = (float8)(0.0f), far = (float8)(MAXFLOAT), sums = (float8)(0.0f);
    for (int j = samples.first.y; j < samples.last.y; ++j) {
        int i = samples.first.x;
        for (; i + 8 <= samples.last.x; i += 8) {
            const float8 d = vload8(0, samples.disparities + j * samples.from.x + i);
            near = select(near, d, d > near);
            far = select(far, d, d < far);
            sums += d;
        }
        for (; i < samples.last.x; ++i) {
            const float d = sample_at(samples, i, j);
            nearest = d > nearest ? d : nearest;
            furthest = d < furthest ? d : furthest;
            all += d;
        }
    }
    const float4 near_half = fmax(near.lo, near.hi), far_half = fmin(far.lo, far.hi), sum_half = sums.lo + sums.hi;
    nearest = fmax(nearest, fmax(fmax(near_half.x, near_half.y), fmax(near_half.z, near_half.w)));
    furthest = fmin(furthest, fmin(fmin(far_half.x, far_half.y), fmin(far_half.z, far_half.w)));
    all += (sum_half.x + sum_half.y) + (sum_half.z + sum_half.w);
    const int2 wide = samples.last - samples.first;
    const bool plain = furthest > 0.0f && nearest - furthest <= gap;
    Surface none = {0.0f, 0.0f, 0.0f, (float4)(0.0f)};
    Surfaces surfaces = {none, none};
    if (plain) {
        surfaces.first.d = all / (wide.x * wide.y) + to_middle(samples);
        surfaces.first.share = 1.0f;
    } else if (nearest > 0.0f) {
        surfaces.first = surface_below(samples, INFINITY, gap);
        surfaces.behind = surface_below(samples, surfaces.first.least, gap);
    }
    return surfaces;
}

// The rectangle is that of a texel which is covered in part: of the others, nearly all, it is neither written nor read, and its memory is never touched.
inline void store(const Surface surface, __global float2* texel, __global float4* part)
{
    *texel = (float2)(surface.d, surface.share);
    if (surface.d > 0.0f && surface.share < 1.0f) *part = surface.part;
}

// surfaces_of_texels: a larger map at a lower resolution.
//
//   disparities [from.y][from.x]  of the larger map; 0: nothing is there
//   gap    steps of disparity up to which samples are of one surface
//   texels, parts [size.y][size.x]  of the nearest surfaces from `begin` on, of the second ones from `second` on: (mean disparity, covered share); the
//                                   rectangle where that is less than 1: left, right, top, bottom, as MicroPatch has them
__kernel void surfaces_of_texels(const int2 from, __global const float* restrict disparities, const int2 size, const int begin, const int second, const float gap,
                                 __global float2* restrict texels, __global float4* restrict parts)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    const Samples samples = {from, (int2)((2 * x * from.x + size.x) / (2 * size.x), (2 * y * from.y + size.y) / (2 * size.y)),
                             (int2)((2 * (x + 1) * from.x + size.x) / (2 * size.x), (2 * (y + 1) * from.y + size.y) / (2 * size.y)), disparities,
                             (float2)((x + 0.5f) * from.x / size.x, (y + 0.5f) * from.y / size.y)};
    const Surfaces surfaces = surfaces_of(samples, gap);
    const int at = y * size.x + x;
    store(surfaces.first, texels + begin + at, parts + begin + at);
    store(surfaces.behind, texels + second + at, parts + second + at);
}

// surfaces_of_samples: a map with samples of some of its texels; the others are what their depth says.
//
//   blocks [size.y][size.x]  where a texel's samples are; -1: it has none
//   depth  [size.y][size.x]  planar
//   disparities [blocks][side][side]  of the samples
// The others as above.
__kernel void surfaces_of_samples(const int2 size, const int begin, const int second, const float gap, const int side, __global const int* restrict blocks,
                                  __global const float* restrict depth, __global const float* restrict disparities, __global float2* restrict texels, __global float4* restrict parts)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    const int at = y * size.x + x, block = blocks[at];
    const float d = disparity_of(depth[at]);
    Surface none = {0.0f, 0.0f, 0.0f, (float4)(0.0f)};
    Surfaces surfaces = {none, none};
    if (block >= 0) {
        const Samples samples = {(int2)(side), (int2)(0), (int2)(side), disparities + (size_t)block * side * side, (float2)(0.5f * side)};
        surfaces = surfaces_of(samples, gap);
    } else if (d > 0.0f) {
        surfaces.first.d = d;
        surfaces.first.share = 1.0f;
    }
    store(surfaces.first, texels + begin + at, parts + begin + at);
    store(surfaces.behind, texels + second + at, parts + second + at);
}

// --- Patches -----------------

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

inline MicroPatch nothing()
{
    const MicroPatch patch = {0.0f, 0.0f, 0.0f, {0.0f, 0.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}, 0, 0.0f, 1.0f, 0.0f, 1.0f};
    return patch;
}

// What micro_patches reads of a map. gap: the step of disparity that opens half a texel, across and down; others, parts: null where there are none.
typedef struct {
    int2 size;
    float precision;
    float2 gap;
    __global const float2 *texels, *others;
    __global const float4* parts;
} TexelMap;

// A texel's patch from its edges' disparities. flags: JOINED_...
inline MicroPatch patch_of(const TexelMap map, const int at, const float d, const float left, const float right, const float bottom, const float top, const int flags)
{
    MicroPatch patch = nothing();
    patch.middle = d;
    patch.left = alone(left);
    patch.right = alone(right);
    patch.top = alone(top);
    patch.bottom = alone(bottom);
    patch.reach = fmax(fmax(d, fmax(left, right)), fmax(top, bottom));
    patch.least = fmin(fmin(d, fmin(left, right)), fmin(top, bottom));
    patch.flags = FULL | flags;
    if (map.parts && map.texels[at].y < 1.0f) {
        const float4 part = map.parts[at];
        patch.x0 = part.s0;
        patch.x1 = part.s1;
        patch.y0 = part.s2;
        patch.y1 = part.s3;
        if (part.s0 > 0.0f || part.s1 < 1.0f || part.s2 > 0.0f || part.s3 < 1.0f) patch.flags &= ~FULL;
    }
    return patch;
}

// The patch of any texel; reach 0: nothing is there.
inline MicroPatch texel_patch(const TexelMap map, const int x, const int y)
{
    if (x >= map.size.x || y >= map.size.y) return nothing();
    const int at = y * map.size.x + x;
    const float d = map.texels[at].x;
    if (!(d > 0.0f)) return nothing();
    const float other = map.others ? map.others[at].x : 0.0f;
    const Rim rim = {d, other > 0.0f ? other : d, map.precision};
    float row[5], column[5];
    for (int i = 0; i < 5; ++i) {
        row[i] = disparity_at(map.texels, map.size, x + i - 2, y);
        column[i] = disparity_at(map.texels, map.size, x, y + i - 2);
    }
    const bool right_half = 2 * x + 1 > map.size.x, lower_half = 2 * y + 1 > map.size.y;
    const float left = edge_disparity(rim, row[4], row[3], row[1], row[0], !right_half, map.gap.x);
    const float right = edge_disparity(rim, row[0], row[1], row[3], row[4], right_half, map.gap.x);
    const float top = edge_disparity(rim, column[4], column[3], column[1], column[0], !lower_half, map.gap.y);
    const float bottom = edge_disparity(rim, column[0], column[1], column[3], column[4], lower_half, map.gap.y);
    const int flags = (is_one(row[3], d, row[1], row[0], map.precision, map.gap.x) ? JOINED_LEFT : 0)
                      | (is_one(row[1], d, row[3], row[4], map.precision, map.gap.x) ? JOINED_RIGHT : 0)
                      | (is_one(column[3], d, column[1], column[0], map.precision, map.gap.y) ? JOINED_TOP : 0)
                      | (is_one(column[1], d, column[3], column[4], map.precision, map.gap.y) ? JOINED_BOTTOM : 0);
    return patch_of(map, at, d, left, right, bottom, top, flags);
}

// The patches of 2 x 2 texels inside a surface, which most are: they and all beside them are there, no step opens more than `gap`. What texel_patch finds
// for each, sooner. Whether they are such.
inline bool plain_patches(const TexelMap map, const int x, const int y, MicroPatch* patches)
{
    if (x < 1 || y < 1 || x + 2 >= map.size.x || y + 2 >= map.size.y) return false;
    __global const float2* const middle = map.texels + y * map.size.x + x;
    const int down = map.size.x;
    const float4 above = (float4)(0.0f, middle[-down].x, middle[1 - down].x, 0.0f), upper = (float4)(middle[-1].x, middle[0].x, middle[1].x, middle[2].x);
    const float4 lower = (float4)(middle[down - 1].x, middle[down].x, middle[down + 1].x, middle[down + 2].x);
    const float4 below = (float4)(0.0f, middle[2 * down].x, middle[2 * down + 1].x, 0.0f);
    const float least = fmin(fmin(fmin(upper.s0, upper.s1), fmin(upper.s2, upper.s3)), fmin(fmin(lower.s0, lower.s1), fmin(lower.s2, lower.s3)));
    if (!(fmin(least, fmin(fmin(above.s1, above.s2), fmin(below.s1, below.s2))) > 0.0f)) return false;
    const float3 upper_across = fabs(upper.s123 - upper.s012), lower_across = fabs(lower.s123 - lower.s012);
    const float2 first = fabs(upper.s12 - above.s12), second = fabs(lower.s12 - upper.s12), third = fabs(below.s12 - lower.s12);
    const float across = fmax(fmax(fmax(upper_across.x, upper_across.y), upper_across.z), fmax(fmax(lower_across.x, lower_across.y), lower_across.z));
    const float along = fmax(fmax(fmax(first.x, first.y), fmax(second.x, second.y)), fmax(third.x, third.y));
    if (!(across <= map.gap.x && along <= map.gap.y)) return false;
    const int at = y * map.size.x + x, flags = JOINED_LEFT | JOINED_RIGHT | JOINED_TOP | JOINED_BOTTOM;
    const float3 upper_edges = 0.5f * (upper.s012 + upper.s123), lower_edges = 0.5f * (lower.s012 + lower.s123);
    const float2 tops = 0.5f * (upper.s12 + above.s12), middles = 0.5f * (upper.s12 + lower.s12), bottoms = 0.5f * (lower.s12 + below.s12);
    patches[0] = patch_of(map, at, upper.s1, upper_edges.s0, upper_edges.s1, middles.s0, tops.s0, flags);
    patches[1] = patch_of(map, at + 1, upper.s2, upper_edges.s1, upper_edges.s2, middles.s1, tops.s1, flags);
    patches[2] = patch_of(map, at + down, lower.s1, lower_edges.s0, lower_edges.s1, bottoms.s0, middles.s0, flags);
    patches[3] = patch_of(map, at + down + 1, lower.s2, lower_edges.s1, lower_edges.s2, bottoms.s1, middles.s1, flags);
    return true;
}

// 2 x 2 patches as one: left and right of the upper row, then of the lower. One that is not FULL has its surfaces' area, where they lie.
inline MicroPatch joined(const MicroPatch* parts)
{
    MicroPatch all = nothing();
    float area = 0.0f, depths = 0.0f;
    float2 begin = (float2)(1.0f), end = (float2)(0.0f), middle = (float2)(0.0f);
    int flags[4];
    all.least = MAXFLOAT;
    all.left = all.right = all.top = all.bottom = none();
    for (int i = 0; i < 4; ++i) {
        const MicroPatch p = parts[i];
        flags[i] = 0;
        if (p.reach == 0.0f) continue;
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
    if (!(area > 0.0f)) return nothing();
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
    return all;
}

// micro_patches: the texels' edges and the first level of patches above them, of every map.
//
//   gap            the step of disparity that opens half a texel, across and down
//   other [maps]   of each map the number of the one that shows the other side of its bodies; -1: none
//   texels, parts [maps][height][width]   (disparity, covered share); of surfaces_of_texels where has_parts, else texels are covered whole
//   edges, texel_reach [maps][height][width]   disparities of the left, right, bottom and top edge; the greatest of all, 0 where nothing is: there no edges are
//                                              written
//   reach, patches [maps][above]               the levels above the texels: greatest disparity, 0 where nothing is; there no patch is written
//
// Launched over the first level's patches, the maps behind each other.
__kernel void micro_patches(const int2 size, const int maps, const int above, const float precision, const float2 gap, const int has_parts, __global const int* restrict other,
                            __global const float2* restrict texels, __global const float4* restrict parts, __global float4* restrict edges,
                            __global float* restrict texel_reach, __global float* restrict reach, __global MicroPatch* restrict patches)
{
    const int2 level = (size + 1) / 2;
    const int x = get_global_id(0), map_number = get_global_id(1) / level.y, y = get_global_id(1) % level.y;
    if (x >= level.x || map_number >= maps) return;
    const int count = size.x * size.y, opposite = other[map_number];
    const TexelMap map = {size, precision, gap, texels + map_number * count, opposite >= 0 ? texels + opposite * count : 0, has_parts ? parts + map_number * count : 0};
    MicroPatch four[4];
    const bool plain = plain_patches(map, 2 * x, 2 * y, four);
    for (int i = 0; i < 4; ++i) {
        const int column = 2 * x + (i & 1), row = 2 * y + (i >> 1);
        if (!plain) four[i] = texel_patch(map, column, row);
        if (column >= size.x || row >= size.y) continue;
        const int at = map_number * count + row * size.x + column;
        texel_reach[at] = four[i].reach;
        if (four[i].reach > 0.0f) edges[at] = (float4)(four[i].left.low, four[i].right.low, four[i].bottom.low, four[i].top.low);
    }
    const MicroPatch all = joined(four);
    const int at = map_number * above + y * level.x + x;
    reach[at] = all.reach;
    if (all.reach > 0.0f) patches[at] = all;
}

// joined_patches: the levels above the first, of every map, as micro_patches has them.
//
//   nearest [maps][last level]  the greatest disparity of each of the last patches
//
// Launched with a work-group for each of the last level's patches, the maps behind each other: nothing below it is another one's.
__kernel void joined_patches(const int2 size, const int maps, const int above, __global float* reach, __global MicroPatch* patches, __global float* restrict nearest)
{
    const Levels levels = levels_of(size);
    const int2 roots = levels.sizes[PATCH_LEVELS];
    const int root_x = get_group_id(0), map_number = get_group_id(1) / roots.y, root_y = get_group_id(1) % roots.y;
    __global float* const own_reach = reach + map_number * above;
    __global MicroPatch* const own_patches = patches + map_number * above;
    for (int level = 2; level <= PATCH_LEVELS; ++level) {
        barrier(CLK_GLOBAL_MEM_FENCE);
        const int wide = 1 << (PATCH_LEVELS - level);
        const int2 there = levels.sizes[level], under = levels.sizes[level - 1];
        for (int i = get_local_id(1) * get_local_size(0) + get_local_id(0); i < wide * wide; i += get_local_size(0) * get_local_size(1)) {
            const int x = root_x * wide + i % wide, y = root_y * wide + i / wide;
            if (map_number >= maps || x >= there.x || y >= there.y) continue;
            MicroPatch four[4];
            for (int k = 0; k < 4; ++k) {
                const int column = 2 * x + (k & 1), row = 2 * y + (k >> 1), at = levels.begins[level - 1] + row * under.x + column;
                four[k] = column < under.x && row < under.y && own_reach[at] > 0.0f ? own_patches[at] : nothing();
            }
            const MicroPatch all = joined(four);
            const int at = levels.begins[level] + y * there.x + x;
            own_reach[at] = all.reach;
            if (all.reach > 0.0f) own_patches[at] = all;
            if (level == PATCH_LEVELS) nearest[map_number * roots.x * roots.y + y * roots.x + x] = all.reach;
        }
    }
}

// solid_patches: marks what is SOLID. A receiver sees the outermost places of a patch's edges; they lie beyond the true ones by no more than the patch's
// range of disparities moves a place on the map. Where the same surface goes on for twice that, it hides what lies between.
//
//   moves  by how many texels one unit of disparity moves a place on the map, for light from the light's edge
//
// Launched over the patches above the texels, by maps.
__kernel void solid_patches(const int2 size, const int maps, const int above, const float2 moves, __global const float* restrict all_reach, __global MicroPatch* all_patches)
{
    const int number = get_global_id(0), map_number = get_global_id(1);
    if (number >= above || map_number >= maps) return;
    const Levels levels = levels_of(size);
    int level = 1;
    while (level < PATCH_LEVELS && number >= levels.begins[level + 1]) ++level;
    const int2 there = levels.sizes[level];
    const int at = number - levels.begins[level], x = at % there.x, y = at / there.x;
    if (x < 1 || y < 1 || x >= there.x - 1 || y >= there.y - 1) return;
    __global const float* const level_reach = all_reach + map_number * above + levels.begins[level];
    __global MicroPatch* const patches = all_patches + map_number * above + levels.begins[level];
    if (level_reach[at] == 0.0f || !(patches[at].flags & FULL)) return;
    float reach = 0.0f, least = MAXFLOAT;
    int all = FULL;
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
            const int near = at + j * there.x + i;
            if (level_reach[near] == 0.0f) return;
            const int flags = patches[near].flags, beside = (i < 1 ? JOINED_RIGHT : 0) | (j < 1 ? JOINED_BOTTOM : 0);
            if ((flags & beside) != beside) all = 0;
            all &= flags;
            reach = fmax(reach, patches[near].reach);
            least = fmin(least, patches[near].least);
        }
    const float moved = fmax(moves.x, moves.y) / (1 << level);
    if (all && (reach - least) * moved <= 0.5f) patches[at].flags |= SOLID;
}
