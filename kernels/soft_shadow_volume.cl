// Soft Shadow Volumes: penumbra wedges in gather form (Assarsson, A Real-Time Soft Shadow Volume Algorithm, 2003, Papers I to IV).
//
//     occlusion(p) = H(p) - sum over silhouette edges of A_e(p)
//
// H counts the light-facing triangles between p and the light's centre (Paper III, 3.2.1; counted in light space, so that it does not matter where the
// camera is). A_e is the share of the light beyond the edge as seen from p, inside the angle that the edge's ends make with the light's centre; it is
// positive where the centre lies on the edge's left (3.2.2, Fig. 8). Only receivers inside an edge's wedge have A_e other than 0, and a wedge is a bound
// for culling only.
//
// Specialisation constants
//   LANES, ITEM_ROWS, TILE_ROWS   as in soft_shadow_map.cl
//   LIGHT        RECTANGLE, or DISC: of a sphere, that which faces the receiver (these and the next: common/choices.h)
//   COVERAGE     LINEAR (Paper I), ANALYTIC (Paper IV, 4.2), TEXTURE (Paper III, 3.3)
//   CHANNELS     of the light: 1, or 3 for a coloured texture
//   LOOKUP       of the table: NEAREST, BILINEAR in the second end, QUADRILINEAR: bilinear in both
//   ACCUMULATOR  BINARY32; the papers' buffers, emulated: INT16 with 255 levels (Paper I), SIX_BITS (Paper III), TWELVE_BITS (Paper IV)
//
// Light space here: x and y in the light's half extents (its radius: z as well), so that the light is [-1, 1]^2 or the unit disc. A receiver is its tangents
// t = p.xy / p.z and its disparity d = 1 / p.z. The line from p through e meets the light's plane at (e.xy - t e.z) / (1 - e.z d).
#include "common/choices.h"
#include "common/shared.h"
#include "occluders.cl"
#include "receivers.cl"
#include "common/lanes.clh"
#include "common/stop.clh"
#include "coverage_table.cl"

#include "common/wedge_receivers.clh"
#include "common/wedge_culling.clh"

// --- The share of the light beyond an edge ----------------------------------------------------------------------------------------------

// An edge from its vertex of the lower number to the other; `weight` -1 where the silhouette passes it the other way.
typedef struct {
    float ax, ay, az, bx, by, bz, weight;
} Edge;

// Clips a range [from, to] of the edge to where f, which is f0 at its start and f1 at its end, is not negative.
inline void clip(floatn* from, floatn* to, const floatn f0, const floatn f1)
{
    const floatn zero = (floatn)(0.0f);
    const floatn at = f0 / (f0 - f1);
    *from = select_lanes(*from, at, (f0 < zero) & (at > *from));
    *to = select_lanes(*to, at, (f1 < zero) & (at < *to));
    *to = select_lanes(*to, (floatn)(-1.0f), (f0 < zero) & (f1 < zero));
}

// What lies behind the light's plane hides nothing: the range of the edge before it. The same for all receivers of a rectangle.
inline float2 before_light(const float az, const float bz)
{
    if (az < 0.0f && bz < 0.0f) return (float2)(0.0f, -1.0f);
    const float at = az / (az - bz);
    return (float2)(az < 0.0f ? at : 0.0f, bz < 0.0f ? at : 1.0f);
}

#include "common/wedge_analytic.clh"
#if COVERAGE == COVERAGE_LINEAR
#include "common/wedge_linear.clh"
#elif COVERAGE == COVERAGE_TEXTURE
#include "common/wedge_table.clh"
#endif

// The share beyond edge number `index` in each channel of the light. `data`: what the coverage keeps beside the edges.
__attribute__((always_inline)) inline void shares_beyond(floatn* shares, const Edge edge, const int index, const Receivers p, __global const float* data, const int size)
{
    // What this coverage does without.
    (void)index;
    (void)data;
    (void)size;
#if COVERAGE == COVERAGE_LINEAR
    shares[0] = share_by_planes(edge, data + index * WEDGE_PLANES, p);
#elif COVERAGE == COVERAGE_ANALYTIC
    shares[0] = share_beyond(edge, p);
#else
    shares_by_table(shares, edge, p, data, size);
#endif
}

