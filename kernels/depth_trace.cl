// Shadow rays through depth images: each receiver's segments to stratified points of the light, walked in the image itself
// (common/depth_walk.h).
//
// Several images are an exact union: a launch for each adds to the same bits, one a sample, and depth_count makes visibility of them.
#include "common/shared.h"
#include "common/depth_walk.h"

// SplitMix64's finaliser, as in host/trace/light_samples.cpp: the same samples as the host's rays.
inline ulong mixed(ulong z)
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9UL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebUL;
    return z ^ (z >> 31);
}

inline ulong sample_key(const DepthLight light, const ulong pixel)
{
    const ulong seed = (ulong)(uint)light.seed_high << 32 | (uint)light.seed_low;
    return mixed(mixed(seed + 0x9e3779b97f4a7c15UL) + 0x9e3779b97f4a7c15UL * (pixel + 1UL));
}

// A jittered point of stratum k, in [-1, 1]^2; step: 2^-16 of a stratum.
inline float2 jittered(const float2 low, const float2 step, const ulong key, const int k)
{
    uint h = (uint)k * 0x9e3779b9U + (uint)key;
    h = ((h ^ (h >> 16)) * 0x7feb352dU) ^ (uint)(key >> 32);
    h = (h ^ (h >> 15)) * 0x846ca68bU;
    h ^= h >> 16;
    return low + (convert_float2((int2)(h & 0xffff, h >> 16)) + 0.5f) * step;
}

// The square onto the disc (Shirley and Chiu 1997), with the host's series.
inline float2 square_to_disc(const float2 s)
{
    const int wide = fabs(s.x) > fabs(s.y);
    const float radius = wide ? s.x : s.y, other = wide ? s.y : s.x;
    const float angle = radius != 0.0f ? 0.785398163f * other / radius : 0.0f, a2 = angle * angle;
    const float cosine = 1.0f + a2 * (-1.0f / 2 + a2 * (1.0f / 24 + a2 * (-1.0f / 720 + a2 * (1.0f / 40320))));
    const float sine = angle * (1.0f + a2 * (-1.0f / 6 + a2 * (1.0f / 120 + a2 * (-1.0f / 5040 + a2 * (1.0f / 362880)))));
    return (float2)(radius * (wide ? cosine : sine), radius * (wide ? sine : cosine));
}

inline float3 of3(const float* v)
{
    return (float3)(v[0], v[1], v[2]);
}

inline float3 moved(const float* m, const float3 p)
{
    return (float3)(m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7], m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]);
}

inline float3 turned(const float* m, const float3 p)
{
    return (float3)(m[0] * p.x + m[1] * p.y + m[2] * p.z, m[4] * p.x + m[5] * p.y + m[6] * p.z, m[8] * p.x + m[9] * p.y + m[10] * p.z);
}

// depth_trace: which of the light's samples each receiver does not see.
//
//   points, normals [receivers][3]   in the receivers' camera's coordinates; z = 0: no receiver. Without has_normals the normals are not read
//   strata [samples]                 low corners; step: 2^-16 of their size
//   blocked, crossed, unknown [words][count]   bits are added: not seen; not seen for certain; not known. The last two where `bounds` is not 0
//   left [count]                     samples whose segments left the image; where `bounds` is not 0
//
// Launched over count receivers.
__kernel void depth_trace(const DepthView view, const DepthLight light, const int bounds, __global const DepthPixel* restrict pixels,
                          __global const float* restrict nearest, __global const float* restrict points, __global const float* restrict normals,
                          __global const float2* restrict strata, const float2 step, __global uint* restrict blocked, __global uint* restrict crossed,
                          __global uint* restrict unknown, __global uint* restrict left)
{
    const int item = get_global_id(0);
    if (item >= light.count) return;
    const int i = light.first + item;
    const float3 given = vload3(i, points);
    if (!(given.z > 0.0f)) return;
    const float3 point = moved(light.image_from_receiver, given);
    const float3 normal = light.has_normals ? turned(light.image_from_receiver, vload3(i, normals)) : (float3)(0.0f);
    float3 centre = of3(light.centre), half_u = of3(light.half_u), half_v = of3(light.half_v);
    if (!light.endless) centre -= point;
    if (light.sphere && dot(half_u, half_u) > 0.0f) {
        const float3 axis = normalize(centre), size = fabs(axis);
        const float3 other = size.x <= size.y && size.x <= size.z ? (float3)(1, 0, 0) : size.y <= size.z ? (float3)(0, 1, 0) : (float3)(0, 0, 1);
        const float radius = length(half_u);
        half_u = normalize(cross(axis, other)) * radius;
        half_v = normalize(cross(axis, half_u)) * radius;
    }
    const ulong key = sample_key(light, (ulong)i);
    const DepthVector start = {point.x, point.y, point.z};
    uint outside = 0;

    for (int first = 0; first < light.samples; first += 32) {
        const int word = (first / 32) * light.count + item;
        uint bits = blocked[word], sure = bounds ? crossed[word] : 0, maybe = bounds ? unknown[word] : 0;
        for (int k = first; k < min(first + 32, light.samples); ++k) {
            const uint bit = 1U << (k - first);
            if ((bounds ? sure : bits) & bit) continue;
            float2 sample = jittered(strata[k], step, key, k);
            if (light.disc) sample = square_to_disc(sample);
            const float3 way = centre + sample.x * half_u + sample.y * half_v;
            if (light.has_normals && dot(way, normal) <= 0.0f) {
                bits |= bit;
                sure |= bit;
                continue;
            }
            const DepthVector direction = {way.x, way.y, way.z};
            const DepthLine line = depth_line(view, start, direction, light.endless, light.own ? DEPTH_OWN_PIXELS : 0.0f);
            const DepthMet met = depth_walk(view, pixels, nearest, DEPTH_LEVELS, line, bounds, 0);
            bits |= met.blocked ? bit : 0;
            sure |= met.crossed ? bit : 0;
            maybe |= met.behind ? bit : 0;
            outside += met.left;
        }
        blocked[word] = bits;
        if (!bounds) continue;
        crossed[word] = sure;
        unknown[word] = maybe;
    }
    if (bounds) left[item] += outside;
}

