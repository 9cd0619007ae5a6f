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

// A micro-patch: a texel with a disparity for each of its edges, so that neighbours of one surface share theirs.
typedef struct {
    float reach;                    // the greatest of the others; 0: nothing is there
    float middle;                   // the texel's own
    float left, right, bottom, top; // of its edges
    float least;                    // the least of the others
    int joined;                     // edges beyond which the same surface goes on: JOINED_...
} MicroPatch;

#define JOINED_LEFT 1
#define JOINED_RIGHT 2
#define JOINED_BOTTOM 4
#define JOINED_TOP 8

// The disparity of the edge between a texel (d) and the one beside it. inner, outer: the texels on either side, with those behind them; middle: halfway
// between the front and the back of what the texel shows.
//
// Shared with a neighbour of the same surface it is the mean of the two. At a silhouette the surface falls off towards its rim: a round one as a square
// root, of which the last texel's middle shows the slope; it ends where front and back meet.
inline float edge_disparity(const float behind_inner, const float inner, const float d, const float outer, const float behind_outer, const float middle,
                            const float precision)
{
    if (is_joined(inner, d, outer, behind_outer, precision)) return 0.5f * (d + outer);
    if (!is_joined(behind_inner, inner, d, outer, precision)) return middle;
    const float slope = d - inner, towards = middle - d;
    // Away from where front and back meet it is no rim but the plane's own slope.
    if (slope * towards <= 0.0f) return fmax(fma(0.5f, slope, d), 0.5f * d);
    return towards < 0.0f ? fmax(fma(1.4f, slope, d), middle) : fmin(fma(1.4f, slope, d), middle);
}

inline float disparity_at(__global const float2* texels, const int2 size, const int x, const int y)
{
    return x >= 0 && y >= 0 && x < size.x && y < size.y ? texels[y * size.x + x].x : 0.0f;
}

// micro_patches: the patches of a map.
//
//   texels, others [height][width]   (disparity, covered share) of the map and of the other side's; has_others: whether there is one
//   patches [height][width]
__kernel void micro_patches(const int2 size, const float precision, const int has_others, __global const float2* restrict texels,
                            __global const float2* restrict others, __global MicroPatch* restrict patches)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    const int at = y * size.x + x;
    const float d = texels[at].x;
    MicroPatch patch = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0};
    if (d > 0.0f) {
        const float other = has_others ? others[at].x : 0.0f, middle = other > 0.0f ? 0.5f * (d + other) : d;
        float row[5], column[5];
        for (int i = 0; i < 5; ++i) {
            row[i] = disparity_at(texels, size, x + i - 2, y);
            column[i] = disparity_at(texels, size, x, y + i - 2);
        }
        patch.middle = d;
        patch.left = edge_disparity(row[4], row[3], d, row[1], row[0], middle, precision);
        patch.right = edge_disparity(row[0], row[1], d, row[3], row[4], middle, precision);
        patch.top = edge_disparity(column[4], column[3], d, column[1], column[0], middle, precision);
        patch.bottom = edge_disparity(column[0], column[1], d, column[3], column[4], middle, precision);
        patch.reach = fmax(fmax(d, fmax(patch.left, patch.right)), fmax(patch.top, patch.bottom));
        patch.least = fmin(fmin(d, fmin(patch.left, patch.right)), fmin(patch.top, patch.bottom));
        patch.joined = (is_joined(row[3], d, row[1], row[0], precision) ? JOINED_LEFT : 0) | (is_joined(row[1], d, row[3], row[4], precision) ? JOINED_RIGHT : 0)
                       | (is_joined(column[3], d, column[1], column[0], precision) ? JOINED_TOP : 0)
                       | (is_joined(column[1], d, column[3], column[4], precision) ? JOINED_BOTTOM : 0);
    }
    patches[at] = patch;
}

// --- Bits -----------------

// Where an edge lies in the light, in samples: 0 to SIDE, and up to one beyond.
inline floatn samples_at(const float edge, const floatn place, const floatn disparity, const floatn own, const floatn least, const float scale)
{
    const floatn d = select_lanes(least, disparity, disparity > least);
    const floatn at = fma((edge - place) * scale, (float)SIDE / (d - own), (floatn)(0.5f * SIDE));
    const floatn low = select_lanes((floatn)(-1.0f), at, at > (floatn)(-1.0f));
    return select_lanes((floatn)(SIDE + 1), low, low < (floatn)(SIDE + 1));
}

