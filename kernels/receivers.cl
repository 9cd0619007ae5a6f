// Receivers as light-space points (xi, eta, d), whichever camera saw them, and what tiles of them hold.
#ifndef PENUMBRA_RECEIVERS
#define PENUMBRA_RECEIVERS
#include "common/shared.h"
#include "common/receiver_plane.clh"
#include "horizon.cl" // ends every mask: the program that made it is at hand

#if TILE_WIDTH != 16
#error "tile_bounds holds a row of a tile in a float16"
#endif

// A point of the camera's space in light space.
inline void store_receiver(const ReceiverView view, const int at, const int there, const float px, const float py, const float z,
                           __global float* restrict xi, __global float* restrict eta, __global float* restrict d)
{
    const float lx = fma(view.light_from_camera[0], px, fma(view.light_from_camera[1], py, fma(view.light_from_camera[2], z, view.light_from_camera[3])));
    const float ly = fma(view.light_from_camera[4], px, fma(view.light_from_camera[5], py, fma(view.light_from_camera[6], z, view.light_from_camera[7])));
    const float lz = fma(view.light_from_camera[8], px, fma(view.light_from_camera[9], py, fma(view.light_from_camera[10], z, view.light_from_camera[11])));
    // Nearer than the least normal number counts as at the light: one over it would be beyond binary32.
    const bool before = there && lz >= 0x1p-126f;

    // The farthest receivers stay finite.
    const float disparity = view.light_reach > 0.0f ? fmax(2.0f - lz / view.light_reach, -0x1p60f) : 1.0f / lz;
    const float scale = view.light_orthographic ? 1.0f : disparity;
    xi[at] = before ? lx * scale * view.per_light_x : 0.0f;
    eta[at] = before ? ly * scale * view.per_light_y : 0.0f;
    d[at] = before ? disparity : NO_RECEIVER;
}

// receivers_from_depth: one light-space point a pixel.
//
//   depth  [height][width]   planar depth from the receivers' camera, scene units; not finite or not positive: nothing there
//   xi, eta, d [rows][stride] light-space points; d = NO_RECEIVER for the padding, for nothing there, and behind the light's plane
//
// Launched over stride x rows. For the light's own view the transform is the identity and (xi, eta) are the pixels' centres.
__kernel void receivers_from_depth(const ReceiverView view, __global const float* restrict depth, __global float* restrict xi,
                                   __global float* restrict eta, __global float* restrict d)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= view.stride || y >= view.rows) return;

    // The point as the camera sees it; integer tests on the bits, so that no compiler option can fold them away.
    // (Padding reads the border's depth: a load under a condition would keep PoCL from vectorising across work-items.)
    const float z = depth[min(y, view.height - 1) * view.width + min(x, view.width - 1)];
    const bool there = x < view.width && y < view.height && as_int(z) > 0 && as_int(z) < 0x7f800000;
    const float spread = view.camera_orthographic ? 1.0f : z;
    const float px = ((2 * x + 1 - view.width) * view.pixel_x + view.off_x) * spread;
    const float py = ((view.height - 2 * y - 1) * view.pixel_y + view.off_y) * spread;
    store_receiver(view, y * view.stride + x, there, px, py, z, xi, eta, d);
}

// receivers_from_points: the same of points that are given, in the camera's coordinates.
//
//   points [height][width][3]  x right, y up, z along the view; z = 0: nothing there
__kernel void receivers_from_points(const ReceiverView view, __global const float* restrict points, __global float* restrict xi,
                                    __global float* restrict eta, __global float* restrict d)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= view.stride || y >= view.rows) return;
    const float3 p = vload3(min(y, view.height - 1) * view.width + min(x, view.width - 1), points);
    const bool there = x < view.width && y < view.height && p.z > 0.0f;
    store_receiver(view, y * view.stride + x, there, p.x, p.y, p.z, xi, eta, d);
}

// A receiver's own plane (common/receiver_plane.clh).
//
//   n  its surface's normal, towards the camera, in the camera's coordinates; 0: not known
inline void store_plane(const ReceiverView view, const int at, const int count, const int there, const float3 n, __global const float* restrict xi, __global const float* restrict eta,
                        __global const float* restrict d, __global float* restrict planes)
{
    const float nx = (view.light_from_camera[0] * n.x + view.light_from_camera[1] * n.y + view.light_from_camera[2] * n.z) / view.per_light_x;
    const float ny = (view.light_from_camera[4] * n.x + view.light_from_camera[5] * n.y + view.light_from_camera[6] * n.z) / view.per_light_y;
    const float nz = view.light_from_camera[8] * n.x + view.light_from_camera[9] * n.y + view.light_from_camera[10] * n.z;
    const bool endless = view.light_reach > 0.0f, known = there && d[at] != NO_RECEIVER && (endless || !view.light_orthographic);
    const float scale = endless ? 1.0f / view.light_reach : d[at];
    planes[at] = known ? nx * scale : 0.0f;
    planes[count + at] = known ? ny * scale : 0.0f;
    planes[2 * count + at] = known ? (endless ? nz : nx * xi[at] + ny * eta[at] + nz) : 0.0f;
}

