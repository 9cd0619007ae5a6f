// A light and a camera as kernels see them in the coordinates of a depth image.
#ifndef PENUMBRA_COMMON_DEPTH_LIGHT_H
#define PENUMBRA_COMMON_DEPTH_LIGHT_H

// A light as one image's camera sees it, and how receivers come into that camera's coordinates.
typedef struct {
    float image_from_receiver[12]; // 3 rows of 4
    float centre[4];               // of the light; endless: the direction to it
    float half_u[4], half_v[4];    // half extents; the disc's radius twice
    int endless;                   // a directional light
    int disc, sphere;              // square samples become a disc's; one that faces the receiver
    int samples;
    int first, count;              // of the receivers that this launch is for, and how many
    int key_first;                 // added to a receiver's number for its samples
    int has_normals;
    float own;                     // hits nearer to the receiver than so many pixels do not count
    int seed_low, seed_high;       // of the samples
} DepthLight;

// A camera's own view of a depth image.
typedef struct {
    float image_from_camera[12];
    float pixel_x, pixel_y; // tangents of a pixel of the view; lengths where it is orthographic
    float off_x, off_y;     // from the viewing axis to the image's middle, right and up; in the same measure
    int width, height, orthographic;
} DepthSight;

#endif
