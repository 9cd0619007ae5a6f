// Shadow rays through depth images: each receiver's segments to stratified points of the light, walked in the image itself
// (common/depth_walk.h).
//
// Several images are an exact union: a launch for each adds to the same bits, one a sample, and depth_count makes visibility of them.
//
// Specialisation constants
//   LANES   samples that are tested at once: 16 or 8 on CPU devices, 1 on GPUs
#include "common/shared.h"
#include "horizon.cl"
#include "common/lanes.clh"
#include "common/depth_walk.h"
#include "common/depth_samples.clh"
#include "common/depth_bundle.clh"
#include "common/stop.clh"

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
                          __global uint* restrict unknown, __global uint* restrict left, __global const volatile int* stop)
{
    const int item = get_global_id(0);
    if (item >= light.count) return;
    const int i = light.first + item;
    const float3 given = vload3(i, points);
    if (!(given.z > 0.0f)) return;
    const Lit lit = lit_receiver(light, i, given, normals);
    const float3 point = lit.point, normal = lit.normal, centre = lit.centre, half_u = lit.half_u, half_v = lit.half_v;
    const ulong key = sample_key(light, (ulong)(i + light.key_first));
    const DepthVector start = {point.x, point.y, point.z};
    uint outside = 0;

    for (int first = 0; first < light.samples && !stopped(stop); first += 32) {
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
            const DepthLine line = depth_line(view, start, direction, light.endless, light.own);
            const DepthMet met = depth_walk(view, pixels, nearest, DEPTH_LEVELS, line, bounds, 0);
            bits |= met.blocked ? bit : 0;
            // What is blocked for certain is blocked: a crossing that the surface's own back hides is not counted.
            sure |= met.crossed && met.blocked ? bit : 0;
            maybe |= met.behind || met.crossed ? bit : 0;
            outside += !met.crossed && met.left;
        }
        blocked[word] = bits;
        if (!bounds) continue;
        crossed[word] = sure;
        unknown[word] = maybe;
    }
    if (bounds) left[item] += outside;
}

// depth_trace_bundles: depth_trace without bounds, for bundles of 64 samples: their lines start at one point and stay close, so that one search
// finds what any of them can meet.
//
// Launched over count receivers x bundles.
__kernel void depth_trace_bundles(const DepthView view, const DepthLight light, __global const DepthPixel* restrict pixels,
                                  __global const float* restrict nearest, __global const float* restrict points, __global const float* restrict normals,
                                  __global const float2* restrict strata, const float2 step, __global uint* restrict blocked,
                                  __global const volatile int* stop)
{
    const int item = get_global_id(0), first = get_global_id(1) * BUNDLE;
    if (item >= light.count || first >= light.samples || stopped(stop)) return;
    const int i = light.first + item;
    const float3 given = vload3(i, points);
    if (!(given.z > 0.0f)) return;
    const Lit lit = lit_receiver(light, i, given, normals);
    const float3 point = lit.point;
    const ulong key = sample_key(light, (ulong)i);

    // Where the lines start.
    const float spread = view.orthographic ? 1.0f : point.z;
    const int before = view.orthographic || point.z >= 0.5f / view.nearest;
    const float x = point.x / spread / view.pixel_x + view.middle_x, y = view.middle_y - point.y / spread / view.pixel_y;
    const int inside = before && x >= 0.0f && y >= 0.0f && x < (float)view.width && y < (float)view.height;
    const float own = light.own;

    Lines lines[GROUPS];
    float slowest_x = 0.0f, slowest_y = 0.0f;
    if (inside) {
        bundle_lines(view, light, lit, key, strata, step, first, lines);
        if (!all_blocked(lines, GROUPS)) {
            const float way_x = common_way(lines, 0, &slowest_x), way_y = common_way(lines, 1, &slowest_y);
            const int major = slowest_y > slowest_x;
            if (slowest_x > 0.0f || slowest_y > 0.0f) {
                // All together to the first pixel that any may meet; from there on the few that stay closest.
                const float value = depth_value(view, point.z), sign = major ? way_y : way_x;
                const int from = clamp((int)floor(major ? y : x), 0, (major ? view.height : view.width) - 1);
                const int met = walk_bundle(view, pixels, nearest, x, y, value, own, major, sign, from, 1, GROUPS, lines);
                for (int g = 0; g < GROUPS && met >= 0; g += CLOSE_GROUPS)
                    if (!all_blocked(lines + g, CLOSE_GROUPS))
                        walk_bundle(view, pixels, nearest, x, y, value, own, major, sign, met, 0, CLOSE_GROUPS, lines + g);
            }
        }
    }
    const int together = inside && (slowest_x > 0.0f || slowest_y > 0.0f || all_blocked(lines, GROUPS));
    for (int word = 0; word < BUNDLE / 32 && first + 32 * word < light.samples; ++word) {
        const int at = (first / 32 + word) * light.count + item;
        uint bits = blocked[at];
        if (together) {
            for (int g = word * GROUPS / 2; g < (word + 1) * GROUPS / 2; ++g) {
                int lanes[LANES];
                store_int_lanes(lines[g].blocked, lanes);
                for (int lane = 0; lane < LANES; ++lane) bits |= lanes[lane] != 0 ? 1U << ((g * LANES + lane) & 31) : 0U;
            }
            if (first + 32 * word + 32 > light.samples) bits &= (1U << (light.samples & 31)) - 1U;
        } else {
            // One by one: lines that start elsewhere, or that go every way.
            for (int k = first + 32 * word; k < min(first + 32 * word + 32, light.samples); ++k) {
                float2 sample = jittered(strata[k], step, key, k);
                if (light.disc) sample = square_to_disc(sample);
                const float3 way = lit.centre + sample.x * lit.half_u + sample.y * lit.half_v;
                const int below = light.has_normals && dot(way, lit.normal) <= 0.0f;
                const DepthVector start = {point.x, point.y, point.z}, direction = {way.x, way.y, way.z};
                if (below || depth_walk(view, pixels, nearest, DEPTH_LEVELS, depth_line(view, start, direction, light.endless, own), 0, 0).blocked)
                    bits |= 1U << (k & 31);
            }
        }
        blocked[at] = bits;
    }
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
                         __global float* restrict front, __global float* restrict back, __global const volatile int* stop)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= sight.width || y >= sight.height || stopped(stop)) return;
    const float tx = (2 * x + 1 - sight.width) * 0.5f * sight.pixel_x + sight.off_x, ty = (sight.height - 2 * y - 1) * 0.5f * sight.pixel_y + sight.off_y;
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