// depth_count: visibility, and with `bounds` the lowest and the highest that it can be. 1 where no receiver is.
//
// Launched over count receivers.
__kernel void depth_count(const int first, const int count, const int samples, const int bounds, __global const float* restrict points,
                          __global const uint* restrict blocked, __global const uint* restrict crossed, __global const uint* restrict unknown,
                          __global float* restrict visibility, __global float* restrict low, __global float* restrict high)
{
    const int item = get_global_id(0);
    if (item >= count) return;
    uint not_seen = 0, sure = 0, maybe = 0;
    for (int word = 0; word < (samples + 31) / 32; ++word) {
        const int at = word * count + item;
        not_seen += popcount(blocked[at]);
        if (!bounds) continue;
        sure += popcount(crossed[at]);
        maybe += popcount(crossed[at] | unknown[at]);
    }
    const int there = points[3 * (first + item) + 2] > 0.0f;
    visibility[first + item] = there ? 1.0f - (float)not_seen / (float)samples : 1.0f;
    if (!bounds) return;
    low[first + item] = there ? 1.0f - (float)maybe / (float)samples : 1.0f;
    high[first + item] = there ? 1.0f - (float)sure / (float)samples : 1.0f;
}

// depth_view: what a camera sees of a depth image: each pixel's first surface and where that body ends.
//
//   front, back [height][width]  planar depth from the camera; +infinity where nothing is. Merged with what is there: the nearer front, the
//                                further back
//
// Launched over width x height.
__kernel void depth_view(const DepthView view, const DepthSight sight, __global const DepthPixel* restrict pixels, __global const float* restrict nearest,
                         __global float* restrict front, __global float* restrict back)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= sight.width || y >= sight.height) return;
    const float tx = (2 * x + 1 - sight.width) * 0.5f * sight.pixel_x, ty = (sight.height - 2 * y - 1) * 0.5f * sight.pixel_y;
    const float3 eye = sight.orthographic ? (float3)(tx, ty, 0.0f) : (float3)(0.0f);
    const float3 way = sight.orthographic ? (float3)(0.0f, 0.0f, 1.0f) : (float3)(tx, ty, 1.0f);
    const float3 point = moved(sight.image_from_camera, eye), direction = turned(sight.image_from_camera, way);
    const DepthVector start = {point.x, point.y, point.z}, along = {direction.x, direction.y, direction.z};
    const DepthLine line = depth_line(view, start, along, 1, 0.0f);
    const DepthMet met = depth_walk(view, pixels, nearest, DEPTH_LEVELS, line, 0, 1);
    if (!met.blocked) return;

    // What was passed over before the image's nearest surface counts, too.
    const float skipped = view.orthographic ? 0.0f : fmax((line.start_z - point.z) / direction.z, 0.0f);
    const float passed = line.start_z == point.z ? 0.0f : skipped;
    const float enter = passed + depth_along(view, line, met.enter), leave = passed + depth_along(view, line, met.leave);
    const int at = y * sight.width + x;
    if (enter > 0.0f && enter < front[at]) front[at] = enter;
    if (leave > 0.0f && leave < 1e30f && !(back[at] < INFINITY && back[at] >= leave)) back[at] = leave;
}