inline float lowest_of(const floatn v)
{
    float lanes[LANES], low = MAXFLOAT;
    store_lanes(v, lanes);
    for (int lane = 0; lane < LANES; ++lane) low = lanes[lane] < low ? lanes[lane] : low;
    return low;
}

// The disparities that an edge has along a rectangle.
typedef struct {
    float low, high;
} Along;

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

    const floatn from_column = select_lanes((floatn)(0.0f), u0, u0 > (floatn)(0.0f)), to_column = select_lanes((floatn)(SIDE), u1, u1 < (floatn)(SIDE));
    const floatn first = floor(v0), last = floor(v1);
    const uintn low = ~columns_in(v0 - first), high = columns_in(v1 - last);
    const int from = max(convert_int(lowest_of(select_lanes((floatn)(SIDE), first, some))), 0),
              to = min(convert_int(-lowest_of(select_lanes((floatn)(0.0f), -last, some))), SIDE - 1);
    for (int k = from; k <= to; ++k) {
        const floatn row = (floatn)(k), phase = (floatn)(phases[k]);
        uintn columns = columns_from(from_column - phase) & ~columns_from(to_column - phase);
        columns &= select_lanes((uintn)(0u), select_lanes((uintn)(0xffffffffu), low, row == first), some & (row >= first));
        columns &= select_lanes((uintn)(0u), select_lanes((uintn)(0xffffffffu), high, row == last), row <= last);
        bits[k] |= columns;
    }
}

// --- Patches that are seen as one -----------------

// A run of patches in a row, or such runs below each other.
typedef struct {
    int first, last, top_row, bottom_row; // texels
    float reach, least;                   // greatest and least disparity of all its edges
    float middle_sum;
    Along left, right, bottom, top;
    int joined;                           // edges beyond which the surface goes on everywhere
} Run;

inline Along both(const Along a, const Along b)
{
    const Along result = {fmin(a.low, b.low), fmax(a.high, b.high)};
    return result;
}

// How far the disparities of patches may differ that tile's receivers see as one: an edge, at most half the light from its middle, then moves by less than half a
// sample.
inline bool may_be_one(const Search search, const float reach, const float least) { return (reach - least) * (float)SIDE <= least - search.box.s5; }

inline Run run_of(const MicroPatch p, const int i, const int j)
{
    const Run run = {i, i, j, j, p.reach, p.least, p.middle, {p.left, p.left}, {p.right, p.right}, {p.bottom, p.bottom}, {p.top, p.top}, p.joined};
    return run;
}

// The texels of row j from `first` to below `last` with something above the tile's furthest receiver, in runs; at most BLOCK.
inline int runs_of_row(Run* runs, __global const MicroPatch* patches, const int width, const Search search, const int j, const int first, const int last)
{
    int found = 0;
    bool open = false;
    for (int i = first; i < last; ++i) {
        const MicroPatch p = patches[j * width + i];
        if (!(p.middle > search.box.s4)) {
            open = false;
            continue;
        }
        if (open) {
            Run* const run = runs + found - 1;
            const float reach = fmax(run->reach, p.reach), least = fmin(run->least, p.least);
            if ((p.joined & JOINED_LEFT) && may_be_one(search, reach, least)) {
                run->last = i;
                run->reach = reach;
                run->least = least;
                run->middle_sum += p.middle;
                const Run one = run_of(p, i, j);
                run->right = one.right;
                run->bottom = both(run->bottom, one.bottom);
                run->top = both(run->top, one.top);
                run->joined = (run->joined & p.joined & (JOINED_BOTTOM | JOINED_TOP)) | (run->joined & JOINED_LEFT) | (p.joined & JOINED_RIGHT);
                continue;
            }
        }
        runs[found++] = run_of(p, i, j);
        open = true;
    }
    return found;
}

