// One depth image, and the walk of a line through it: one text for OpenCL and for the host.
//
// A pixel's surface is a plane in *value*: disparity 1/z where the camera is a pinhole, and `far` - z where it is orthographic. Either way a
// plane of space is linear over the image, a line of space is straight in (x, y, value), and nearer is greater. x and y count in pixels from the
// image's upper left corner; pixel (0, 0)'s centre is at (0.5, 0.5).
//
// Every decision about a pixel is made from the pixel's own border and the line, never from where the walk came from: the pyramid changes no bit.
#ifndef PENUMBRA_COMMON_DEPTH_WALK_H
#define PENUMBRA_COMMON_DEPTH_WALK_H

#if defined(__OPENCL_VERSION__) || defined(__OPENCL_C_VERSION__) // the second: of a compiler without a device
#pragma OPENCL FP_CONTRACT OFF
#define DEPTH_MEMORY __global const
#define DEPTH_FUNCTION inline
#else
#include <math.h>
#define DEPTH_MEMORY const
#define DEPTH_FUNCTION inline
#endif

#include "common/depth_light.h"

// Sides of the pyramid's blocks, coarse to fine; each level keeps the greatest and the least value that a line can meet in its block.
#define DEPTH_LEVELS 3
#define DEPTH_BLOCK(level) (64 >> (2 * (level)))

// Hits nearer to the receiver than this many pixels (|dx| + |dy|) are its own surface, where receivers are the image's own pixels. Elsewhere,
// where they lie anywhere on what the image shows: hits nearer than this on a surface whose plane they lie on. Written as a negative number.
#define DEPTH_OWN_PIXELS 2.0f
#define DEPTH_OWN_PLANE -4.0f

typedef struct {
    int width, height;
    float pixel_x, pixel_y;   // tangents of a pixel; lengths where the camera is orthographic
    float middle_x, middle_y; // the axis, in pixels
    float nearest;            // the greatest value that a line can meet
    float far;                // orthographic: value = far - z
    int orthographic;
    int level_width[DEPTH_LEVELS], level_offset[DEPTH_LEVELS]; // blocks in a row of each level; where the level begins
    int blocks;               // of all levels: from there on the pyramid has the least value of each block's backs
} DepthView;

// What a line meets in a pixel. value 0: nothing.
typedef struct {
    float value, slope_x, slope_y; // at the centre; change from one pixel to the next
    float back;                    // how far the back lies behind the front, in value
    float slack;                   // how far the front may be off
    float joint;                   // the largest step to a neighbour on the same surface
    float unused_0, unused_1;
} DepthPixel;

// From a point along a direction, in the camera's own coordinates: x right, y up, z along the view.
typedef struct {
    float x, y, z;
} DepthVector;

// A line in the image: (x, y, value) + t (step_x, step_y, step_value), from t = from to t = to. Its faster axis moves one pixel a unit of t.
typedef struct {
    float x, y, value;
    float step_x, step_y, step_value;
    float from, to;
    float own; // hits before this many pixels do not count
    int leaves; // some of it, below everything that the image shows, lies beside the image
    float unit; // t of an unscaled step: see depth_along
    float start_z;
} DepthLine;

// What a line met. blocked: it was between a front and its back. crossed: it went through a front that was seen, so it is blocked whatever the
// backs are. behind: it went behind a front. left: it left the image before its end.
typedef struct {
    int blocked, crossed, behind, left;
    float enter, leave; // t where the first solid begins and ends, with `through`
} DepthMet;

// From how far on hits on a pixel count. base: how far behind the pixel's plane the receiver lies.
DEPTH_FUNCTION float depth_own(const float own, const float base, const float slack, const float slope_x, const float slope_y, const float value)
{
    if (own >= 0.0f) return own;
    return fabs(base) <= slack + fabs(slope_x) + fabs(slope_y) + 2e-4f * value ? -own : 0.0f;
}

DEPTH_FUNCTION float depth_value(const DepthView view, const float z)
{
    return view.orthographic ? view.far - z : 1.0f / z;
}

