// Smoothies (Chan, Durand: Rendering Fake Soft Shadows with Smoothies, 2003): a shadow map whose silhouettes wear fins, which fade from dark to light outwards.
//
// A smoothie's edge has alpha = dot(p - v, n) / t, a corner |v - p| / t (section 3.1): in both, the distance in the light's image from the nearest point of the
// silhouette, over t. So an edge here is what lies on its outer side, by the distance from it as a segment: the paper's rectangles, and corners of any number of edges.
// At the ends it reaches half a turn around, further than a corner: of edges that slant in depth the nearer end's fin, which is wider, shows beyond its rectangle.
//
// Specialisation constants
//   LANES      texels a work-item owns side by side
//   TILE_ROWS  as in soft_shadow_map.cl
#include "common/shared.h"
#include "occluders.cl"
#include "receivers.cl"
#include "common/receiver_plane.clh"
#include "common/receiver_precision.clh"
#include "common/shadow_test.clh"
#include "common/bits.clh"
#include "common/lanes.clh"
#include "common/stop.clh"

#define BUFFER_ROWS 8 // of texels, that a work-item owns

// receiver_depths: the nearest and the furthest receiver in each texel, as the bits of their disparities (positive floats are in the order of their bits).
//
//   nearest, furthest [height][width]   0 and the bits of NO_RECEIVER at first
//
// Launched over the receivers.
__kernel void receiver_depths(const ReceiverView receivers, const OccluderView occluders, __global const float* restrict xi,
                              __global const float* restrict eta, __global const float* restrict d, __global int* restrict nearest,
                              __global int* restrict furthest)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= receivers.width || y >= receivers.height) return;
    const int at = y * receivers.stride + x;
    const float2 place = place_of(occluders, xi[at], eta[at]);
    if (d[at] == NO_RECEIVER || !(place.x >= 0.0f && place.y >= 0.0f && place.x < occluders.width && place.y < occluders.height)) return;
    const int texel = (int)place.y * occluders.width + (int)place.x;
    atomic_max((volatile __global int*)nearest + texel, as_int(d[at]));
    atomic_min((volatile __global int*)furthest + texel, as_int(d[at]));
}

// spread_receivers: a texel without receivers takes those of the texels around it, so that receivers seen by a camera with fewer pixels leave no holes.
// `around`: the furthest is taken from around in any case, since a texel at an outline, in which a camera sees the blocker alone, is blended into the floor behind.
//
// Launched over the texels.
__kernel void spread_receivers(const int2 size, const int around, __global const int* restrict nearest, __global const int* restrict furthest, __global int* restrict to_nearest,
                               __global int* restrict to_furthest)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    const int own = nearest[y * size.x + x];
    int near = own, far = furthest[y * size.x + x];
    for (int j = max(y - 1, 0); (own == 0 || around) && j <= min(y + 1, size.y - 1); ++j)
        for (int i = max(x - 1, 0); i <= min(x + 1, size.x - 1); ++i) {
            if (own == 0) near = max(near, nearest[j * size.x + i]);
            far = min(far, furthest[j * size.x + i]);
        }
    to_nearest[y * size.x + x] = near;
    to_furthest[y * size.x + x] = far;
}

// How wide the penumbra outside a silhouette at disparity b is on a receiver at r: t (1 - b / r) of depths (Eq. 1), or from the light's size, half of
// what it casts: h (1 / z_b - 1 / z_r). Not positive where the receiver is no further than the silhouette.
#define WIDTH_OF(view, b, r) \
    ((view).fixed_width > 0.0f ? (view).fixed_width * (1.0f - (r) / (b)) : (view).light * ((view).orthographic ? 1.0f / (r) - 1.0f / (b) : (b) - (r)))

// The nearest point of an edge to each of LANES texels.
typedef struct {
    floatn x, y, distance, b;
} Nearest;