// Whether `lower`, a run of one row, goes on with `upper`, which ends in the row above; then it is added.
inline bool add_row(Run* upper, const Run lower, const Search search)
{
    if (upper->bottom_row + 1 != lower.top_row || upper->first != lower.first || upper->last != lower.last || !(upper->joined & JOINED_BOTTOM) ||
        !(lower.joined & JOINED_TOP))
        return false;
    const float reach = fmax(upper->reach, lower.reach), least = fmin(upper->least, lower.least);
    if (!may_be_one(search, reach, least)) return false;
    upper->bottom_row = lower.bottom_row;
    upper->reach = reach;
    upper->least = least;
    upper->middle_sum += lower.middle_sum;
    upper->left = both(upper->left, lower.left);
    upper->right = both(upper->right, lower.right);
    upper->bottom = lower.bottom;
    upper->joined = (upper->joined & lower.joined & (JOINED_LEFT | JOINED_RIGHT)) | (upper->joined & JOINED_TOP) | (lower.joined & JOINED_BOTTOM);
    return true;
}

// Beyond which nothing goes on, an edge lies in the middle of where it is.
inline Along edge_of(const Along along, const int joined)
{
    const float middle = 0.5f * (along.low + along.high);
    const Along edge = {joined ? along.low : middle, joined ? along.high : middle};
    return edge;
}

inline Rectangle rectangle_of(const Run run, const float2 texel)
{
    const int columns = run.last - run.first + 1, rows = run.bottom_row - run.top_row + 1;
    const Rectangle rectangle = {run.first * texel.x - 1.0f,
                                 (run.last + 1) * texel.x - 1.0f,
                                 1.0f - (run.bottom_row + 1) * texel.y,
                                 1.0f - run.top_row * texel.y,
                                 run.middle_sum / (columns * rows),
                                 edge_of(run.left, run.joined & JOINED_LEFT),
                                 edge_of(run.right, run.joined & JOINED_RIGHT),
                                 edge_of(run.bottom, run.joined & JOINED_BOTTOM),
                                 edge_of(run.top, run.joined & JOINED_TOP)};
    return rectangle;
}

// The patches of a block, texels near.xy to below near.zw, that matter to a tile, as few rectangles; at most BLOCK BLOCK.
inline int rectangles_of(Rectangle* rectangles, __global const MicroPatch* patches, const int width, const Search search, const int4 near)
{
    Run open[2][BLOCK];
    int found = 0, count = 0;
    for (int j = near.y; j < near.w; ++j) {
        Run* const before = open[(j - near.y) & 1];
        Run* const now = open[(j - near.y + 1) & 1];
        const int runs = runs_of_row(now, patches, width, search, j, near.x, near.z);
        for (int b = 0; b < count; ++b) {
            bool goes_on = false;
            for (int n = 0; n < runs && !goes_on; ++n) {
                Run whole = before[b];
                goes_on = add_row(&whole, now[n], search);
                if (goes_on) now[n] = whole;
            }
            if (!goes_on) rectangles[found++] = rectangle_of(before[b], search.texel);
        }
        count = runs;
    }
    const Run* const rest = open[(near.w - near.y) & 1];
    for (int b = 0; b < count; ++b) rectangles[found++] = rectangle_of(rest[b], search.texel);
    return found;
}

// Whether nothing is left to hide from LANES receivers.
inline bool all_hidden(const uintn* bits, const floatn d)
{
    uintn hidden = (uintn)(0xffffffffu);
    for (int k = 0; k < SIDE; ++k) hidden &= bits[k];
    return ALL((as_intn(hidden) == (intn)(-1)) | (d == (floatn)(NO_RECEIVER)));
}