// The part of from to to in which start + t step lies between 0 and size; none: to < from.
DEPTH_FUNCTION void depth_clip(const float start, const float step, const float size, float* from, float* to)
{
    if (step == 0.0f) {
        if (start < 0.0f || start >= size) *to = -1.0f;
        return;
    }
    const float a = -start / step, b = (size - start) / step;
    *from = fmax(*from, fmin(a, b));
    *to = fmin(*to, fmax(a, b));
}

// The line from `point` along `direction` (unlike a unit vector: its end is point + direction), or without end when `endless`. own: see DepthLine.
// Not there (to < from) when no part of it can meet anything.
DEPTH_FUNCTION DepthLine depth_line(const DepthView view, DepthVector point, DepthVector direction, const int endless, const float own)
{
    DepthLine line;
    line.own = own;
    line.leaves = 0;
    line.from = 0.0f;
    line.to = -1.0f;
    line.x = line.y = line.value = line.step_x = line.step_y = line.step_value = line.unit = line.start_z = 0.0f;
    float length = 1.0f;
    if (!view.orthographic) {
        // What is behind the camera, or nearer than anything on the image, is passed over.
        const float least = 0.5f / view.nearest;
        if (!(point.z >= least)) {
            if (!(direction.z > 0.0f)) return line;
            const float skip = (least - point.z) / direction.z;
            if (!endless && skip >= 1.0f) return line;
            point.x += skip * direction.x;
            point.y += skip * direction.y;
            point.z = least;
            length = 1.0f - skip;
            line.own = 0.0f;
        }
        // With (X, Y, Z) = point + s direction: (X/Z, Y/Z, 1/Z) moves along (dx z - dz x, dy z - dz y, -dz) by s / (z Z), the same for all three.
        const float end_z = point.z + length * direction.z;
        line.x = point.x / point.z / view.pixel_x + view.middle_x;
        line.y = view.middle_y - point.y / point.z / view.pixel_y;
        line.value = 1.0f / point.z;
        line.step_x = (direction.x * point.z - direction.z * point.x) / view.pixel_x;
        line.step_y = -(direction.y * point.z - direction.z * point.y) / view.pixel_y;
        line.step_value = -direction.z;
        if (endless)
            line.to = direction.z > 0.0f ? 1.0f / (point.z * direction.z) : 3e38f;
        else
            line.to = end_z > 0.0f ? length / (point.z * end_z) : 3e38f;
    } else {
        line.x = point.x / view.pixel_x + view.middle_x;
        line.y = view.middle_y - point.y / view.pixel_y;
        line.value = view.far - point.z;
        line.step_x = direction.x / view.pixel_x;
        line.step_y = -direction.y / view.pixel_y;
        line.step_value = -direction.z;
        line.to = endless ? 3e38f : 1.0f;
    }
    line.start_z = point.z;

    // One pixel a unit of t. A line that hardly moves over the image: a unit is its own value.
    const float across = fmax(fabs(line.step_x), fabs(line.step_y));
    line.unit = fmax(across, fabs(line.step_value) / fmax(fabs(line.value), 1e-30f));
    if (!(line.unit > 0.0f)) {
        line.to = -1.0f;
        return line;
    }
    line.step_x /= line.unit;
    line.step_y /= line.unit;
    line.step_value /= line.unit;
    line.to = fmin(line.to * line.unit, 3e38f);

    // Above everything on the image there is nothing to meet; nor beside it.
    if (line.step_value > 0.0f) line.to = fmin(line.to, (view.nearest - line.value) / line.step_value);
    if (line.step_value < 0.0f) line.from = fmax(line.from, (view.nearest - line.value) / line.step_value);
    if (line.step_value == 0.0f && line.value > view.nearest) line.to = -1.0f;
    const float begin = line.from, end = line.to;
    depth_clip(line.x, line.step_x, (float)view.width, &line.from, &line.to);
    depth_clip(line.y, line.step_y, (float)view.height, &line.from, &line.to);
    line.leaves = begin < end && (line.from > begin || line.to < end);
    return line;
}