#include "common/wedge_buffers.clh"

// --- Shading ------------------------------------------------------------------------------------------------------------------------------

// A triangle as the part of the light sees it: its vertices in order of their numbers; the plane's disparity 1 / z = n.x t.x + n.y t.y + n.z.
typedef struct {
    float ax, ay, az, bx, by, bz, cx, cy, cz, nx, ny, nz;
    float moved;      // by how much more its plane is off for being moved from the whole light's centre to the part's: 0 where both are one
    float from_whole; // the same of places, in tangents a disparity
    bool turned;      // a, b, c turn clockwise, seen from the part's centre
} Triangle;

// Row of 16 floats, from the whole light's centre: the vertices, the plane N . p = D.
inline Triangle triangle_of(__global const float* row, const bool turned, const WedgeLight light)
{
    const float x = light.centre_x, y = light.centre_y;
    Triangle t = {row[0] - x, row[1] - y, row[2], row[3] - x, row[4] - y, row[5], row[6] - x, row[7] - y, row[8], 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, turned};
    const float d = fma(-row[9], x, fma(-row[10], y, row[12]));
    const float nx = row[9] / d, ny = row[10] / d, nz = row[11] / d;
    // Edge-on to the part's centre it covers nothing: a plane of disparity 0 is before nothing.
    if (fabs(nx) < 1e18f && fabs(ny) < 1e18f && fabs(nz) < 1e18f) {
        t.nx = nx;
        t.ny = ny;
        t.nz = nz;
        t.moved = fabs(nx * x) + fabs(ny * y);
    }
    t.from_whole = 0x1p-23f * (fabs(x) + fabs(y));
    return t;
}

// Where it lies between the receivers and the light's centre.
__attribute__((always_inline)) inline intn behind_triangle(const Triangle t, const WedgeLight light, const Receivers p)
{
    // Nearer to the light than the receiver by more than rounding and bias explain: of the plane's three terms, of the receiver's place, and of its depth.
    const floatn near = fma((floatn)(t.nx), p.tx, fma((floatn)(t.ny), p.ty, (floatn)(t.nz)));
    const floatn place = fma((floatn)(light.position_error + t.from_whole), p.d, 0x1p-22f * (fabs(p.tx) + fabs(p.ty)));
    const floatn rounding = 0x1p-22f * (fabs(t.nx) * fabs(p.tx) + fabs(t.ny) * fabs(p.ty) + fabs(t.nz)) + (fabs(t.nx) + fabs(t.ny)) * place;
    const floatn own = fma((floatn)(0x1p-23f * t.moved), fabs(near), rounding);
    const floatn limit = p.d + ((0x1p-22f + 2.0f * (light.precision + light.depth_error * p.d)) * p.d + own + (fabs(t.nx) * light.bias_x + fabs(t.ny) * light.bias_y));
    const intn before = near > limit;
    if (NONE(before)) return before;
    const floatn ax = across(t.ax, t.az, p.tx), ay = across(t.ay, t.az, p.ty);
    const floatn bx = across(t.bx, t.bz, p.tx), by = across(t.by, t.bz, p.ty);
    const floatn cx = across(t.cx, t.cz, p.tx), cy = across(t.cy, t.cz, p.ty);
    const intn ab = left_of(ax, ay, bx, by), bc = left_of(bx, by, cx, cy), ac = left_of(ax, ay, cx, cy);
#if LANES == 1
    return t.turned ? !ab && !bc && ac : ab && bc && !ac;
#else
    return before & (t.turned ? ~ab & ~bc & ac : ab & bc & ~ac);
#endif
}

