// Shadow mapping from the light's centre (Williams 1978) and its filtered forms: the baselines that the papers compare with.
#include "common/shared.h"
#include "occluders.cl"
#include "receivers.cl"
#include "common/receiver_plane.clh"
#include "common/receiver_precision.clh"
#include "common/shadow_test.clh"
#include "common/stop.clh"

// shadow_map_taps: taps x taps comparisons around the receiver, equally weighted (percentage-closer filtering, Reeves et al. 1987, without
// their jitter); taps = 1 is the hard test.
//
//   visibility [height][width]  share of the texels that leave the receiver lit
__kernel void shadow_map_taps(const ReceiverView receivers, const OccluderView occluders, const float bias, const float precision, const int has_planes, const int taps,
                              __global const float2* restrict texels, __global const float2* restrict steps, __global const float* restrict xi,
                              __global const float* restrict eta, __global const float* restrict d, __global const float* restrict planes,
                              __global float* restrict visibility, __global const volatile int* stop)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= receivers.width || y >= receivers.height) return;
    const int at = y * receivers.stride + x;
    const float2 place = place_of(occluders, xi[at], eta[at]);
    float sum = (float)(taps * taps);
    if (shaded(occluders, place, d[at]) && !stopped(stop)) {
        // The window of texels whose centres lie nearest to the receiver.
        const int2 size = (int2)(occluders.width, occluders.height);
        const int2 first = convert_int2_rtn(place - 0.5f * (float)(taps - 1));
        const float2 slope = plane_slope(has_planes, planes, receivers.stride * receivers.rows, at);
        const ShadowLimit limit = shadow_limit(occluders, texels, steps, place, d[at], slope, bias, receiver_precision(receivers, precision, d[at]), 0.5f * taps);
        sum = 0.0f;
        for (int j = 0; j < taps; ++j)
            for (int i = 0; i < taps; ++i) sum += lit(size, texels, first.x + i, first.y + j, limit);
    }
    visibility[y * receivers.width + x] = sum / (float)(taps * taps);
}

// shadow_map_bicubic: 4 x 4 comparisons weighted by the cubic B-spline around the receiver (smooth, never outside 0 to 1).
__kernel void shadow_map_bicubic(const ReceiverView receivers, const OccluderView occluders, const float bias, const float precision,
                                 const int has_planes, __global const float2* restrict texels, __global const float2* restrict steps,
                                 __global const float* restrict xi, __global const float* restrict eta, __global const float* restrict d,
                                 __global const float* restrict planes, __global float* restrict visibility)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= receivers.width || y >= receivers.height) return;
    const int at = y * receivers.stride + x;
    const float2 place = place_of(occluders, xi[at], eta[at]);
    float seen = 1.0f;
    if (shaded(occluders, place, d[at])) {
        const int2 size = (int2)(occluders.width, occluders.height);
        const int2 low = convert_int2_rtn(place - 0.5f);
        const float2 t = place - 0.5f - convert_float2(low), s = 1.0f - t;
        const float2 slope = plane_slope(has_planes, planes, receivers.stride * receivers.rows, at);
        const ShadowLimit limit = shadow_limit(occluders, texels, steps, place, d[at], slope, bias, receiver_precision(receivers, precision, d[at]), 2.0f);

        // The B-spline's four weights along each axis; they sum to 1.
        const float2 w[4] = {s * s * s / 6.0f, (4.0f - 6.0f * t * t + 3.0f * t * t * t) / 6.0f, (4.0f - 6.0f * s * s + 3.0f * s * s * s) / 6.0f,
                             t * t * t / 6.0f};
        float dark = 0.0f;
        for (int j = 0; j < 4; ++j)
            for (int i = 0; i < 4; ++i) dark += w[i].x * w[j].y * (1.0f - lit(size, texels, low.x - 1 + i, low.y - 1 + j, limit));
        seen = 1.0f - fmin(dark, 1.0f);
    }
    visibility[y * receivers.width + x] = seen;
}
