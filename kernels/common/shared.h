// Structs and constants that kernels and host share: one text, compiled by both. A test compares sizes and offsets on the device.
//
// Only int and float members, so that both compilers lay them out alike.
#ifndef PENUMBRA_COMMON_SHARED_H
#define PENUMBRA_COMMON_SHARED_H

// Products and sums are joined where the kernels say fma and nowhere else: compilers choose differently for scalars and vectors, and the same
// receiver would get other bits under another number of lanes.
#ifdef __OPENCL_VERSION__
#pragma OPENCL FP_CONTRACT OFF
#endif

// Receivers are worked on in tiles of this many columns; a row of receivers is padded to a multiple of it.
#define TILE_WIDTH 16

// Disparity of a receiver that is not there: nearer to the light than anything, so nothing shadows it. Finite, so that no infinity enters
// the arithmetic.
#define NO_RECEIVER 3.402823466e+38f

// Occluder texels beside each other in a block of the depth pyramid, and blocks in a block of the next level.
#define BLOCK 8

// How a receiver's pixel becomes a point in light space.
typedef struct {
    float light_from_camera[12];            // 3 rows of 4: rotation and translation from the camera's (x, y, depth) to light space
    float pixel_x, pixel_y;                 // half a pixel's width and height: tangents, or lengths of an orthographic camera
    float per_light_x, per_light_y;         // 1 over the light's own view's tangents, or over its half extents if orthographic
    int camera_orthographic, light_orthographic;
    int width, height;                      // of the receiver map
    int stride, rows;                       // of the padded lists of receivers
} ReceiverView;

// An occluder map and the light behind it.
typedef struct {
    int width, height;
    float texel_x, texel_y;         // a texel's width and height in xi and eta: 2 / width, 2 / height
    float light_scale_x, light_scale_y; // k of algorithms.md: light extent tangents over the light's full width and height
    float edge_on_x, edge_on_y;     // 1 / (2 k h): times a surface's disparity step a texel, 1 where the surface is edge-on to the light
} OccluderView;

#endif