// The tile's box, in the part's half extents. `eye`: see below.
inline Tile tile_of(const float8 box, const WedgeLight light, const float4 eye)
{
    Tile tile;
    // Rounded as receivers_at does, which is monotone in both: the box holds its receivers to the bit, whichever end of d gives the least and the greatest.
    const float d0 = box.s4 * light.scale_d, d1 = box.s5 * light.scale_d;
    const float x0 = box.s0 * light.scale_x, x1 = box.s1 * light.scale_x, y0 = box.s2 * light.scale_y, y1 = box.s3 * light.scale_y;
    tile.x0 = fmin(fma(-light.centre_x, d0, x0), fma(-light.centre_x, d1, x0));
    tile.x1 = fmax(fma(-light.centre_x, d0, x1), fma(-light.centre_x, d1, x1));
    tile.y0 = fmin(fma(-light.centre_y, d0, y0), fma(-light.centre_y, d1, y0));
    tile.y1 = fmax(fma(-light.centre_y, d0, y1), fma(-light.centre_y, d1, y1));
    tile.d = d0;
    if (eye.w > 0.0f) {
        tile.x0 = fmin(tile.x0, eye.x);
        tile.x1 = fmax(tile.x1, eye.x);
        tile.y0 = fmin(tile.y0, eye.y);
        tile.y1 = fmax(tile.y1, eye.y);
        tile.d = fmin(tile.d, eye.z);
    }
    tile.reach = (float2)(light.reach_x, light.reach_y);
#if LIGHT == LIGHT_DISC
    // The disc that faces a receiver is tilted: a line that passes the centre within the radius meets the plane z = 0 within q, q <= (1 + t + q d), as the line's
    // own tangent is below t + q d. No bound, so no culling, where the receiver may be as near as the radius; nor is all that hides the disc then nearer to the
    // light's plane than the receiver: it may be as far from it as the disc reaches, z = 1.
    const float t = fmax(fabs(tile.x0), fabs(tile.x1)) + fmax(fabs(tile.y0), fabs(tile.y1));
    const bool beside = d1 >= 0.984375f;
    tile.reach *= beside ? 0x1p60f : (1.0f + t) / (1.0f - d1);
    if (beside) tile.d = fmin(tile.d, 0.5f);
#endif
    return tile;
}

// Which of the 16 boxes from `boxes` on are to be looked at; only those numbered `first` to below `last`.
inline uint chosen(const Tile tile, __global const float* boxes, const int culling, const float use_reach, const int first, const int last)
{
    const uint below = last >= 16 ? 0xffffu : (1u << last) - 1u;
    const uint above = first <= 0 ? 0xffffu : ~((1u << first) - 1u);
    return below & above & (culling == CULLING_NONE ? 0xffffu : bits_of(boxes_meet(tile, boxes, use_reach)));
}

// What a sheet adds to the occlusion of those before it, overlap sum. Of a surface that is not closed both sides hide, yet what they hide is mostly the same
// light: the side that hides more counts, and the first one's occlusion waits for the other's in `first` (0 where the tile does not see it: no edge's share
// and no triangle counts there).
inline floatn added(const floatn sheet, const int side, floatn* first)
{
    if (side == 0) return sheet;
    const floatn zero = (floatn)(0.0f), more = side == 1 ? sheet : sheet - *first, rise = select_lanes(zero, more, more > zero);
    if (side == 1) *first = rise;
    return rise;
}

// Joins a sheet's occlusion to that of the sheets before (Paper IV, 5.1: Eq. 1 is half_min).
inline floatn joined(const floatn before, const floatn sheet, const int overlap)
{
    const floatn one = saturate(sheet);
    const intn bigger = one > before;
    const floatn more = select_lanes(before, one, bigger), less = select_lanes(one, before, bigger);
    if (overlap == OVERLAP_MAX) return more;
    if (overlap == OVERLAP_HALF_MIN) return saturate(fma(less, (floatn)(0.5f), more));
    return fma(-before, one, before + one);
}

