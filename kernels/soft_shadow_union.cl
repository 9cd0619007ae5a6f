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

// Rows of a list share a search while their box is at most so large a part of the light as seen through what is nearest to it.
#define SEARCH_SHARE 1.0f

// How much of half a texel's steps a texel beside the receiver may lie above its plane: patches lean as their surface does, so that what is left of them above a plane
// hides little. Measured (docs/soft_shadow_map.md, Self-shadowing).
#define ROOM_TO_BEND 0.25f

// A patch shows the surface that a receiver lies on as far as so many texels beside it, and so much of its own steps above it. Measured as above.
#define BESIDE_RECEIVER 0.25f
#define STEPS_OF_SURFACE 0.25f

// --- Bits -----------------

// 1 / x to 2 units in the last place, x a positive normal number: a linear guess of the bits and three Newton steps, a third of a division's time.
inline floatn reciprocal(const floatn x)
{
    const floatn guess = as_floatn((intn)(0x7ef311c7) - as_intn(x));
    const floatn once = fma(guess, fma(-x, guess, (floatn)(1.0f)), guess), twice = fma(once, fma(-x, once, (floatn)(1.0f)), once);
    return fma(twice, fma(-x, twice, (floatn)(1.0f)), twice);
}

// Where an edge lies in the light, in samples: 0 to SIDE, what lies beyond at the end.
inline floatn samples_at(const float edge, const floatn place, const floatn disparity, const floatn own, const floatn least, const float scale)
{
    const floatn d = select_lanes(least, disparity, disparity > least);
    const floatn at = fma((edge - place) * scale, (float)SIDE * reciprocal(d - own), (floatn)(0.5f * SIDE));
    const floatn low = select_lanes((floatn)(0.0f), at, at > (floatn)(0.0f));
    return select_lanes((floatn)(SIDE), low, low < (floatn)(SIDE));
}

// The bits that any lane has.
inline uint any_lane(const uintn v)
{
#if LANES == 1
    return v;
#else
#if LANES == 16
    const uint8 a = v.lo | v.hi;
#else
    const uint8 a = v;
#endif
    const uint4 b = a.lo | a.hi;
    const uint2 c = b.lo | b.hi;
    return c.x | c.y;
#endif
}

// A rectangle of patches of one surface that a tile's receivers see as one.
typedef struct {
    float a0, a1, b0, b1; // its edges in xi and eta
    float middle;         // its disparity, and those of its edges
    Along left, right, bottom, top;
} Rectangle;

// How wide a patch may be that stands for smaller ones, against what the tolerance allows: one that is covered whole hides what they hide; of one that is
// covered in part only the area is right, and what several maps show of one outline lies apart, which darkens (docs/tolerance.md).
#define COARSE_WHOLE 2.0f
#define COARSE_PART 0.5f

// Where the outermost place of an edge lies, the one at the lower end of the axis (`before`: of that axis) or at the upper end: nothing shines between two
// rectangles that share the edge.
inline floatn outermost(const float edge, const floatn place, const Along along, const bool lower, const floatn own, const floatn least, const float scale)
{
    const intn below = (floatn)(edge) < place;
    const floatn d = lower ? select_lanes((floatn)(along.high), (floatn)(along.low), below) : select_lanes((floatn)(along.low), (floatn)(along.high), below);
    return samples_at(edge, place, d, own, least, scale);
}

// LANES receivers, and what counts for them.
typedef struct {
    floatn xi, eta, d;
    Planes planes;
    Limits limits;
} Receivers;

// The ends in the light of a patch, from a0 with disparity d0 to a1 with d1, that shows the surface on which the receivers lie: one of its edges is not above
// `edge` (`low`), it reaches to their place, or nearly, and goes on there up to `edge`. It is seen edge-on: it hides what lies beyond its upper end, where it does
// not fall away from there. By its lower end, which is hardly before the receiver, it would hide all that shines on it.
inline void end_on_surface(floatn* end0, floatn* end1, const float a0, const float a1, const float d0, const float d1, const floatn place, const floatn edge, const intn low)
{
    const float wide = a1 - a0;
    const floatn here = fma(place - a0, (floatn)((d1 - d0) / wide), (floatn)(d0));
    const intn own = low & (here <= edge) & (place > a0 - BESIDE_RECEIVER * wide) & (place < a1 + BESIDE_RECEIVER * wide);
    if (d0 < d1)
        *end0 = select_lanes(*end0, select_lanes(*end1, (floatn)(SIDE), place < a1), own);
    else
        *end1 = select_lanes(*end1, select_lanes(*end0, (floatn)(0.0f), (place > a0) & (intn)(d0 > d1 ? -1 : 0)), own);
}

