// The light clipped at each receiver's own plane: whatever casts, what lies below a surface's horizon does not reach it.
#ifndef PENUMBRA_HORIZON
#define PENUMBRA_HORIZON
#include "common/shared.h"
#include "common/depth_light.h"

// The share of the square [-1, 1]^2 where h + a x + b y > 0; a and b not negative.
inline float square_above(const float h, const float a, const float b)
{
    const float most = fmax(a, b), least = fmin(a, b), size = fabs(h);
    if (size >= most + least) return h > 0.0f ? 1.0f : 0.0f;
    if (size <= most - least) return 0.5f + 0.5f * h / most;
    // A corner is cut off.
    const float rest = most + least - size, corner = rest * rest / (8.0f * most * least);
    return h > 0.0f ? 1.0f - corner : corner;
}

// The share of the unit disc where h + a x > 0.
inline float disc_above(const float h, const float a)
{
    if (fabs(h) >= a) return h > 0.0f ? 1.0f : 0.0f;
    const float t = h / a;
    return 1.0f - (acos(t) - t * sqrt(1.0f - t * t)) * M_1_PI_F;
}

// The point that a pixel shows at planar depth z.
inline float3 point_of(const DepthSight sight, const int i, const float z)
{
    const int x = i % sight.width, y = i / sight.width;
    const float spread = sight.orthographic ? 1.0f : z;
    const float tx = (2 * x + 1 - sight.width) * 0.5f * sight.pixel_x + sight.off_x, ty = (sight.height - 2 * y - 1) * 0.5f * sight.pixel_y + sight.off_y;
    return (float3)(tx * spread, ty * spread, z);
}

// clip_at_horizon: visibility becomes the smaller of what it is and the share of the light above the receiver's plane.
//
//   light                   in the receivers' camera's coordinates
//   listed [pixels]         the receivers' pixels in the image that points, depth and normals are of; null: all of them, in their order
//   points [pixels][3]      of receivers, z = 0: none; where has_points is 0, depth [pixels], planar, in the camera that `sight` describes
//   normals [pixels][3]     0: not known
//   textured                the light's parts are not alike: only what lies wholly below the plane is taken away
//   visibility [pixels][channels]
//
// A technique's own shadow of the surface lies below the plane for the most part: the smaller of the two, not their sum.
__kernel void clip_at_horizon(const DepthLight light, const DepthSight sight, const int has_points, const int textured, const int channels,
                              __global const uint* restrict listed, __global const float* restrict points, __global const float* restrict depth, __global const float* restrict normals,
                              __global float* restrict visibility)
{
    const int i = get_global_id(0);
    if (i >= light.count) return;
    const int pixel = listed ? (int)listed[i] : i;
    const float3 point = has_points ? vload3(pixel, points) : point_of(sight, pixel, depth[pixel]), normal = vload3(pixel, normals);
    if (!(point.z > 0.0f && point.z < MAXFLOAT) || dot(normal, normal) == 0.0f) return;
    const float3 half_u = (float3)(light.half_u[0], light.half_u[1], light.half_u[2]), half_v = (float3)(light.half_v[0], light.half_v[1], light.half_v[2]);
    float3 centre = (float3)(light.centre[0], light.centre[1], light.centre[2]);
    if (!light.endless) centre -= point;
    const float h = dot(normal, centre), a = fabs(dot(normal, half_u)), b = fabs(dot(normal, half_v));
    float share;
    if (light.sphere) {
        // A disc across the way to its centre.
        const float along = h / fmax(length(centre), 1e-30f);
        share = disc_above(h, length(half_u) * sqrt(fmax(1.0f - along * along, 0.0f)));
    } else if (light.disc) {
        share = disc_above(h, sqrt(a * a + b * b));
    } else {
        share = square_above(h, a, b);
    }
    if (textured && share > 0.0f) return;
    for (int c = 0; c < channels; ++c) visibility[i * channels + c] = fmin(visibility[i * channels + c], share);
}

#endif