// soft_shadow_volume: one light, or one part of it.
//
//   sheet_boxes, edge_boxes, triangle_boxes   boxes (boxes_meet) of sheets, and of groups of WEDGE_GROUP edges or triangles; blocks of 16 boxes
//   edge_ends [groups][6][16]                 ends of edges (edges_meet)
//   edges [groups][16][8]                     Edge, and padding
//   triangle_groups [groups]                  a group of triangles; which of them face the part, and 16 bits up, turn clockwise
//   triangle_extents [groups][6][16]          boxes of single triangles, from the whole light's centre: triangles_meet
//   triangles [groups][16][16]                triangle_of
//   visibility [height][width][CHANNELS]      share of the light that is seen, 0 to 1
//   coverage, coverage_size                   linear: the wedges' planes; texture: the table and its n; else nothing
//   evaluated [tiles][2]                      edges, and triangles, that were evaluated against the tile's receivers; added to with further parts
//   stop                                      common/stop.clh, asked between every 16 groups
//
// `eye`: with w 1, the receivers' camera in light space (tangents in half extents, disparity): tiles are then bounded by it and by their furthest receivers,
// which is what one depth a tile can tell (Paper II, section 4, for comparison).
//
// Launched over work-items, (stride / LANES) x (rows / ITEM_ROWS). Edges and triangles are added in one order, whatever the tile and the culling.
__kernel void soft_shadow_volume(const ReceiverView view, const WedgeLight light, const float4 eye, __global const Sheet* restrict sheets,
                                 __global const float* restrict sheet_boxes, __global const float* restrict edge_boxes,
                                 __global const float* restrict edge_ends, __global const float* restrict edges, __global const float* restrict triangle_boxes,
                                 __global const int2* restrict triangle_groups, __global const float* restrict triangle_extents,
                                 __global const float* restrict triangles,
                                 __global const float8* restrict bounds, __global const float* restrict xi, __global const float* restrict eta,
                                 __global const float* restrict d, __global float* restrict visibility, __global uint2* restrict evaluated, __global const float* restrict coverage,
                                 const int coverage_size, __global const volatile int* stop)
{
    const int x = get_global_id(0) * LANES, y = get_global_id(1) * ITEM_ROWS;
    if (x >= view.stride || y >= view.rows) return;
    const int number = (y / TILE_ROWS) * (view.stride / TILE_WIDTH) + x / TILE_WIDTH;
    const bool empty = bounds[number].s6 == 0.0f;
    const Tile tile = tile_of(bounds[number], light, eye);
    const float2 centre = (float2)(light.centre_x, light.centre_y);

    floatn occlusion[CHANNELS][ITEM_ROWS];
    for (int channel = 0; channel < CHANNELS; ++channel)
        for (int row = 0; row < ITEM_ROWS; ++row) occlusion[channel][row] = (floatn)(0.0f);
    floatn first[CHANNELS][ITEM_ROWS]; // of the pair whose first sheet is number `first_side`
    int first_side = -1;
    uint2 count = (uint2)(0);
    float2 spans[ITEM_ROWS];
    for (int row = 0; row < ITEM_ROWS && !empty; ++row) spans[row] = span_of(receivers_at(light, view.stride, xi, eta, d, x, y + row));

    for (int block = 0; block < light.sheets && !empty; block += 16) {
        uint sheet_bits = chosen(tile, sheet_boxes + block * 5, light.culling, 1.0f, 0, light.sheets - block);
        while (sheet_bits) {
            const int sheet_number = block + take_bit(&sheet_bits);
            const Sheet sheet = sheets[sheet_number];
            Sum sums[CHANNELS][ITEM_ROWS];
            for (int channel = 0; channel < CHANNELS; ++channel)
                for (int row = 0; row < ITEM_ROWS; ++row) clear(&sums[channel][row]);

            // Pairs of a group and of which of its triangles face the part.
            for (int groups = sheet.triangles_begin & ~15; groups < sheet.triangles_end; groups += 16) {
                if (stopped(stop)) return;
                uint group_bits = chosen(tile, triangle_boxes + groups * 5, light.culling, 0.0f, sheet.triangles_begin - groups, sheet.triangles_end - groups);
                while (group_bits) {
                    const int2 pair = triangle_groups[groups + take_bit(&group_bits)];
                    __global const float* const extents = triangle_extents + pair.x * 96;
                    uint bits = (uint)pair.y & 0xffffu & (light.culling == CULLING_NONE ? 0xffffu : bits_of(triangles_meet(tile, extents, centre)));
                    while (bits) {
                        const int i = take_bit(&bits);
                        const Triangle triangle = triangle_of(triangles + (pair.x * 16 + i) * 16, (pair.y >> (16 + i)) & 1, light);
                        // Triangles are often smaller than a tile: only rows that they reach.
                        const float2 move = moved_by(light.centre_y, extents[64 + i], extents[80 + i]);
                        const float low = extents[32 + i] - move.y, high = extents[48 + i] - move.x;
                        const float margin = 0x1p-18f * (fabs(low) + fabs(high) + fabs(move.x) + fabs(move.y));
                        ++count.y;
                        for (int row = 0; row < ITEM_ROWS; ++row)
                            if (light.culling == CULLING_NONE || (high + margin >= spans[row].x && low - margin <= spans[row].y)) {
                                const intn behind = behind_triangle(triangle, light, receivers_at(light, view.stride, xi, eta, d, x, y + row));
                                for (int channel = 0; channel < CHANNELS; ++channel) add_hard(&sums[channel][row], behind);
                            }
                    }
                }
            }

            for (int groups = sheet.edges_begin & ~15; groups < sheet.edges_end; groups += 16) {
                if (stopped(stop)) return;
                uint group_bits = chosen(tile, edge_boxes + groups * 5, light.culling, 1.0f, sheet.edges_begin - groups, sheet.edges_end - groups);
                while (group_bits) {
                    const int group = groups + take_bit(&group_bits);
                    uint bits = light.culling == CULLING_NONE ? 0xffffu : bits_of(edges_meet(tile, edge_ends + group * 96, light.culling == CULLING_LOOSE));
                    while (bits) {
                        const int index = group * 16 + take_bit(&bits);
#if COVERAGE == COVERAGE_LINEAR
                        if (light.culling != CULLING_NONE && !wedge_meets(tile, coverage + index * WEDGE_PLANES)) continue;
#endif
                        const float8 e = vload8(index, edges);
                        const Edge edge = {e.s0, e.s1, e.s2, e.s3, e.s4, e.s5, e.s6};
                        ++count.x;
                        for (int row = 0; row < ITEM_ROWS; ++row) {
                            floatn shares[CHANNELS];
                            shares_beyond(shares, edge, index, receivers_at(light, view.stride, xi, eta, d, x, y + row), coverage, coverage_size);
                            for (int channel = 0; channel < CHANNELS; ++channel) add_share(&sums[channel][row], edge.weight * shares[channel]);
                        }
                    }
                }
            }

            // The other side of a surface whose first the tile does not see.
            const bool alone = sheet.side == 2 && first_side != sheet_number - 1;
            if (sheet.side == 1) first_side = sheet_number;
            for (int channel = 0; channel < CHANNELS; ++channel)
                for (int row = 0; row < ITEM_ROWS; ++row) {
                    const floatn sheet_occlusion = occlusion_of(&sums[channel][row]), before = occlusion[channel][row];
                    if (alone) first[channel][row] = (floatn)(0.0f);
                    occlusion[channel][row] = light.overlap == OVERLAP_SUM ? before + added(sheet_occlusion, sheet.side, &first[channel][row])
                                                                 : joined(before, sheet_occlusion, light.overlap);
                }
        }
    }

    for (int channel = 0; channel < CHANNELS; ++channel)
        for (int row = 0; row < ITEM_ROWS && y + row < view.height; ++row)
            write_visibility(visibility + ((y + row) * view.width + x) * CHANNELS + channel, light.share[channel] * (1.0f - saturate(occlusion[channel][row])),
                             view.width - x, !light.first);
    if (x % TILE_WIDTH == 0 && y % TILE_ROWS == 0) evaluated[number] = light.first ? count : evaluated[number] + count;
}