// How far along depth_line's direction t is, in parts of the direction: from where the line begins, which is `point` unless that was passed over.
DEPTH_FUNCTION float depth_along(const DepthView view, const DepthLine line, const float t)
{
    const float s = t / line.unit;
    if (view.orthographic) return s;
    return s * line.start_z * line.start_z / (1.0f + s * line.start_z * line.step_value * line.unit);
}

// The border of the cell `at` of cells of `side` pixels in the direction of `step`: behind it (ahead = 0) or before it (1).
DEPTH_FUNCTION float depth_border(const int at, const int side, const float start, const float step, const float inverse, const int ahead)
{
    const int plus = (step > 0.0f) == (ahead != 0) ? 1 : 0;
    return step != 0.0f ? ((float)((at + plus) * side) - start) * inverse : (ahead ? 3e38f : -3e38f);
}

// Whether a line goes through the surface that two neighbouring pixels show, where it goes from the first (x0, y0) to the second, at t.
DEPTH_FUNCTION int depth_between(const DepthView view, DEPTH_MEMORY DepthPixel* pixels, const DepthLine line, const int x0, const int y0, const int x1,
                                 const int y1, const float t)
{
    if (x0 < 0 || y0 < 0 || x0 >= view.width || y0 >= view.height || x1 < 0 || y1 < 0 || x1 >= view.width || y1 >= view.height) return 0;
    const DepthPixel first = pixels[y0 * view.width + x0], second = pixels[y1 * view.width + x1];
    if (!(first.value > 0.0f) || !(second.value > 0.0f) || !(fabs(second.value - first.value) < second.joint)) return 0;
    const float base0 = first.value + first.slope_x * (line.x - (float)x0 - 0.5f) + first.slope_y * (line.y - (float)y0 - 0.5f) - line.value;
    const float base1 = second.value + second.slope_x * (line.x - (float)x1 - 0.5f) + second.slope_y * (line.y - (float)y1 - 0.5f) - line.value;
    const float a = base0 + t * (first.slope_x * line.step_x + first.slope_y * line.step_y - line.step_value);
    const float b = base1 + t * (second.slope_x * line.step_x + second.slope_y * line.step_y - line.step_value);
    const float own = depth_own(line.own, base1, second.slack, second.slope_x, second.slope_y, second.value);
    return t * (fabs(line.step_x) + fabs(line.step_y)) >= own && (a > first.slack) != (b > second.slack);
}

