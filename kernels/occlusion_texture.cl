// Occlusion textures (Eisemann, Decoret: Occlusion Textures for Plausible Soft Shadows, 2008): the light's share that slices of the scene hide, each by one
// lookup in a prefiltered picture of what it holds.
//
// Specialisation constants
//   LANES      receivers a work-item owns
//   TILE_ROWS  as in soft_shadow_map.cl
//   PREFILTER  NBUFFER, MIPMAP, TABLE (summed-area tables), SMOOTH (N-buffers of a directional light: 3.5); common/choices.h
//   STORAGE    of N-buffers, mip-maps and smooth levels: BINARY32, NORMALIZED16
#include "common/choices.h"
#include "common/shared.h"
#include "receivers.cl"
#include "common/lanes.clh"
#include "common/stop.clh"
#include "occlusion_slices.cl"
#include "occlusion_levels.cl"

// LANES receivers: tangents (orthographic: lengths) and disparity from the part's centre, and depth.
typedef struct {
    floatn tx, ty, d, z;
} Seen;

__attribute__((always_inline)) inline Seen seen_at(const OcclusionLight light, __global const float* xi, __global const float* eta, __global const float* d)
{
    Seen p;
    p.d = load_lanes(d);
    p.z = 1.0f / p.d;
    const floatn away = light.orthographic ? (floatn)(1.0f) : p.d;
    p.tx = fma((floatn)(-light.centre_x), away, load_lanes(xi));
    p.ty = fma((floatn)(-light.centre_y), away, load_lanes(eta));
    return p;
}

// How much of the light a texture hides (Eq. 4 gives the kernel's size): its mean over the rectangle where the receiver's view of the light meets the
// slice's far plane.
__attribute__((always_inline)) inline floatn hidden(const OcclusionLight light, const OcclusionPlane plane, const int number, const Seen p, const int2 size,
                     __global const OcclusionLevel* levels, __global const element* data)
{
    const floatn x = fma(p.tx, (floatn)(plane.at_x), (floatn)(light.zero_x)), y = fma(p.ty, (floatn)(plane.at_y), (floatn)(light.zero_y));
    const floatn rise = light.orthographic ? p.z - plane.far : fma((floatn)(-plane.far), p.d, (floatn)(1.0f));
    // From before the plane (a receiver inside its own slice) a point of it is seen.
    const floatn grown = select_lanes((floatn)(0.0f), rise, rise > (floatn)(0.0f)), half_x = grown * plane.half_x, half_y = grown * plane.half_y;
#if PREFILTER == PREFILTER_TABLE
    (void)levels;
    return mean_of_table(data + (long)number * (size.x + 1) * (size.y + 1), size, x, y, half_x, half_y);
#else
    floatn sum = (floatn)(0.0f);
    const floatn step_x = 2.0f * half_x / (float)light.taps_x, step_y = 2.0f * half_y / (float)light.taps_y;
    for (int j = 0; j < light.taps_y; ++j)
        for (int i = 0; i < light.taps_x; ++i)
            sum += mean_of_levels(levels, plane.levels, size, data, number, fma(step_x, (floatn)(i - 0.5f * (light.taps_x - 1)), x),
                                  fma(step_y, (floatn)(j - 0.5f * (light.taps_y - 1)), y), select_lanes(step_y, step_x, step_x > step_y));
    return sum * (1.0f / (light.taps_x * light.taps_y));
#endif
}

// occlusion_texture: one light, or one part of it.
//
//   precision                     relative, of the receivers' depth
//   planes [light.planes]         in order from the light; layers of one slice beside each other
//   size                          of the window in texels
//   levels, data                  prefiltered textures (occlusion_levels.cl)
//   visibility [height][width]    share of the light that is seen, 0 to 1
//
// Launched over work-items, (stride / LANES) x rows.
__kernel void occlusion_texture(const ReceiverView view, const float precision, const OcclusionLight light, const int2 size, __global const OcclusionPlane* restrict planes,
                                __global const OcclusionLevel* restrict levels, __global const element* restrict data, __global const float* restrict xi,
                                __global const float* restrict eta, __global const float* restrict d, __global float* restrict visibility,
                                __global const volatile int* stop)
{
    const int x = get_global_id(0) * LANES, y = get_global_id(1);
    if (x >= view.width || y >= view.height || stopped(stop)) return;
    const int at = y * view.stride + x;
    const floatn zero = (floatn)(0.0f), one = (floatn)(1.0f);
    const Seen p = seen_at(light, xi + at, eta + at, d + at);
    const intn there = load_lanes(d + at) != (floatn)(NO_RECEIVER);

    // A slice hides from receivers that lie behind it by more than their depth may be off.
    const floatn beyond = fma((floatn)(8.0f * 0x1p-24f + 2.0f * precision), fabs(p.z), (floatn)(2.0f * view.depth_error));

    // Product, sum and greatest of all planes; if layered, the sum within each layer (of what a column holds, its first few filled slices).
    floatn lit = one, sum = zero, greatest = zero, of_layer[MOST_LAYERS];
    for (int layer = 0; layer < MOST_LAYERS; ++layer) of_layer[layer] = zero;
    for (int i = 0; i < light.planes; ++i) {
        const OcclusionPlane plane = planes[i];
        const floatn behind = p.z - plane.fade_from, weight = select_lanes(zero, saturate(behind * plane.per_fade), behind > beyond);
        const intn counts = there & (weight > zero);
        if (NONE(counts)) continue;
        const floatn by = select_lanes(zero, weight * hidden(light, plane, i, p, size, levels, data), counts);
        if (light.combine == COMBINE_PRODUCT) lit *= one - by;
        if (light.combine == COMBINE_SUM) sum += by;
        if (light.combine == COMBINE_MAX) greatest = select_lanes(greatest, by, by > greatest);
        if (light.combine == COMBINE_LAYERED || light.combine == COMBINE_LAYERED_MAX) of_layer[plane.layer] += by;
    }
    if (light.combine == COMBINE_SUM) lit = one - saturate(sum);
    if (light.combine == COMBINE_MAX) lit = one - saturate(greatest);
    if (light.combine == COMBINE_LAYERED)
        for (int layer = 0; layer < MOST_LAYERS; ++layer) lit *= one - saturate(of_layer[layer]);
    if (light.combine == COMBINE_LAYERED_MAX)
        for (int layer = 0; layer < MOST_LAYERS; ++layer) lit = select_lanes(lit, one - saturate(of_layer[layer]), of_layer[layer] > one - lit);

    float seen[LANES];
    store_lanes(light.share * saturate(lit), seen);
    for (int lane = 0; lane < LANES && x + lane < view.width; ++lane) {
        __global float* to = visibility + y * view.width + x + lane;
        *to = light.first ? seen[lane] : *to + seen[lane];
    }
}