// `edge`: both ends' x and y, both disparities, 1 / length^2 (0 of a point).
__attribute__((always_inline)) inline Nearest nearest_of(__global const float* edge, const floatn x, const floatn y)
{
    const float ax = edge[0], ay = edge[1], dx = edge[2] - ax, dy = edge[3] - ay;
    const floatn at = saturate(fma(x - ax, (floatn)(dx), (y - ay) * dy) * edge[6]);
    Nearest n;
    n.x = fma(at, (floatn)(dx), (floatn)(ax));
    n.y = fma(at, (floatn)(dy), (floatn)(ay));
    n.b = fma(at, (floatn)(edge[5] - edge[4]), (floatn)(edge[4]));
    const floatn out_x = x - n.x, out_y = y - n.y;
    n.distance = sqrt(fma(out_x, out_x, out_y * out_y));
    return n;
}

// Sixteen boxes of edges, five rows of 16: low x, high x, low y, high y, greatest disparity. All ones where a smoothie in the box can reach the texels within
// [x0, x1] x [y0, y1], of receivers no further than disparity r.
inline int16 reach(const SmoothieView view, __global const float* boxes, const float x0, const float x1, const float y0, const float y1, const float r)
{
    const float16 near = vload16(4, boxes);
    float16 width = (float16)(view.fixed_width);
    if (view.fixed_width == 0.0f) width = view.light * (view.orthographic ? (float16)(1.0f / fmax(r, 0x1p-120f)) : near);
    width = width * (1.0f + 0x1p-18f) + 0x1p-18f * (fabs(x0) + fabs(x1) + fabs(y0) + fabs(y1));
    return (vload16(1, boxes) + width >= x0) & (vload16(0, boxes) - width <= x1) & (vload16(3, boxes) + width >= y0) & (vload16(2, boxes) - width <= y1) & (near > 0.0f);
}

// --- Where the light gets past what the map shows -----------------

// Whether a texel hides its furthest receiver from the light. Where no receiver is anywhere near: whether anything is there.
inline bool covers(const float shown, const int nearest, const int furthest) { return shown > (nearest == 0 ? 0.0f : as_float(furthest)) * (1.0f + 0x1p-10f); }

// bare_in_row: how many texels to the left (negative) or right of each the next one is that hides nothing, 0 of itself; twice the map's width: none. What is beyond the
// map nobody knows: no outline is there.
//
// Launched over the texels.
__kernel void bare_in_row(const int2 size, __global const float2* restrict texels, __global const int* restrict nearest, __global const int* restrict furthest,
                          __global int* restrict to)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    const int row = y * size.x;
    int found = 2 * size.x;
    for (int steps = 0; steps < size.x && found == 2 * size.x; ++steps) {
        const int left = x - steps, right = x + steps;
        if (left >= 0 && !covers(texels[row + left].x, nearest[row + left], furthest[row + left])) found = -steps;
        else if (right < size.x && !covers(texels[row + right].x, nearest[row + right], furthest[row + right])) found = steps;
    }
    to[row + x] = found;
}

// bare_place: where the nearest texel that hides nothing is for each texel, how many texels to the right and below; twice the map's size: nowhere. By distance in the
// light's image; of several the one above, then that to the left.
//
//   in_row   bare_in_row's
//
// Launched over the texels.
__kernel void bare_place(const int2 size, const float2 step, __global const int* restrict in_row, __global int2* restrict to)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    int2 place = size * 2;
    float least = MAXFLOAT;
    for (int rows = 0; rows < size.y; ++rows) {
        const float up = rows * step.y;
        if (up * up >= least) break;
        for (int side = -1; side <= 1; side += 2) {
            const int row = y + side * rows;
            if (row < 0 || row >= size.y || in_row[row * size.x + x] == 2 * size.x) continue;
            const int columns = in_row[row * size.x + x];
            const float square = fma(columns * step.x, columns * step.x, up * up);
            if (square >= least) continue;
            least = square;
            place = (int2)(columns, side * rows);
        }
    }
    to[y * size.x + x] = place;
}

