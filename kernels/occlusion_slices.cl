// What each slice of the scene holds: a bit a texel and slice (Eisemann, Decoret 2008, 3.4). Bit k of a texel is set where its line, from the centre of projection
// through its middle, meets a surface inside slice k: every surface, not the first alone. A line's every crossing lies in one slice, so no surface is lost between two.
//
//   occupancy [2][height][width]   slices 0 to 31, then 32 to 63; row 0 lies at low_y
//   depths [slices + 1]            of the planes between slices, from the light
#ifndef PENUMBRA_OCCLUSION_SLICES
#define PENUMBRA_OCCLUSION_SLICES
#include "common/shared.h"

// Triangles that reach over more texels than this are done by many work-items.
#define SMALL_TEXELS 1024

// The slice that holds a depth within the first and the last plane; the last one holds the last plane too.
__attribute__((always_inline)) inline int slice_of(__global const float* depths, const int slices, const float z)
{
    int low = 0, high = slices - 1;
    while (low < high) {
        const int middle = (low + high + 1) / 2;
        if (z >= depths[middle])
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

__attribute__((always_inline)) inline void set_bit(__global uint* occupancy, const SliceView view, const int x, const int y, const int slice)
{
    volatile __global uint* word = occupancy + ((slice >> 5) * view.height + y) * view.width + x;
    atomic_or(word, 1u << (slice & 31));
}

// A triangle from the centre of projection (orthographic: from the view's own centre).
typedef struct {
    float3 corner[3];
    int2 low, high; // texels whose middles it can cover
} Outline;

__attribute__((always_inline)) inline Outline outline_of(const SliceView view, __global const float* vertices, __global const int* triangle)
{
    Outline o;
    float2 low = (float2)(NO_RECEIVER), high = (float2)(-NO_RECEIVER);
    bool whole = false; // reaches behind the centre of projection: its outline is no triangle
    for (int i = 0; i < 3; ++i) {
        const float3 v = vload3(triangle[i], vertices) + (float3)(-view.centre_x, -view.centre_y, view.behind);
        const float scale = view.orthographic ? 1.0f : 1.0f / v.z;
        whole |= !view.orthographic && !(v.z > 0.0f);
        low = fmin(low, v.xy * scale);
        high = fmax(high, v.xy * scale);
        o.corner[i] = v;
    }
    const float2 corner = (float2)(view.low_x, view.low_y), per = (float2)(view.per_x, view.per_y), size = (float2)(view.width, view.height);
    // Those whose middles lie within, and a little further each way: rounding must not lose one. It is some 2^-22 of at most 4096 texels, which a 64th of a texel holds, and of
    // how far the window lies off the axis.
    const float2 further = 0.515625f + 0x1p-21f * fabs(corner) * per;
    const float2 first = clamp(ceil((low - corner) * per - further), (float2)(0.0f), size);
    const float2 last = clamp(floor((high - corner) * per + further), (float2)(0.0f), size);
    o.low = whole ? (int2)(0) : convert_int2(first);
    o.high = whole ? (int2)(view.width, view.height) : convert_int2(last);
    return o;
}

// a.x b.y - a.y b.x to within two units in the last place (Kahan), so that its sign is that of the exact value and 0 only where that is.
inline float cross2(const float2 a, const float2 b)
{
    const float second = a.y * b.x;
    return fma(a.x, b.y, -second) + fma(-a.y, b.x, second);
}

// Whether the origin lies inside of a side from a to b, `area` being their cross product. An origin on the side counts as moved along +x, or where the side runs along
// x along +y: it lies inside of exactly one of two triangles beside the side.
__attribute__((always_inline)) inline bool inside(const float area, const float2 a, const float2 b) { return area > 0.0f || (area == 0.0f && (a.y > b.y || (a.y == b.y && b.x > a.x))); }

// Corners are rounded once for a texel's line and for all triangles that share them, and sides are judged exactly: neighbours leave no gap and a closed surface is
// met an even number of times.
__attribute__((always_inline)) inline void mark_row(const Outline o, const SliceView view, __global const float* depths, __global uint* occupancy, const int y)
{
    const float ty = view.low_y + (y + 0.5f) / view.per_y;
    const float nearest = depths[0], furthest = depths[view.slices];
    const float3 away = view.orthographic ? (float3)(1.0f) : (float3)(o.corner[0].z, o.corner[1].z, o.corner[2].z);
    for (int x = o.low.x; x < o.high.x; ++x) {
        const float tx = view.low_x + (x + 0.5f) / view.per_x;
        // The corners from the point of the line at their depth.
        const float2 a = o.corner[0].xy - (float2)(tx, ty) * away.x, b = o.corner[1].xy - (float2)(tx, ty) * away.y, c = o.corner[2].xy - (float2)(tx, ty) * away.z;
        const float bc = cross2(b, c), ca = cross2(c, a), ab = cross2(a, b);
        const bool one_way = inside(bc, b, c) && inside(ca, c, a) && inside(ab, a, b);
        const bool other_way = inside(-bc, c, b) && inside(-ca, a, c) && inside(-ab, b, a);
        if (!one_way && !other_way) continue;
        const float3 z3 = (float3)(o.corner[0].z, o.corner[1].z, o.corner[2].z);
        const float sum = bc + ca + ab, from = fmin(z3.x, fmin(z3.y, z3.z)), to = fmax(z3.x, fmax(z3.y, z3.z));
        // Edge-on to the line the depth is anywhere on it.
        float z = sum == 0.0f ? from : clamp((bc * z3.x + ca * z3.y + ab * z3.z) / sum, from, to);
        z -= view.behind;
        // The planes' own rounding, and that of adding `behind` and taking it away.
        const float rounding = 0x1p-21f * (fabs(z) + view.behind);
        if (z >= nearest - rounding && z <= furthest + rounding) set_bit(occupancy, view, x, y, slice_of(depths, view.slices, z));
    }
}

// slice_triangles: marks what small triangles meet, and lists the others.
//
//   vertices [][3]   light space, scene units     triangles [count][3]
//   large [count], listed   the numbers of the others, in any order, and how many; 0 at first
//
// Launched over the triangles.
__kernel void slice_triangles(const SliceView view, const int count, __global const float* restrict vertices, __global const int* restrict triangles,
                              __global const float* restrict depths, __global uint* restrict occupancy, __global int* restrict large, __global int* restrict listed)
{
    const int at = get_global_id(0);
    if (at >= count) return;
    const Outline o = outline_of(view, vertices, triangles + 3 * at);
    const int2 extent = o.high - o.low;
    if (extent.x <= 0 || extent.y <= 0) return;
    if ((long)extent.x * extent.y > SMALL_TEXELS) {
        large[atomic_inc((volatile __global int*)listed)] = at;
        return;
    }
    for (int y = o.low.y; y < o.high.y; ++y) mark_row(o, view, depths, occupancy, y);
}

// slice_large: marks what listed triangles meet; each work-item takes every get_global_size(0)-th row of all of them.
__kernel void slice_large(const SliceView view, __global const float* restrict vertices, __global const int* restrict triangles,
                          __global const float* restrict depths, __global uint* restrict occupancy, __global const int* restrict large,
                          __global const int* restrict listed)
{
    const long rows = (long)listed[0] * view.height;
    int current = -1;
    Outline o;
    for (long row = get_global_id(0); row < rows; row += get_global_size(0)) {
        if (row / view.height != current) {
            current = row / view.height;
            o = outline_of(view, vertices, triangles + 3 * large[current]);
        }
        const int y = row % view.height;
        if (y >= o.low.y && y < o.high.y) mark_row(o, view, depths, occupancy, y);
    }
}

// fill_between: marks the solid between two depth maps of the light's view (front and back; planar, 0 or not finite: nothing there) wherever it meets a texel's
// line inside a slice, looked up at the slice's middle.
//
//   map_size, per_map   of the maps; texels of the maps a tangent of the light's view (orthographic: a length)
//   from                where the maps' camera stands in light space; depth in them counts from there (perspective: the light's centre, 0)
//
// Launched over the window, width x height.
__kernel void fill_between(const SliceView view, const int2 map_size, const float2 per_map, const float4 from, __global const float* restrict front,
                           __global const float* restrict back, __global const float* restrict depths, __global uint* restrict occupancy)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= view.width || y >= view.height) return;
    const float tx = view.low_x + (x + 0.5f) / view.per_x, ty = view.low_y + (y + 0.5f) / view.per_y;
    for (int slice = 0; slice < view.slices; ++slice) {
        const float z = 0.5f * (depths[slice] + depths[slice + 1]);
        const float away = view.orthographic ? 1.0f : z + view.behind, per_away = view.orthographic ? 1.0f : 1.0f / z;
        const float map_x = fma((fma(tx, away, view.centre_x) - from.x) * per_away, per_map.x, 0.5f * map_size.x);
        const float map_y = fma((from.y - fma(ty, away, view.centre_y)) * per_away, per_map.y, 0.5f * map_size.y);
        if (!(map_x >= 0.0f && map_y >= 0.0f && map_x < map_size.x && map_y < map_size.y)) continue;
        const int at = (int)map_y * map_size.x + (int)map_x;
        const float near = front[at], far = back[at];
        if (!(near > 0.0f && near < INFINITY && far > 0.0f && far < INFINITY)) continue;
        // From the front's slice to the back's: what lies on a plane between two belongs to the further one, as with surfaces.
        if (far + from.z >= depths[slice] && (near + from.z < depths[slice + 1] || slice + 1 == view.slices))
            set_bit(occupancy, view, x, y, slice);
    }
}

#endif
