// Shadow mapping from the light's centre (Williams 1978) and its filtered forms: the baselines that the papers compare with.
#include "common/shared.h"
#include "occluders.cl"
#include "receivers.cl"

// How far above a receiver a texel must be to shadow it: on a plane no texel that the filter compares is.
//     bound = reach (sx + sy), reach in texels from the receiver to the furthest texel's centre along one axis
// where the receiver lies on the surface that the map shows there, that is, within one step each way of it; elsewhere the texel's slope says
// nothing about the receiver. Always, the rounding of both disparities and of the depth that they came from.
inline float bias_of(const OccluderView occluders, __global const float2* restrict texels, __global const float2* restrict steps,
                     const float2 position, const float d, const float bias, const float precision, const float reach)
{
    const int2 size = (int2)(occluders.width, occluders.height);
    const int2 place = convert_int2_rtn(position);
    const bool inside = place.x >= 0 && place.y >= 0 && place.x < size.x && place.y < size.y;
    const int texel = inside ? place.y * size.x + place.x : 0;
    const float step = steps[texel].x + steps[texel].y, rounding = (8.0f * 0x1p-24f + 2.0f * precision) * d;
    const bool on_surface = inside && texels[texel].x > 0.0f && fabs(texels[texel].x - d) <= step + rounding;
    return rounding + (on_surface ? bias * reach * step : 0.0f);
}

// 1 where the texel leaves the receiver lit; beyond the map's border nothing casts shadows.
inline float lit(const int2 size, __global const float2* restrict texels, const int x, const int y, const float limit)
{
    const bool inside = x >= 0 && y >= 0 && x < size.x && y < size.y;
    return inside && texels[y * size.x + x].x > limit ? 0.0f : 1.0f;
}

// A receiver's place on the occluder map, in texels; texel (0, 0) reaches from 0 to 1.
inline float2 place_of(const OccluderView occluders, const float xi, const float eta)
{
    return (float2)((xi + 1.0f) * 0.5f * occluders.width, (1.0f - eta) * 0.5f * occluders.height);
}

// Whether the receiver is there and its filter can meet the map at all (so that the place fits an int).
inline bool shaded(const OccluderView occluders, const float2 place, const float d)
{
    const float margin = 64.0f;
    return d != NO_RECEIVER && place.x > -margin && place.y > -margin && place.x < occluders.width + margin && place.y < occluders.height + margin;
}

// shadow_map_taps: taps x taps comparisons around the receiver, equally weighted (percentage-closer filtering, Reeves et al. 1987, without
// their jitter); taps = 1 is the hard test.
//
//   visibility [height][width]  share of the texels that leave the receiver lit
__kernel void shadow_map_taps(const ReceiverView receivers, const OccluderView occluders, const float bias, const float precision, const int taps,
                              __global const float2* restrict texels, __global const float2* restrict steps, __global const float* restrict xi,
                              __global const float* restrict eta, __global const float* restrict d, __global float* restrict visibility)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= receivers.width || y >= receivers.height) return;
    const int at = y * receivers.stride + x;
    const float2 place = place_of(occluders, xi[at], eta[at]);
    float sum = (float)(taps * taps);
    if (shaded(occluders, place, d[at])) {
        // The window of texels whose centres lie nearest to the receiver.
        const int2 size = (int2)(occluders.width, occluders.height);
        const int2 first = convert_int2_rtn(place - 0.5f * (float)(taps - 1));
        const float limit = d[at] + bias_of(occluders, texels, steps, place, d[at], bias, precision, 0.5f * taps);
        sum = 0.0f;
        for (int j = 0; j < taps; ++j)
            for (int i = 0; i < taps; ++i) sum += lit(size, texels, first.x + i, first.y + j, limit);
    }
    visibility[y * receivers.width + x] = sum / (float)(taps * taps);
}

// shadow_map_bicubic: 4 x 4 comparisons weighted by the cubic B-spline around the receiver (smooth, never outside 0 to 1).
__kernel void shadow_map_bicubic(const ReceiverView receivers, const OccluderView occluders, const float bias, const float precision,
                                 __global const float2* restrict texels, __global const float2* restrict steps, __global const float* restrict xi,
                                 __global const float* restrict eta, __global const float* restrict d, __global float* restrict visibility)
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
        const float limit = d[at] + bias_of(occluders, texels, steps, place, d[at], bias, precision, 2.0f);

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