// The same for one texel from the map alone, where no edge passes by the nearest bare texel, `away` texels to the right and below: (distance, disparity). The outline
// lies halfway between that and the texel before it, which is the blocker there.
inline float2 inner_of_map(const SmoothieView view, __global const float2* texels, const int x, const int y, const int2 away)
{
    const float2 to = (float2)(away.x * view.step_x, away.y * view.step_y);
    const float distance = sqrt(fma(to.x, to.x, to.y * to.y));
    const int2 back = convert_int2_rte(to / (distance * (float2)(view.step_x, view.step_y)) * fmin(view.step_x, view.step_y));
    const int2 at = clamp((int2)(x, y) + away - back, (int2)(0), (int2)(view.width - 1, view.height - 1));
    return (float2)(fmax(distance - 0.5f * fmin(view.step_x, view.step_y), 0.0f), texels[at.y * view.width + at.x].x);
}

inline void store_texels(__global float* to, const floatn values, const int left)
{
    float lanes[LANES];
    store_lanes(values, lanes);
    for (int lane = 0; lane < LANES && lane < left; ++lane) to[lane] = lanes[lane];
}

// smoothie_buffer: of each texel the smoothie of the least remapped alpha (minimum blending, 3.1), as its distance and disparity: each receiver remaps it by itself,
// since a texel at an outline holds receivers on the blocker and behind it. Smoothies behind the map's blocker, and behind the receiver, are dropped.
//
// Alphas are compared for the furthest receiver; where the map hides that, no fin matters to it, and for the nearest.
//
//   boxes, edge_boxes, edges     of groups, blocks of 16; of the edges of each group; [groups][16][8]
//   texels                       the occluder map: disparity, covered share
//   nearest, furthest            disparities of the nearest and the furthest receiver, as bits
//   bare                         two_sided: bare_place
//   distances, depths [height][width]   from the silhouette; disparity 0 where there is no smoothie
//   inner_distances, inner_depths   two_sided: distance from the silhouette on its inner side (negative: none), and its disparity
//   evaluated                    edges that were evaluated against the texels of each work-item
//   stop                         common/stop.clh, asked between every 16 groups
//
// Launched over work-items, (width / LANES) x (height / BUFFER_ROWS), both rounded up.
__kernel void smoothie_buffer(const SmoothieView view, __global const float* restrict boxes, __global const float* restrict edge_boxes,
                              __global const float* restrict edges, __global const float2* restrict texels, __global const int* restrict nearest,
                              __global const int* restrict furthest, __global const int2* restrict bare, __global float* restrict distances,
                              __global float* restrict depths, __global float* restrict inner_distances, __global float* restrict inner_depths, __global uint* restrict evaluated,
                              __global const volatile int* stop)
{
    const int first_x = get_global_id(0) * LANES, first_y = get_global_id(1) * BUFFER_ROWS;
    if (first_x >= view.width || first_y >= view.height) return;
    const floatn zero = (floatn)(0.0f), one = (floatn)(1.0f);
    floatn alpha[BUFFER_ROWS], distance[BUFFER_ROWS], depth[BUFFER_ROWS], slack[BUFFER_ROWS], inner[BUFFER_ROWS], share[BUFFER_ROWS], inner_depth[BUFFER_ROWS], open_x[BUFFER_ROWS], open_y[BUFFER_ROWS], least_inner[BUFFER_ROWS], r[BUFFER_ROWS], behind[BUFFER_ROWS], map[BUFFER_ROWS];
    floatn x, least = (floatn)(NO_RECEIVER);
    // The outline passes between a texel that hides and one beside it that does not: within a texel and a half of the latter's middle; from inside it is
    // no nearer than half a diagonal before that. Edges that zigzag inside it are.
    const float around = 1.5f * fmax(view.step_x, view.step_y), half_diagonal = 0.5f * sqrt(view.step_x * view.step_x + view.step_y * view.step_y);
    float columns[LANES];
    for (int lane = 0; lane < LANES; ++lane) columns[lane] = view.left + (first_x + lane) * view.step_x;
    x = load_lanes(columns);
    for (int row = 0; row < BUFFER_ROWS; ++row) {
        float rs[LANES], fs[LANES], maps[LANES], slacks[LANES], bares_x[LANES], bares_y[LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            const int at = min(first_y + row, view.height - 1) * view.width + min(first_x + lane, view.width - 1);
            // Where no receiver is anywhere near nobody looks.
            fs[lane] = nearest[at] == 0 ? 0.0f : as_float(furthest[at]);
            maps[lane] = texels[at].x;
            const int2 away = view.two_sided ? bare[at] : (int2)(0);
            bares_x[lane] = columns[lane] + away.x * view.step_x;
            bares_y[lane] = view.top - (first_y + row + away.y) * view.step_y;
            const bool covered = maps[lane] > fs[lane] * (1.0f + 0x1p-10f);
            rs[lane] = covered ? as_float(nearest[at]) : fs[lane];
            // A texel that the map leaves bare is outside, though edges rounded, or rendered elsewhere, may miss it by up to a texel.
            slacks[lane] = covered ? 0.0f : fmax(view.step_x, view.step_y);
        }
        slack[row] = load_lanes(slacks);
        open_x[row] = load_lanes(bares_x);
        open_y[row] = load_lanes(bares_y);
        const floatn away_x = open_x[row] - x, away_y = open_y[row] - (floatn)(view.top - (first_y + row) * view.step_y);
        least_inner[row] = sqrt(fma(away_x, away_x, away_y * away_y)) - half_diagonal;
        r[row] = load_lanes(rs);
        behind[row] = load_lanes(fs);
        map[row] = load_lanes(maps);
        least = select_lanes(least, behind[row], behind[row] < least);
        alpha[row] = one;
        distance[row] = depth[row] = inner_depth[row] = zero;
        inner[row] = -one;
        share[row] = one;
    }
    float far[LANES];
    store_lanes(least, far);
    for (int lane = 1; lane < LANES; ++lane) far[0] = fmin(far[0], far[lane]);
    const float x0 = columns[0], x1 = columns[LANES - 1];
    const float y1 = view.top - first_y * view.step_y, y0 = view.top - (first_y + BUFFER_ROWS - 1) * view.step_y;

    uint count = 0;
    for (int block = 0; block < view.groups; block += 16) {
        if (stopped(stop)) return;
        uint group_bits = bits_of(reach(view, boxes + block * 5, x0, x1, y0, y1, far[0]));
        while (group_bits) {
            const int group = block + take_bit(&group_bits);
            uint bits = bits_of(reach(view, edge_boxes + group * 80, x0, x1, y0, y1, far[0]));
            while (bits) {
                __global const float* edge = edges + (group * SMOOTHIE_GROUP + take_bit(&bits)) * 8;
                ++count;
                for (int row = 0; row < BUFFER_ROWS; ++row) {
                    const floatn y = (floatn)(view.top - (first_y + row) * view.step_y);
                    const Nearest n = nearest_of(edge, x, y);
                    const floatn width = WIDTH_OF(view, n.b, r[row]);
                    const float dx = edge[2] - edge[0], dy = edge[3] - edge[1];
                    const floatn out = (x - edge[0]) * dy - (y - edge[1]) * dx;
                    const intn kept = (n.distance < alpha[row] * width) & (n.b >= map[row]) & ((out >= zero) | (n.distance < slack[row]));
                    alpha[row] = select_lanes(alpha[row], n.distance / width, kept);
                    distance[row] = select_lanes(distance[row], n.distance, kept);
                    depth[row] = select_lanes(depth[row], n.b, kept);
                    if (!view.two_sided) continue;
                    // Under a blocker, where light gets past the outline to the furthest receiver: where that is nearest. Other edges lie inside it.
                    const floatn full = WIDTH_OF(view, n.b, behind[row]);
                    const intn within = (map[row] > behind[row] * (1.0f + 0x1p-10f)) & (n.distance < share[row] * full) &
                                        (fabs(n.x - open_x[row]) <= (floatn)(around)) & (fabs(n.y - open_y[row]) <= (floatn)(around));
                    share[row] = select_lanes(share[row], n.distance / full, within);
                    inner[row] = select_lanes(inner[row], n.distance, within);
                    inner_depth[row] = select_lanes(inner_depth[row], n.b, within);
                }
            }
        }
    }
    evaluated[get_global_id(1) * ((view.width + LANES - 1) / LANES) + get_global_id(0)] = count;
    for (int row = 0; row < BUFFER_ROWS && first_y + row < view.height; ++row) {
        const int at = (first_y + row) * view.width + first_x, left = view.width - first_x;
        store_texels(distances + at, distance[row], left);
        store_texels(depths + at, depth[row], left);
        if (!view.two_sided) continue;
        float inners[LANES], inner_ds[LANES], shown[LANES], hidden[LANES];
        const floatn away = least_inner[row] + half_diagonal, least_away = select_lanes(inner[row], least_inner[row], (inner[row] >= zero) & (inner[row] < least_inner[row]));
        store_lanes(select_lanes(least_away, away, least_away > away), inners);
        store_lanes(inner_depth[row], inner_ds);
        store_lanes(map[row], shown);
        store_lanes(behind[row], hidden);
        for (int lane = 0; lane < LANES && lane < left; ++lane) {
            if (inners[lane] < 0.0f && shown[lane] > hidden[lane] * (1.0f + 0x1p-10f) && bare[at + lane].x != 2 * view.width) {
                const float2 own = inner_of_map(view, texels, first_x + lane, first_y + row, bare[at + lane]);
                inners[lane] = own.y > 0.0f && own.x < WIDTH_OF(view, own.y, hidden[lane]) ? own.x : -1.0f;
                inner_ds[lane] = own.y;
            }
            inner_distances[at + lane] = inners[lane];
            inner_depths[at + lane] = inner_ds[lane];
        }
    }
}