// Up to where a patch whose disparities differ by `steps` may show the surface that the receivers lie on.
inline floatn surface_edge(const Limits* limits, const float steps)
{
    const floatn own = limits->least + steps;
    return select_lanes(limits->edge, own, own > limits->edge);
}

// Sets what a rectangle hides from LANES receivers. plain: each of its edges has one disparity. own: STEPS_OF_SURFACE as the bias has it.
inline void hide(uintn* bits, const Rectangle* p, const bool plain, const float2 scale, const float own, const Receivers* receivers)
{
    const floatn xi = receivers->xi, eta = receivers->eta, d = receivers->d, least = receivers->limits.least;
    const floatn over = fma((floatn)(0.5f * (p->a0 + p->a1)), receivers->limits.lean_xi, fma((floatn)(0.5f * (p->b0 + p->b1)), receivers->limits.lean_eta, -receivers->limits.level));
    const intn counts = (p->middle > least) & (over > receivers->limits.facing * p->middle);
    floatn v_bottom, v_top, u_left, u_right;
    if (plain) {
        v_bottom = samples_at(p->b0, eta, (floatn)(p->bottom.low), d, least, scale.y);
        v_top = samples_at(p->b1, eta, (floatn)(p->top.low), d, least, scale.y);
        u_left = samples_at(p->a0, xi, (floatn)(p->left.low), d, least, scale.x);
        u_right = samples_at(p->a1, xi, (floatn)(p->right.low), d, least, scale.x);
        const floatn edge = surface_edge(&receivers->limits, own * (fabs(p->right.low - p->left.low) + fabs(p->top.low - p->bottom.low)));
        const intn low = edge >= fmin(fmin(p->left.low, p->right.low), fmin(p->bottom.low, p->top.low));
        if (!NONE(low)) {
            end_on_surface(&u_left, &u_right, p->a0, p->a1, p->left.low, p->right.low, xi, edge, low);
            end_on_surface(&v_bottom, &v_top, p->b0, p->b1, p->bottom.low, p->top.low, eta, edge, low);
        }
    } else {
        v_bottom = outermost(p->b0, eta, p->bottom, true, d, least, scale.y);
        v_top = outermost(p->b1, eta, p->top, false, d, least, scale.y);
        u_left = outermost(p->a0, xi, p->left, true, d, least, scale.x);
        u_right = outermost(p->a1, xi, p->right, false, d, least, scale.x);
    }
    const floatn v0 = select_lanes(v_bottom, v_top, v_top < v_bottom), v1 = select_lanes(v_top, v_bottom, v_top < v_bottom);
    const floatn u0 = select_lanes(u_left, u_right, u_right < u_left), u1 = select_lanes(u_right, u_left, u_right < u_left);
    // Beside the light both ends are at one of its own.
    const intn some = counts & (u1 > u0) & (v1 > v0);
    if (NONE(some)) return;

    const From from = columns_from(in_64ths(u0)), beyond = columns_from(in_64ths(u1));
    // Rows from 0 to SIDE; of the first and the last, some columns. Lanes that hide nothing have no rows.
    const intn first = convert_intn(v0), last = convert_intn(v1);
    const uintn low = ~columns_in(v0 - convert_floatn(first)), high = columns_in(v1 - convert_floatn(last));
    const uintn past = select_lanes((uintn)(0u), (uintn)(0xfffffffeu) << (as_uintn(last) & 31u), last < SIDE);
    const uintn rows = select_lanes((uintn)(0u), ((uintn)(0xffffffffu) << (as_uintn(first) & 31u)) & ~past, some);
    for (uint left = any_lane(rows); left != 0; left &= left - 1) {
        const int k = 31 - (int)clz(left & (0u - left));
        uintn columns = select_lanes((uintn)(0u), in_row(from, k) & ~in_row(beyond, k), (rows & (1u << k)) != 0u);
        columns = select_lanes(columns, columns & low, first == k);
        bits[k] |= select_lanes(columns, columns & high, last == k);
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

// Whether all of a patch counts for each of LANES receivers and shows no surface of theirs, or none of it counts. own: as above.
inline bool on_one_side(__global const MicroPatch* p, const Rectangle* r, const float own, const Limits* limits)
{
    const floatn middle = fma((floatn)(0.5f * (r->a0 + r->a1)), limits->lean_xi, fma((floatn)(0.5f * (r->b0 + r->b1)), limits->lean_eta, -limits->level));
    const floatn half_plane = fma(fabs(limits->lean_xi), (floatn)(0.5f * (r->a1 - r->a0)), fabs(limits->lean_eta) * (0.5f * (r->b1 - r->b0)));
    const floatn near = limits->facing * p->reach, far = limits->facing * p->least;
    const intn above = (p->least > surface_edge(limits, 2.0f * own * (p->reach - p->least))) & (middle - half_plane > fmax(near, far)), below = (p->reach <= limits->least) | (middle + half_plane <= fmin(near, far));
    return ALL(above | below);
}

// Which of four cells' penumbrae may meet the box of a tile, a bit each. x, y: of the level whose cells are so large; reach: their greatest disparities.
inline int meeting(const Search search, const float4 reach, const float2 cell, const int4 x, const int4 y)
{
    const float4 rise = reach - search.box.s4, extent_x = rise * search.half_inverse_scale.x, extent_y = rise * search.half_inverse_scale.y;
    const float4 wide = fma((float4)(0x1p-20f), 1.0f + extent_x, extent_x), high = fma((float4)(0x1p-20f), 1.0f + extent_y, extent_y); // as penumbra_extent
    const float4 left = convert_float4(x), top = convert_float4(y);
    const int4 meets = (reach > 0.0f) & (rise > 0.0f) & (left * cell.x - 1.0f - wide <= search.box.s1 + cell.x * 0.0625f) & ((left + 1.0f) * cell.x - 1.0f + wide >= search.box.s0 - cell.x * 0.0625f)
                       & (1.0f - (top + 1.0f) * cell.y - high <= search.box.s3 + cell.y * 0.0625f) & (1.0f - top * cell.y + high >= search.box.s2 - cell.y * 0.0625f);
    const int4 bits = meets & (int4)(1, 2, 4, 8);
    return bits.s0 | bits.s1 | bits.s2 | bits.s3;
}

// The greatest disparities of a cell's four parts, left and right above, then below; 0 beyond the map.
inline float4 reach_below(__global const float* reach, const int2 size, const int x, const int y)
{
    const int at = y * size.x + x;
    const bool right = x + 1 < size.x, down = y + 1 < size.y;
    return (float4)(reach[at], right ? reach[at + 1] : 0.0f, down ? reach[at + size.x] : 0.0f, right && down ? reach[at + size.x + 1] : 0.0f);
}

// Whether nothing is left to hide from LANES receivers.
inline bool all_hidden(const uintn* bits, const floatn d)
{
    uintn hidden = (uintn)(0xffffffffu);
    for (int k = 0; k < SIDE; ++k) hidden &= bits[k];
    return ALL((as_intn(hidden) == (intn)(-1)) | (d == (floatn)(NO_RECEIVER)));
}

// The box of LANES receivers, as tile_bounds has it of a tile's.
inline float8 box_of(const Receivers* r)
{
    const floatn most = (floatn)(NO_RECEIVER);
    const intn there = r->d != most;
    return (float8)(least_lane(select_lanes(most, r->xi, there)), -least_lane(select_lanes(most, -r->xi, there)), least_lane(select_lanes(most, r->eta, there)),
                    -least_lane(select_lanes(most, -r->eta, there)), least_lane(r->d), -least_lane(select_lanes((floatn)(0.0f), -r->d, there)), 0.0f, 0.0f);
}

inline float8 both_boxes(const float8 a, const float8 b)
{
    return (float8)(fmin(a.s0, b.s0), fmax(a.s1, b.s1), fmin(a.s2, b.s2), fmax(a.s3, b.s3), fmin(a.s4, b.s4), fmax(a.s5, b.s5), 0.0f, 0.0f);
}

// What receivers cannot see whatever casts: what does not shine, and what lies below the horizons of their own planes.
//
// Through a receiver and a sample at (u, v), 0 to 1 along the light's sides, goes the line xi + (u - 1/2) t / scale.x, eta + (v - 1/2) t / scale.y, d + t. It is above
// the plane where (u - 1/2) lean_xi / scale.x + (v - 1/2) lean_eta / scale.y > facing. A plane that is not known has no horizon.
//
// tangents: of half the light's view. A sphere's disc lies across the way to its centre (as horizon.cl has it), the samples' across the view: the horizon cuts theirs
// where it leaves as much of it as of the sphere's.
inline void start(uintn* bits, __global const uint* light_rows, const bool sphere, const Receivers* receivers, const float2 tangents, const float2 scale)
{
    const floatn across = receivers->planes.lean_xi * ((1.0f / SIDE) / scale.x), along = receivers->planes.lean_eta * ((1.0f / SIDE) / scale.y);
    for (int k = 0; k < SIDE; ++k) bits[k] = (uintn)(~light_rows[k]);
    // How far above the plane the light's centre is, against its corners or its rim.
    floatn over = -receivers->planes.facing, ends = (0.5f * SIDE) * (fabs(across) + fabs(along));
    if (sphere) {
        const floatn x = receivers->xi * tangents.x, y = receivers->eta * tangents.y, distance = sqrt(fma(x, x, fma(y, y, (floatn)(1.0f))));
        const floatn sine = over / distance, cosine = sqrt(fmax(fma(-sine, sine, (floatn)(1.0f)), (floatn)(1e-12f)));
        ends = (0.5f * SIDE) * sqrt(fma(across, across, along * along));
        // In radii of the sphere: its middle's height over the plane, and the disc's place of it.
        over = ends * (sine * distance / (cosine * receivers->d * (0.5f * tangents.x / scale.x)));
    }
    const intn whole = over >= ends;
    if (ALL(whole)) return;
    for (int k = 0; k < SIDE; ++k) {
        uintn below = (uintn)(0u);
        for (int i = 0; i < SIDE; ++i) {
            const floatn above = fma(across, (floatn)(i + phases[k] - 0.5f * SIDE), fma(along, (floatn)(k + heights[i] - 0.5f * SIDE), over));
            below |= select_lanes((uintn)(1u << i), (uintn)(0u), above > 0.0f);
        }
        bits[k] |= select_lanes(below, (uintn)(0u), whole);
    }
}

// How many rows of a list, of those from `first` on, one search is for: 1, 2, 4 or 8, as long as they lie close together compared with how far the light is
// seen through what is nearest to it. Their box comes along.
inline int rows_of_search(const float8* boxes, const int first, const float nearest, const float2 half_inverse_scale, float8* box)
{
    int rows = 1;
    *box = boxes[first];
    for (; 2 * rows <= ITEM_ROWS && first % (2 * rows) == 0; rows *= 2) {
        float8 wider = *box;
        for (int row = first + rows; row < first + 2 * rows; ++row) wider = both_boxes(wider, boxes[row]);
        const float2 seen = SEARCH_SHARE * (nearest - wider.s4) * half_inverse_scale;
        if (wider.s1 - wider.s0 > seen.x || wider.s3 - wider.s2 > seen.y) break;
        *box = wider;
    }
    return rows;
}

// Writes what of a textured light LANES receivers see, or as many of them as lie in the row. A row of samples is summed by itself, so that the shares of a white
// texture add up without rounding.
inline void write_textured(__global float* to, const uintn* bits, const int channels, __global const float* emission, const int left)
{
    for (int channel = 0; channel < channels; ++channel) {
        floatn seen = (floatn)(0.0f);
        for (int k = 0; k < SIDE; ++k) {
            floatn of_row = (floatn)(0.0f);
            for (int i = 0; i < SIDE; ++i) {
                const floatn share = (floatn)(emission[(channel * SIDE + k) * SIDE + i]);
                of_row += select_lanes(share, (floatn)(0.0f), (bits[k] & (1u << i)) != 0u);
            }
            seen += of_row;
        }
        float lanes[LANES];
        store_lanes(seen, lanes);
        for (int lane = 0; lane < LANES && lane < left; ++lane) to[lane * channels + channel] = fmin(lanes[lane], 1.0f);
    }
}

// soft_shadow_union: the share of the light that each receiver sees past the micro-patches of `maps` occluder maps of one size.
//
//   coarse                             how much of the light's width a patch may hide that is not FULL
//   nearest                            the greatest disparity on the maps
//   texels, edges, texel_reach, parts [maps][height][width], reach, patches [maps][above]   as micro_patches.cl has them; parts: null where texels are whole
//   light_rows [SIDE], light_samples   which samples shine, and how many: all, of a disc those inside
//   emission [channels][SIDE][SIDE]    a texture's share of the whole light in each sample's cell, row by row from the light's lower edge; channels 0: none
//   visibility [height][width], of a texture [height][width][channels]
//   the rest                           as in soft_shadow_map.cl
__kernel void soft_shadow_union(const ReceiverView receivers, const OccluderView occluders, const int maps, const int above, const float nearest, const float bias,
                                const float precision, const int has_planes, const int lists, const float coarse, __global const float* restrict reach,
                                __global const MicroPatch* restrict patches, __global const float2* restrict texels, __global const float4* restrict edges,
                                __global const float* restrict texel_reach, __global const float4* restrict parts, __global const float8* restrict bounds,
                                __global const float* restrict xi, __global const float* restrict eta, __global const float* restrict d,
                                __global const float* restrict planes, __global const uint* restrict light_rows, const int light_samples,
                                const int channels, __global const float* restrict emission, __global float* restrict visibility, __global uint* restrict evaluated, __global const volatile int* stop)
{
    const int x = get_global_id(0) * LANES, y = get_global_id(1) * ITEM_ROWS;
    if (x >= receivers.stride || y >= receivers.rows) return;
    const int tile = (y / TILE_ROWS) * (receivers.stride / TILE_WIDTH) + x / TILE_WIDTH;

    const float2 scale = (float2)(occluders.light_scale_x, occluders.light_scale_y);
    const int2 size = (int2)(occluders.width, occluders.height);
    const Levels levels = levels_of(size);
    const float steps_of_surface = STEPS_OF_SURFACE * bias;
    uint count = 0;
    Receivers own[ITEM_ROWS];
    float8 boxes[ITEM_ROWS];
    for (int row = 0; row < ITEM_ROWS; ++row) {
        const int place = (y + row) * receivers.stride + x;
        own[row].xi = load_lanes(xi + place);
        own[row].eta = load_lanes(eta + place);
        own[row].d = load_lanes(d + place);
        own[row].planes = planes_of(has_planes, planes, receivers.stride * receivers.rows, place);
        if (lists) boxes[row] = box_of(&own[row]);
    }
    int together = ITEM_ROWS;
    for (int top = 0; top < ITEM_ROWS; top += together) {
        Search search = {bounds[tile], 0.5f / scale, (float2)(occluders.texel_x, occluders.texel_y)};
        if (lists) together = rows_of_search(boxes, top, nearest, search.half_inverse_scale, &search.box);
        uintn bits[ITEM_ROWS][SIDE];
        bool over[ITEM_ROWS]; // nothing is left to hide
        int rows_left = together;
        for (int row = 0; row < together; ++row) {
            start(bits[row], light_rows, light_samples < SIDE * SIDE && !receivers.light_orthographic, &own[top + row], 1.0f / (float2)(receivers.per_light_x, receivers.per_light_y), scale);
            over[row] = has_planes && all_hidden(bits[row], own[top + row].d);
            rows_left -= over[row];
        }
        const int2 last_size = levels.sizes[PATCH_LEVELS];
        const int4 roots = window(search, nearest, search.texel * (1 << PATCH_LEVELS), (int2)(0), last_size);
        for (int map = 0; map < maps && rows_left > 0; ++map) {
            const int first_texel = map * size.x * size.y, first_patch = map * above;
            bool has_limits = false;
            for (int root = roots.y * last_size.x; root < roots.w * last_size.x && rows_left > 0; ++root) {
                if (root % last_size.x < roots.x || root % last_size.x >= roots.z) continue;
                if (stopped(stop)) return;
                // Depth first, of what meets the box.
                int3 cells[3 * PATCH_LEVELS + 1]; // x, y, level
                cells[0] = (int3)(root % last_size.x, root / last_size.x, PATCH_LEVELS);
                const float root_reach = reach[first_patch + levels.begins[PATCH_LEVELS] + root];
                int left = meeting(search, (float4)(root_reach, 0.0f, 0.0f, 0.0f), search.texel * (1 << PATCH_LEVELS), (int4)(cells[0].x), (int4)(cells[0].y)) & 1;
                while (left > 0 && rows_left > 0) {
                    const int3 at = cells[--left];
                    const int number = (at.z == 0 ? first_texel : first_patch) + levels.begins[at.z] + at.y * levels.sizes[at.z].x + at.x;
                    const float2 cell = search.texel * (1 << at.z);
                    if (!has_limits) {
                        for (int row = 0; row < together; ++row)
                            own[top + row].limits = limits_with_planes(occluders, bias, ROOM_TO_BEND * bias, receiver_precisions(receivers, precision, own[top + row].d), own[top + row].planes, texels + first_texel, 0,
                                                                       own[top + row].xi, own[top + row].eta, own[top + row].d);
                        has_limits = true;
                    }
                    bool whole = true;
                    Rectangle rectangle;
                    if (at.z == 0) {
                        rectangle = rectangle_of_texel(texels[number].x, edges[number], parts && texels[number].y < 1.0f ? parts[number] : (float4)(0.0f, 1.0f, 0.0f, 1.0f), at.x, at.y, cell);
                    } else {
                        // A part of a patch will do where the patch is small, as the receivers see it.
                        __global const MicroPatch* const p = patches + number;
                        const float over_receivers = p->least - search.box.s5, wide = (p->flags & FULL ? COARSE_WHOLE : COARSE_PART) * coarse * over_receivers;
                        const bool small = cell.x * scale.x <= wide && cell.y * scale.y <= wide && p->reach - p->least <= coarse * over_receivers;
                        whole = small || (p->flags & SOLID) || ((p->flags & FULL) && may_be_one(search, p->reach, p->least));
                        if (whole) {
                            rectangle = rectangle_of(*p, at.x, at.y, cell);
                            for (int row = 0; row < together && whole; ++row) whole = over[row] || on_one_side(p, &rectangle, steps_of_surface, &own[top + row].limits);
                        }
                    }
                    if (!whole) {
                        const int level = at.z - 1, x0 = 2 * at.x, y0 = 2 * at.y;
                        __global const float* const below = level == 0 ? texel_reach + first_texel : reach + first_patch + levels.begins[level];
                        const int met = meeting(search, reach_below(below, levels.sizes[level], x0, y0), 0.5f * cell, (int4)(x0, x0 + 1, x0, x0 + 1), (int4)(y0, y0, y0 + 1, y0 + 1));
                        for (int child = 0; child < 4; ++child)
                            if (met & (1 << child)) cells[left++] = (int3)(x0 + (child & 1), y0 + (child >> 1), level);
                        continue;
                    }
                    count += together;
                    for (int row = 0; row < together; ++row) {
                        if (over[row]) continue;
                        hide(bits[row], &rectangle, at.z == 0, scale, steps_of_surface, &own[top + row]);
                        if (at.z < 3 || !all_hidden(bits[row], own[top + row].d)) continue;
                        over[row] = true;
                        --rows_left;
                    }
                }
                for (int row = 0; row < together && has_limits; ++row)
                    if (!over[row] && all_hidden(bits[row], own[top + row].d)) {
                        over[row] = true;
                        --rows_left;
                    }
            }
        }

        for (int row = top; row < top + together && y + row < receivers.height; ++row) {
            if (channels > 0) {
                write_textured(visibility + ((y + row) * receivers.width + x) * channels, bits[row - top], channels, emission, receivers.width - x);
                continue;
            }
            const uintn hidden = samples_set(bits[row - top]);
            write_visibility(visibility + (y + row) * receivers.width + x, convert_floatn((uintn)(SIDE * SIDE) - hidden) * (1.0f / light_samples), receivers.width - x, 0);
        }
    }
    if (x % TILE_WIDTH == 0 && y % TILE_ROWS == 0) evaluated[tile] = count;
}