// receiver_planes: store_plane of every receiver.
//
//   normals [height][width][3]
//   planes [3][rows][stride]
__kernel void receiver_planes(const ReceiverView view, __global const float* restrict normals, __global const float* restrict xi, __global const float* restrict eta,
                              __global const float* restrict d, __global float* restrict planes)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= view.stride || y >= view.rows) return;
    const float3 n = vload3(min(y, view.height - 1) * view.width + min(x, view.width - 1), normals);
    store_plane(view, y * view.stride + x, view.stride * view.rows, x < view.width && y < view.height, n, xi, eta, d, planes);
}

// receivers_of_pixels: what receivers_from_depth or receivers_from_points, and receiver_planes, say of some pixels of an image, as a list.
//
//   view              of the whole image
//   pixels [count]    y width + x
//   depth [height][width], or points [height][width][3], the other null; normals [height][width][3], null: planes are not known
//   xi, eta, d [length]
//   planes [3][length]  null where normals are
__kernel void receivers_of_pixels(const ReceiverView view, const int count, const int length, __global const uint* restrict pixels, __global const float* restrict depth,
                                  __global const float* restrict points, __global const float* restrict normals, __global float* restrict xi, __global float* restrict eta,
                                  __global float* restrict d, __global float* restrict planes)
{
    const int at = get_global_id(0);
    if (at >= length) return;
    const uint pixel = pixels[min(at, count - 1)];
    bool there = at < count;
    if (points) {
        const float3 p = vload3(pixel, points);
        store_receiver(view, at, there && p.z > 0.0f, p.x, p.y, p.z, xi, eta, d);
    } else {
        const float z = depth[pixel];
        const int x = pixel % view.width, y = pixel / view.width;
        const float spread = view.camera_orthographic ? 1.0f : z;
        const float px = ((2 * x + 1 - view.width) * view.pixel_x + view.off_x) * spread;
        const float py = ((view.height - 2 * y - 1) * view.pixel_y + view.off_y) * spread;
        store_receiver(view, at, there && as_int(z) > 0 && as_int(z) < 0x7f800000, px, py, z, xi, eta, d);
    }
    if (normals) store_plane(view, at, length, there, vload3(pixel, normals), xi, eta, d, planes);
}

inline float least(const float16 v)
{
    const float8 a = fmin(v.lo, v.hi);
    const float4 b = fmin(a.lo, a.hi);
    const float2 c = fmin(b.lo, b.hi);
    return fmin(c.x, c.y);
}

inline float total(const float16 v)
{
    const float8 a = v.lo + v.hi;
    const float4 b = a.lo + a.hi;
    const float2 c = b.lo + b.hi;
    return c.x + c.y;
}