// soft_shadow_union: the share of the light that each receiver sees past the micro-patches of `sides` occluder maps of one size.
//
//   nearest                            the greatest disparity on the maps
//   patches_i [height][width]; blocks_i, superblocks_i: pyramids of their reach; of one map, the second is not read
//   texels_i, steps_i [height][width]  of the maps, for receivers whose plane is not known
//   the rest                           as in soft_shadow_map.cl
__kernel void soft_shadow_union(const ReceiverView receivers, const OccluderView occluders, const int sides, const float nearest, const float bias,
                                const float precision, const int has_planes, __global const MicroPatch* restrict patches_0, __global const MicroPatch* restrict patches_1,
                                __global const float2* restrict texels_0, __global const float2* restrict steps_0, __global const float2* restrict texels_1,
                                __global const float2* restrict steps_1, __global const float* restrict blocks_0, __global const float* restrict superblocks_0,
                                __global const float* restrict blocks_1, __global const float* restrict superblocks_1, __global const float8* restrict bounds,
                                __global const float* restrict xi, __global const float* restrict eta, __global const float* restrict d,
                                __global const float* restrict slope_xi, __global const float* restrict slope_eta, __global float* restrict visibility,
                                __global uint* restrict evaluated, __global const volatile int* stop)
{
    const int x = get_global_id(0) * LANES, y = get_global_id(1) * ITEM_ROWS;
    if (x >= receivers.stride || y >= receivers.rows) return;
    const int tile = (y / TILE_ROWS) * (receivers.stride / TILE_WIDTH) + x / TILE_WIDTH;

    uintn bits[ITEM_ROWS][SIDE];
    for (int row = 0; row < ITEM_ROWS; ++row)
        for (int k = 0; k < SIDE; ++k) bits[row][k] = (uintn)(0u);
    bool over[ITEM_ROWS]; // nothing is left to hide
    for (int row = 0; row < ITEM_ROWS; ++row) over[row] = false;
    int rows_left = ITEM_ROWS;
    uint count = 0;

    const float2 scale = (float2)(occluders.light_scale_x, occluders.light_scale_y);
    const Search search = {bounds[tile], 0.5f / scale, (float2)(occluders.texel_x, occluders.texel_y)};
    const int2 size = (int2)(occluders.width, occluders.height);
    const int2 block_count = (size + (BLOCK - 1)) / BLOCK, super_count = (block_count + (BLOCK - 1)) / BLOCK;
    const int4 supers = window(search, nearest, search.texel * (BLOCK * BLOCK), (int2)(0), super_count);
    for (int side = 0; side < sides; ++side) {
        __global const MicroPatch* const own_patches = side ? patches_1 : patches_0;
        __global const float* const own_blocks = side ? blocks_1 : blocks_0;
        __global const float* const own_supers = side ? superblocks_1 : superblocks_0;
        Limits limits[ITEM_ROWS];
        bool has_limits = false;
        for (int s = supers.y * super_count.x; s < supers.w * super_count.x && rows_left > 0; ++s) {
            const int2 super = (int2)(s % super_count.x, s / super_count.x);
            if (super.x < supers.x || super.x >= supers.z) continue;
            if (stopped(stop)) return;
            const int2 low = super * BLOCK;
            const int4 inside = window(search, own_supers[s], search.texel * BLOCK, low, min(low + BLOCK, block_count));
            for (int by = inside.y; by < inside.w; ++by)
                for (int bx = inside.x; bx < inside.z; ++bx) {
                    const int2 first = (int2)(bx, by) * BLOCK;
                    const int4 near = window(search, own_blocks[by * block_count.x + bx], search.texel, first, min(first + BLOCK, size));
                    Rectangle rectangles[BLOCK * BLOCK];
                    const int found = rectangles_of(rectangles, own_patches, size.x, search, near);
                    count += found;
                    for (int row = 0; row < ITEM_ROWS && found > 0; ++row) {
                        if (over[row]) continue;
                        const int at = (y + row) * receivers.stride + x;
                        const floatn own_xi = load_lanes(xi + at), own_eta = load_lanes(eta + at), own_d = load_lanes(d + at);
                        if (!has_limits)
                            limits[row] = limits_with_planes(occluders, bias, precision, has_planes, side ? texels_1 : texels_0, side ? steps_1 : steps_0,
                                                             has_planes ? load_lanes(slope_xi + at) : own_d, has_planes ? load_lanes(slope_eta + at) : own_d, own_xi,
                                                             own_eta, own_d);
                        for (int i = 0; i < found; ++i) hide(bits[row], rectangles[i], scale, own_xi, own_eta, own_d, limits[row]);
                    }
                    has_limits |= found > 0;
                }
            for (int row = 0; row < ITEM_ROWS && has_limits; ++row)
                if (!over[row] && all_hidden(bits[row], load_lanes(d + (y + row) * receivers.stride + x))) {
                    over[row] = true;
                    --rows_left;
                }
        }
    }

    for (int row = 0; row < ITEM_ROWS && y + row < receivers.height; ++row) {
        uintn hidden = (uintn)(0u);
        for (int k = 0; k < SIDE; ++k) hidden += popcount(bits[row][k]);
        write_visibility(visibility + (y + row) * receivers.width + x, 1.0f - convert_floatn(hidden) * (1.0f / (SIDE * SIDE)), receivers.width - x, 0);
    }
    if (x % TILE_WIDTH == 0 && y % TILE_ROWS == 0) evaluated[tile] = count;
}
