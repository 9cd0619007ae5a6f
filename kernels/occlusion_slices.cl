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
inline int slice_of(__global const float* depths, const int slices, const float z)
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

inline void set_bit(__global uint* occupancy, const SliceView view, const int x, const int y, const int slice)
{
    volatile __global uint* word = occupancy + ((slice >> 5) * view.height + y) * view.width + x;
    atomic_or(word, 1u << (slice & 31));
}

// A triangle as lines from the centre of projection see it: e = n.x tx + n.y ty + n.z for each side, all of one sign where a line meets the triangle.
typedef struct {
    float3 side[3];     // opposite the vertex of that number
    float3 z;           // of the vertices
    float volume;       // perspective: six times the volume between centre and triangle
    int2 low, high;     // texels whose middles it can cover
} Outline;

inline float3 side_of(const SliceView view, const float3 a, const float3 b)
{
    // Without fma: exchanged ends give the same with the other sign, to the bit.
    if (view.orthographic) return (float3)(a.y - b.y, b.x - a.x, a.x * b.y - a.y * b.x);
    return (float3)(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

inline Outline outline_of(const SliceView view, __global const float* vertices, __global const int* triangle)
{
    Outline o;
    float3 v[3];
    float2 low = (float2)(NO_RECEIVER), high = (float2)(-NO_RECEIVER);
    bool whole = false; // reaches behind the centre of projection: its outline is no triangle
    for (int i = 0; i < 3; ++i) {
        v[i] = vload3(triangle[i], vertices);
        v[i].x -= view.centre_x;
        v[i].y -= view.centre_y;
        v[i].z += view.behind;
        const float scale = view.orthographic ? 1.0f : 1.0f / v[i].z;
        whole |= !view.orthographic && !(v[i].z > 0.0f);
        low = fmin(low, v[i].xy * scale);
        high = fmax(high, v[i].xy * scale);
    }
    o.z = (float3)(v[0].z, v[1].z, v[2].z);
    o.side[0] = side_of(view, v[1], v[2]);
    o.side[1] = side_of(view, v[2], v[0]);
    o.side[2] = side_of(view, v[0], v[1]);
    o.volume = v[0].x * o.side[0].x + v[0].y * o.side[0].y + v[0].z * o.side[0].z;
    const float2 corner = (float2)(view.low_x, view.low_y), per = (float2)(view.per_x, view.per_y), size = (float2)(view.width, view.height);
    // A texel further each way: rounding must not lose one.
    const float2 first = clamp((low - corner) * per - 1.5f, (float2)(0.0f), size), last = clamp((high - corner) * per + 1.5f, (float2)(0.0f), size);
    o.low = whole ? (int2)(0) : convert_int2(first);
    o.high = whole ? (int2)(view.width, view.height) : convert_int2(last);
    return o;
}

// Where exactly one of two triangles beside a side has a line that meets the side.
inline bool inside(const float3 side, const float e) { return e > 0.0f || (e == 0.0f && (side.x > 0.0f || (side.x == 0.0f && side.y > 0.0f))); }

inline void mark_row(const Outline o, const SliceView view, __global const float* depths, __global uint* occupancy, const int y)
{
    const float ty = view.low_y + (y + 0.5f) / view.per_y;
    const float nearest = depths[0], furthest = depths[view.slices];
    for (int x = o.low.x; x < o.high.x; ++x) {
        const float tx = view.low_x + (x + 0.5f) / view.per_x;
        float e[3];
        for (int i = 0; i < 3; ++i) e[i] = o.side[i].x * tx + o.side[i].y * ty + o.side[i].z;
        const bool one_way = inside(o.side[0], e[0]) && inside(o.side[1], e[1]) && inside(o.side[2], e[2]);
        const bool other_way = inside(-o.side[0], -e[0]) && inside(-o.side[1], -e[1]) && inside(-o.side[2], -e[2]);
        if (!one_way && !other_way) continue;
        const float sum = e[0] + e[1] + e[2];
        const float from = fmin(o.z.x, fmin(o.z.y, o.z.z)), to = fmax(o.z.x, fmax(o.z.y, o.z.z));
        float z = (view.orthographic ? e[0] * o.z.x + e[1] * o.z.y + e[2] * o.z.z : o.volume) / sum;
        // Edge-on to the line the depth is anywhere on it.
        z = sum == 0.0f ? from : clamp(z, from, to);
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
//
// Launched over the window, width x height.
__kernel void fill_between(const SliceView view, const int2 map_size, const float2 per_map, __global const float* restrict front,
                           __global const float* restrict back, __global const float* restrict depths, __global uint* restrict occupancy)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= view.width || y >= view.height) return;
    const float tx = view.low_x + (x + 0.5f) / view.per_x, ty = view.low_y + (y + 0.5f) / view.per_y;
    for (int slice = 0; slice < view.slices; ++slice) {
        const float z = 0.5f * (depths[slice] + depths[slice + 1]);
        const float away = view.orthographic ? 1.0f : z + view.behind, per_away = view.orthographic ? 1.0f : 1.0f / z;
        const float map_x = fma(fma(tx, away, view.centre_x) * per_away, per_map.x, 0.5f * map_size.x);
        const float map_y = fma(-fma(ty, away, view.centre_y) * per_away, per_map.y, 0.5f * map_size.y);
        if (!(map_x >= 0.0f && map_y >= 0.0f && map_x < map_size.x && map_y < map_size.y)) continue;
        const int at = (int)map_y * map_size.x + (int)map_x;
        const float near = front[at], far = back[at];
        if (near > 0.0f && near < INFINITY && far > 0.0f && far < INFINITY && far >= depths[slice] && near <= depths[slice + 1])
            set_bit(occupancy, view, x, y, slice);
    }
}

#endif
