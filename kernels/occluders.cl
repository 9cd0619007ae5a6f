// Occluder maps: depth to disparity, area-correct reduction, and the pyramid that finds the few texels that matter.
#include "common/shared.h"
#include "common/texel_steps.clh"

inline float disparity_of(const float depth)
{
    // Positive and finite, tested on the bits: anything else is nothing there. One over the smallest depths is beyond binary32: held finite.
    return as_int(depth) > 0 && as_int(depth) < 0x7f800000 ? fmin(1.0f / depth, MAXFLOAT) : 0.0f;
}

// disparity_from_depth: a map as it is.
//
//   depth  [height][width]  planar depth; not finite or not positive: nothing there
//   texels [height][width]  (disparity, share of the texel that is covered: 1 or 0)
__kernel void disparity_from_depth(const int2 size, __global const float* restrict depth, __global float2* restrict texels)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    const float d = disparity_of(depth[y * size.x + x]);
    texels[y * size.x + x] = (float2)(d, d > 0.0f ? 1.0f : 0.0f);
}

// reduce_area: a larger map at a lower resolution, area-correct.
//
//   texels [size.y][size.x]  (mean disparity of what covers the texel, share of the texel that is covered, 0 to 1)
//
// Every texel of the larger map counts by the area that it shares with the smaller one's, so any ratio of sizes works. Disparity is
// averaged, not depth: a tilted plane's disparity is linear across the image, so its mean is the plane's disparity at the texel's centre.
__kernel void reduce_area(const int2 from, __global const float* restrict depth, const int2 size, __global float2* restrict texels)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;

    const float2 ratio = convert_float2(from) / convert_float2(size);
    const float2 low = (float2)(x, y) * ratio, high = (float2)(x + 1, y + 1) * ratio;
    const int2 first = max(convert_int2_rtn(low), (int2)(0)), last = min(convert_int2_rtp(high), from);
    float sum = 0.0f, covered = 0.0f, whole = 0.0f;
    for (int j = first.y; j < last.y; ++j) {
        const float share_y = fmin(high.y, (float)(j + 1)) - fmax(low.y, (float)j);
        for (int i = first.x; i < last.x; ++i) {
            const float share = share_y * (fmin(high.x, (float)(i + 1)) - fmax(low.x, (float)i));
            const float d = disparity_of(depth[j * from.x + i]);
            sum = fma(share, d, sum);
            covered += d > 0.0f ? share : 0.0f;
            whole += share;
        }
    }
    // Sums of slivers may round a covered share of nothing to above nothing and one of all to below all.
    texels[y * size.x + x] = covered > 0.0f ? (float2)(sum / covered, fmin(covered / whole, 1.0f)) : (float2)(0.0f);
}

// reduce_nearest: the texel of the larger map that holds the centre.
__kernel void reduce_nearest(const int2 from, __global const float* restrict depth, const int2 size, __global float2* restrict texels)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    const int i = min((int)(((2 * (long)x + 1) * from.x) / (2 * (long)size.x)), from.x - 1);
    const int j = min((int)(((2 * (long)y + 1) * from.y) / (2 * (long)size.y)), from.y - 1);
    const float d = disparity_of(depth[j * from.x + i]);
    texels[y * size.x + x] = (float2)(d, d > 0.0f ? 1.0f : 0.0f);
}

// nearest_of_block: a level of the pyramid from the one below: the greatest disparity in each block of BLOCK x BLOCK cells; 0: it is empty.
//
//   size, below   the level below, of which every `stride`-th float is a disparity: 2 for texels, 1 for levels
//   blocks, nearest [blocks.y][blocks.x]
__kernel void nearest_of_block(const int2 size, const int stride, __global const float* below, const int2 blocks, __global float* restrict nearest)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= blocks.x || y >= blocks.y) return;
    float d = 0.0f;
    for (int j = y * BLOCK; j < min((y + 1) * BLOCK, size.y); ++j)
        for (int i = x * BLOCK; i < min((x + 1) * BLOCK, size.x); ++i) d = fmax(d, below[(j * size.x + i) * stride]);
    nearest[y * blocks.x + x] = d;
}

// slope_steps: steps_of_texel of every texel.
//
//   precision  relative error of a disparity
__kernel void slope_steps(const int2 size, const float precision, __global const float2* restrict texels, __global float2* restrict steps)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y) return;
    steps[y * size.x + x] = steps_of_texel(size, texels, x, y, precision);
}

// --- A directional light's maps -----------------
//
// Its view is orthographic: planes are linear in z there, as they are in 1 / z of a perspective. What compares disparities needs one that grows towards
// the light, is positive and linear on planes: 2 - z / reach, with reach at least the greatest depth of all maps, so that the relative precision of depths holds for it.

// greatest_depths: the greatest depth of a map and of those before, in as many parts as there are work-items.
__kernel void greatest_depths(const int count, __global const float* restrict depth, __global float* restrict greatest)
{
    const int part = get_global_id(0), parts = get_global_size(0);
    float most = greatest[part];
    for (int at = part; at < count; at += parts)
        if (disparity_of(depth[at]) > 0.0f && depth[at] > most) most = depth[at];
    greatest[part] = most;
}

// depths_of_endless: depths whose disparities are 2 - z / reach; 0 where nothing is.
__kernel void depths_of_endless(const int count, const float reach, __global const float* restrict depth, __global float* restrict result)
{
    const int at = get_global_id(0);
    if (at < count) result[at] = disparity_of(depth[at]) > 0.0f ? 1.0f / (2.0f - depth[at] / reach) : 0.0f;
}