// smoothie_composite: the three cases of Fig. 3 at the four nearest texels, blended (section 3, step 5), then the fall-off.
//
//   visibility [height][width]
//
// Launched over the receivers.
__kernel void smoothie_composite(const ReceiverView receivers, const OccluderView occluders, const SmoothieView view, const float bias, const float precision,
                                 const int has_planes, __global const float2* restrict texels, __global const float2* restrict steps,
                                 __global const float* restrict distances, __global const float* restrict depths, __global const float* restrict inner_distances,
                                 __global const float* restrict inner_depths, __global const float* restrict xi, __global const float* restrict eta,
                                 __global const float* restrict d, __global const float* restrict planes,
                                 __global float* restrict visibility)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= receivers.width || y >= receivers.height) return;
    const int at = y * receivers.stride + x;
    const float2 place = place_of(occluders, xi[at], eta[at]);
    float seen = 1.0f;
    if (shaded(occluders, place, d[at])) {
        const float rounding = rounding_of(d[at], receiver_precision(receivers, precision, d[at]));
        const float2 slope = plane_slope(has_planes, planes, receivers.stride * receivers.rows, at);
        const ShadowLimit limit = shadow_limit(occluders, texels, steps, place, d[at], slope, bias, receiver_precision(receivers, precision, d[at]), 1.0f);
        const int2 low = convert_int2_rtn(place - 0.5f);
        const float2 part = place - 0.5f - convert_float2(low);
        seen = 0.0f;
        for (int j = 0; j < 2; ++j)
            for (int i = 0; i < 2; ++i) {
                const int tx = low.x + i, ty = low.y + j, texel = ty * occluders.width + tx;
                float v = 1.0f;
                if (tx >= 0 && ty >= 0 && tx < occluders.width && ty < occluders.height) {
                    const bool hidden = shadows(limit, tx, ty, texels[texel].x);
                    if (hidden) {
                        v = 0.0f;
                        if (view.two_sided && inner_distances[texel] >= 0.0f && shadows(limit, tx, ty, inner_depths[texel]))
                            v = fmax(0.5f - 0.5f * inner_distances[texel] / WIDTH_OF(view, inner_depths[texel], d[at]), 0.0f);
                    } else if (depths[texel] > d[at] + rounding) {
                        v = fmin(distances[texel] / WIDTH_OF(view, depths[texel], d[at]), 1.0f);
                        if (view.two_sided) v = 0.5f + 0.5f * v;
                    }
                }
                seen += v * (i ? part.x : 1.0f - part.x) * (j ? part.y : 1.0f - part.y);
            }
        seen = fmin(seen, 1.0f);
        if (view.sinusoidal) seen = 0.5f - 0.5f * cospi(seen);
    }
    visibility[y * receivers.width + x] = seen;
}
