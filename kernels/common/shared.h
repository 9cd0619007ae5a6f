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

// Slope of a receiver whose plane is not known.
#define NO_PLANE 3.402823466e+38f

// The rows of a light's 32 x 32 samples (light_pattern.clh): bit i of word b is bit b of M(i).
#define LIGHT_SIDE 32
#define LIGHT_COLUMN_BITS 0xa5a5a5a5u, 0x99996666u, 0x99999999u, 0x69966996u, 0x66996699u

// Occluder texels beside each other in a block of the depth pyramid, and blocks in a block of the next level.
#define BLOCK 8

// How a receiver's pixel becomes a point in light space.
typedef struct {
    float light_from_camera[12];            // 3 rows of 4: rotation and translation from the camera's (x, y, depth) to light space
    float pixel_x, pixel_y;                 // half a pixel's width and height: tangents, or lengths of an orthographic camera
    float off_x, off_y;                     // from the viewing axis to the image's middle, right and up; in the same measure
    float per_light_x, per_light_y;         // 1 over the light's own view's tangents, or over its half extents if orthographic
    int camera_orthographic, light_orthographic;
    float light_reach;                      // of a directional light: disparity is 2 - z / light_reach (occluders.cl); 0: 1 / z
    float depth_error;                      // scene units: by half as much as a receiver's distance from the light may be off for the camera's distance from there
    int width, height;                      // of the receiver map
    int stride, rows;                       // of the padded lists of receivers
} ReceiverView;

// An occluder map and the light behind it.
typedef struct {
    int width, height;
    float texel_x, texel_y;         // a texel's width and height in xi and eta: 2 / width, 2 / height
    float light_scale_x, light_scale_y; // k: light extent tangents over the light's full width and height
    float edge_on_x, edge_on_y;     // 1 / (2 k h): times a surface's disparity step a texel, 1 where the surface is edge-on to the light
} OccluderView;

// The disparities that an edge has along a patch.
typedef struct {
    float low, high;
} Along;

// A micro-patch: a texel with a disparity for each of its edges, so that neighbours of one surface share theirs. Or 2 x 2, 4 x 4, ... of them.
typedef struct {
    float reach;                    // the greatest disparity of any edge; 0: nothing is there
    float least;                    // the least
    float middle;                   // of the middle
    Along left, right, bottom, top; // of the edges
    int flags;                      // JOINED_...: beyond that edge the same surface goes on; FULL, SOLID
    float x0, x1, y0, y1;           // what of the texel it covers, from its left and from its top, 0 to 1
} MicroPatch;

// What casts, as soft_shadow_volume's kernels search it: sheets of light-facing triangles with the edges around them, in groups of WEDGE_GROUP.
#define WEDGE_GROUP 16
#define WEDGE_PLANES 26 // floats an edge for linear coverage: wedge_linear.clh
typedef struct {
    int edges_begin, edges_end;         // groups of edges
    int triangles_begin, triangles_end; // groups of triangles
    int side;                           // 0: hides by itself; of a surface that is not closed: 1 its first side, 2 the other, right after the first
} Sheet;

// A light's texture, or the part of it that a coverage table is for: texels, row 0 at the top, and the part's place among them.
typedef struct {
    int width, height;
    float left, top, right, bottom;
} Emission;

// How sheets that hide the same light are joined, and what spares pairs.
#define OVERLAP_SUM 0
#define OVERLAP_MAX 1
#define OVERLAP_HALF_MIN 2
#define OVERLAP_PRODUCT 3
#define CULLING_NONE 0
#define CULLING_LOOSE 1
#define CULLING_TIGHT 2

// The light that casts them, or a part of it.
typedef struct {
    float scale_x, scale_y, scale_d;   // from a receiver's (xi, eta, d) to tangents and disparity in the light's half extents
    float centre_x, centre_y;          // of the part, in half extents of the part, from the centre of the whole light
    float reach_x, reach_y;            // of the light in half extents: 1, or that of its bounding sphere for loose wedges
    float bias_x, bias_y;              // self-shadow: a caster's disparity steps count for this far in x and y; 0 for triangles
    float precision;                   // of receiver depth, relative
    float depth_error;                 // ReceiverView::depth_error, in the units of 1 / scale_d
    float position_error;              // of receivers in light space beside their own rounding, in half extents
    float share[3];                    // what the part's visibility counts for in the whole light's, for each channel
    int sheets;
    int overlap;                       // OVERLAP_...
    int culling;                       // CULLING_...
    int first;                         // whether it is the first part: visibility is written, not added to
} WedgeLight;

// The window of occlusion_texture's slices: a perspective from a centre behind the light (or an orthographic view), cut into texels.
typedef struct {
    int width, height;      // texels
    int slices;             // 1 to 64
    int orthographic;       // a directional light's
    float behind;           // how far the centre of projection lies behind the light's plane
    float centre_x, centre_y; // of the light's part, from the light's centre; scene units
    float low_x, low_y;     // tangents from there (orthographic: lengths) at the window's lower left corner
    float per_x, per_y;     // texels a tangent
} SliceView;

// One texture of occlusion: a slice, or one depth layer of it, as shading needs it.
typedef struct {
    int slice;                    // 0 is nearest to the light
    int layer;                    // -1: all that the slice holds; else the columns' how-manieth filled slice counts
    int levels;                   // that are built of it
    float at_x, at_y;             // texels a receiver's tangent, at the slice's far plane (orthographic: a length)
    float half_x, half_y;         // half the light's size in texels there, of a receiver infinitely far (orthographic: a unit behind the plane)
    float far;                    // depth of the slice's far plane
    float fade_from, per_fade;    // the slice counts for (z - fade_from) per_fade, from 0 to 1
} OcclusionPlane;

// One prefiltered level of every texture.
typedef struct {
    int width, height, stride;    // stored texels, with what pads them: at least one of nothing on every side
    int rows;                     // of one texture
    float scale, shift;           // from the window's texels to stored ones: x scale + shift, at their centres
    int offset;                   // where the level begins, in blocks of 1024 elements
} OcclusionLevel;

// How slices are combined.
#define COMBINE_PRODUCT 0
#define COMBINE_SUM 1
#define COMBINE_MAX 2
#define COMBINE_LAYERED 3
#define COMBINE_LAYERED_MAX 4

// The light that occlusion_texture shades for, or a part of it.
typedef struct {
    float centre_x, centre_y;     // of the part, from the light's centre; scene units
    float zero_x, zero_y;         // where tangent 0 is, in texels
    float share;                  // of the whole light
    int first;                    // whether it is the first part: visibility is written, not added to
    int orthographic;
    int planes;
    int taps_x, taps_y;           // lookups along each axis: a rectangle's kernel of square ones
    int combine;                  // COMBINE_...
} OcclusionLight;

// Smoothies' buffers: the occluder map's texels, in tangents of the light's view (orthographic: lengths).
#define SMOOTHIE_GROUP 16
typedef struct {
    int width, height;
    float left, top, step_x, step_y; // tangent of texel x, y's middle: left + x step_x, top - y step_y
    float fixed_width;               // t, as a tangent; 0: from the light
    float light;                     // half the light's size; orthographic: the tangent of half its angle
    int orthographic;
    int groups;                      // of silhouette edges
    int two_sided;
    int sinusoidal;                  // fall-off; else linear
} SmoothieView;

#endif