// Where a line first meets the image, or (with `all`) everything that it meets; with `through` the first solid's extent as well.
//
//   pixels [height][width], nearest: the pyramid's levels, one after the other; levels: how many of them are used (0: every pixel is looked at)
DEPTH_FUNCTION DepthMet depth_walk(const DepthView view, DEPTH_MEMORY DepthPixel* pixels, DEPTH_MEMORY float* nearest, const int levels,
                                   const DepthLine line, const int all, const int through)
{
    DepthMet met;
    met.blocked = met.crossed = met.behind = 0;
    met.left = line.leaves;
    met.enter = met.leave = 0.0f;
    if (!(line.from < line.to)) return met;
    const float inverse_x = line.step_x != 0.0f ? 1.0f / line.step_x : 0.0f, inverse_y = line.step_y != 0.0f ? 1.0f / line.step_y : 0.0f;
    const float speed = fabs(line.step_x) + fabs(line.step_y);
    float t = line.from;
    int cx = (int)floor(line.x + t * line.step_x), cy = (int)floor(line.y + t * line.step_y);
    cx = cx < 0 ? 0 : cx >= view.width ? view.width - 1 : cx;
    cy = cy < 0 ? 0 : cy >= view.height ? view.height - 1 : cy;

    int solid = 0; // inside the first solid
    while (t < line.to && cx >= 0 && cy >= 0 && cx < view.width && cy < view.height) {
        // The coarsest block that the line passes above.
        int skipped = 0;
        for (int level = 0; level < levels && !skipped && !solid; ++level) {
            const int side = DEPTH_BLOCK(level), bx = cx / side, by = cy / side;
            const float ex = depth_border(bx, side, line.x, line.step_x, inverse_x, 1), ey = depth_border(by, side, line.y, line.step_y, inverse_y, 1);
            const float end = fmin(line.to, fmin(ex, ey));
            const float lowest = fmin(line.value + t * line.step_value, line.value + end * line.step_value);
            if (!(lowest > nearest[view.level_offset[level] + by * view.level_width[level] + bx])) continue;
            skipped = 1;
            t = end;
            if (ex < ey) {
                const int y = (int)floor(line.y + t * line.step_y), low = by * side, high = by * side + side - 1;
                cx = line.step_x > 0.0f ? (bx + 1) * side : bx * side - 1;
                cy = y < low ? low : y > high ? high : y;
                cy = cy >= view.height ? view.height - 1 : cy;
            } else {
                const int x = (int)floor(line.x + t * line.step_x), low = bx * side, high = bx * side + side - 1;
                cy = line.step_y > 0.0f ? (by + 1) * side : by * side - 1;
                cx = x < low ? low : x > high ? high : x;
                cx = cx >= view.width ? view.width - 1 : cx;
            }
        }
        if (skipped) continue;

        // One pixel, between its own borders.
        const float ex = depth_border(cx, 1, line.x, line.step_x, inverse_x, 1), ey = depth_border(cy, 1, line.y, line.step_y, inverse_y, 1);
        const float enter_x = depth_border(cx, 1, line.x, line.step_x, inverse_x, 0), enter_y = depth_border(cy, 1, line.y, line.step_y, inverse_y, 0);
        const float begin = fmax(line.from, fmax(enter_x, enter_y));
        const float end = fmin(line.to, fmin(ex, ey));
        const int j = cy * view.width + cx;
        const float value = pixels[j].value;
        if (value > 0.0f && begin < end) {
            const float slope_x = pixels[j].slope_x, slope_y = pixels[j].slope_y, slack = pixels[j].slack, back = pixels[j].back;
            // How far behind the front the line is, where it enters and where it leaves.
            const float base = value + slope_x * (line.x - (float)cx - 0.5f) + slope_y * (line.y - (float)cy - 0.5f) - line.value;
            const float rise = slope_x * line.step_x + slope_y * line.step_y - line.step_value;
            const float a = base + begin * rise, b = base + end * rise;
            if (begin * speed >= depth_own(line.own, base, slack, slope_x, slope_y, value)) {
                const int hit = fmax(a, b) > slack && fmin(a, b) < back + slack;
                if (through) {
                    // Where the line is between front and back, within the pixel.
                    float in = begin, out = end;
                    const float deep = back + slack;
                    if (hit && rise != 0.0f) {
                        const float p = (slack - base) / rise, q = (deep - base) / rise;
                        in = fmax(in, fmin(p, q));
                        out = fmin(out, fmax(p, q));
                    }
                    if (hit && !solid) {
                        met.enter = in;
                        met.blocked = solid = 1;
                    }
                    if (solid && hit) met.leave = out;
                    if (solid && (!hit || out < end)) return met;
                } else {
                    met.blocked |= hit;
                    if (hit && !all) return met;
                    met.crossed |= (a > slack) != (b > slack);
                    met.behind |= fmax(a, b) > slack;
                }
            }
            // Between two pixels of one surface: where the line comes from, and where it goes. A line that meets neither passes above both, so
            // each pair is looked at, whatever the pyramid passes over. Lines through a corner cross at neither side of it.
            if (!through && begin > line.from && enter_x != enter_y)
                met.crossed |= depth_between(view, pixels, line, enter_x > enter_y ? cx - (line.step_x > 0.0f ? 1 : -1) : cx,
                                             enter_x > enter_y ? cy : cy - (line.step_y > 0.0f ? 1 : -1), cx, cy, begin);
            if (!through && end < line.to && ex != ey)
                met.crossed |= depth_between(view, pixels, line, cx, cy, ex < ey ? cx + (line.step_x > 0.0f ? 1 : -1) : cx,
                                             ex < ey ? cy : cy + (line.step_y > 0.0f ? 1 : -1), end);
        } else if (through && solid) {
            return met;
        }
        t = end;
        if (ex < ey)
            cx += line.step_x > 0.0f ? 1 : -1;
        else
            cy += line.step_y > 0.0f ? 1 : -1;
    }
    return met;
}

#endif