// tile_bounds: the box of light-space points that a tile of TILE_WIDTH x TILE_ROWS receivers holds.
//
//   nearest            the greatest disparity of the occluder map
//   half_inverse_scale 1 / (2 k), k the light_scale of shared.h
//   bounds [tiles][8]  least and greatest xi, eta, d; the number of receivers; the number of those that see part of the light through space
//                      between them and the nearest occluder that the occluder map does not show. Without receivers: d from NO_RECEIVER to 0.
//
// Launched over the tiles, tiles_x x tiles_y.
__kernel void tile_bounds(const ReceiverView view, const float nearest, const float2 half_inverse_scale, __global const float* restrict xi,
                          __global const float* restrict eta, __global const float* restrict d, __global float8* restrict bounds)
{
    const int tile_x = get_global_id(0), tile_y = get_global_id(1);
    const int tiles_x = view.stride / TILE_WIDTH;
    if (tile_x >= tiles_x || tile_y >= view.rows / TILE_ROWS) return;

    // Column by column in vectors of a whole tile row, then across. What is not there counts as beyond the other end. Comparisons, not fmin
    // and fmax: those must treat NaN and take three instructions each.
    const float16 most = (float16)(NO_RECEIVER), one = (float16)(1.0f);
    float16 xi_low = most, xi_high = -most, eta_low = most, eta_high = -most, d_low = most, d_high = (float16)(0.0f);
    float16 there = (float16)(0.0f), uncovered = (float16)(0.0f);
    for (int row = 0; row < TILE_ROWS; ++row) {
        const int at = (tile_y * TILE_ROWS + row) * view.stride + tile_x * TILE_WIDTH;
        const float16 a = vload16(0, xi + at), b = vload16(0, eta + at), z = vload16(0, d + at);
        const int16 present = z != most;
        xi_low = select(xi_low, a, present & (a < xi_low));
        xi_high = select(xi_high, a, present & (a > xi_high));
        eta_low = select(eta_low, b, present & (b < eta_low));
        eta_high = select(eta_high, b, present & (b > eta_high));
        d_low = select(d_low, z, z < d_low);
        d_high = select(d_high, z, present & (z > d_high));
        there += select((float16)(0.0f), one, present);

        // The light as seen from here covers the map's plane at `nearest` to this far from the receiver.
        const float16 rise = nearest - z;
        const int16 outside = (fabs(a) + rise * half_inverse_scale.x > one) | (fabs(b) + rise * half_inverse_scale.y > one);
        uncovered += select((float16)(0.0f), one, present & (rise > (float16)(0.0f)) & outside);
    }
    bounds[tile_y * tiles_x + tile_x] =
        (float8)(least(xi_low), -least(-xi_high), least(eta_low), -least(-eta_high), least(d_low), -least(-d_high), total(there), total(uncovered));
}

// chosen_tiles: some tiles of the receivers, one below the other, as lists of their own.
//
//   tiles [count]   numbers of tiles, row by row
//
// Launched over TILE_WIDTH x (count TILE_ROWS).
__kernel void chosen_tiles(const ReceiverView view, __global const int* restrict tiles, const int count, const int has_planes,
                           __global const float* restrict xi, __global const float* restrict eta, __global const float* restrict d,
                           __global const float* restrict planes, __global float* restrict to_xi, __global float* restrict to_eta,
                           __global float* restrict to_d, __global float* restrict to_planes)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= TILE_WIDTH || y >= count * TILE_ROWS) return;
    const int tiles_x = view.stride / TILE_WIDTH, tile = tiles[y / TILE_ROWS];
    const int from = ((tile / tiles_x) * TILE_ROWS + y % TILE_ROWS) * view.stride + (tile % tiles_x) * TILE_WIDTH + x;
    const int to = y * TILE_WIDTH + x;
    to_xi[to] = xi[from];
    to_eta[to] = eta[from];
    to_d[to] = d[from];
    if (!has_planes) return;
    for (int i = 0; i < 3; ++i) to_planes[i * count * TILE_WIDTH * TILE_ROWS + to] = planes[i * view.stride * view.rows + from];
}

// sample_mask: a light-space mask seen from the receivers (Soft Shadow Maps, 3.1: "projected onto the scene").
//
//   mask [mask_size.y][mask_size.x]  visibility over the light's view, row 0 at the top
//   visibility [height][width]       bilinear between the four nearest mask texels; 1 where nothing is, or outside the light's view
__kernel void sample_mask(const ReceiverView view, __global const float* restrict xi, __global const float* restrict eta,
                          __global const float* restrict d, const int2 mask_size, __global const float* restrict mask,
                          __global float* restrict visibility)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= view.width || y >= view.height) return;
    const int at = y * view.stride + x;
    const bool seen = d[at] != NO_RECEIVER && fabs(xi[at]) <= 1.0f && fabs(eta[at]) <= 1.0f;

    // Between texel centres; beyond the outermost centres the border texel holds.
    const float2 position = seen ? (float2)((xi[at] + 1.0f) * 0.5f * mask_size.x - 0.5f, (1.0f - eta[at]) * 0.5f * mask_size.y - 0.5f) : (float2)(0.0f);
    const int2 low = convert_int2_rtn(position);
    const float2 part = position - convert_float2(low);
    const int2 a = clamp(low, (int2)(0), mask_size - 1), b = clamp(low + 1, (int2)(0), mask_size - 1);
    const float top = mix(mask[a.y * mask_size.x + a.x], mask[a.y * mask_size.x + b.x], part.x);
    const float bottom = mix(mask[b.y * mask_size.x + a.x], mask[b.y * mask_size.x + b.x], part.x);
    visibility[y * view.width + x] = seen ? mix(top, bottom, part.y) : 1.0f;
}

#endif
