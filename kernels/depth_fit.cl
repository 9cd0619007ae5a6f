// A plane for each pixel of a depth image: weighted least squares over the pixels around it that lie on its surface.
//
// Images are padded by DEPTH_PAD pixels of nothing on every side, so that windows need no borders: [rows][stride], value 0 where nothing is.
// Values: see common/depth_walk.h. Launched over width x height, the pixels inside the padding.
#include "common/shared.h"
#include "common/stop.clh"

#define DEPTH_PAD 16

// How far from the plane a pixel of the same surface may lie.
inline float loose(const float value, const float sigma, const float slope_x, const float slope_y)
{
    return 4.0f * sigma + 0.8f * (fabs(slope_x) + fabs(slope_y)) + 3e-7f * value;
}

// The smaller of the steps to the two neighbours; one where only one is there; 0 where none is.
inline float smaller_step(const float before, const float here, const float after)
{
    const float a = after > 0.0f ? after - here : MAXFLOAT, b = before > 0.0f ? here - before : MAXFLOAT;
    const float least = fabs(a) < fabs(b) ? a : b;
    return fabs(least) < MAXFLOAT ? least : 0.0f;
}

// depth_planes: four passes, each over the pixels near the plane of the last.
//
//   value, sigma [rows][stride]  value and its standard error
//   reach                        the window is 2 reach + 1 pixels wide
//   fit, slope_x, slope_y        the plane at the pixel's centre, and its steps to the next pixel right and down
//   residual                     root mean square distance of the pixels from it
//   count                        how many pixels it rests on, about
__kernel void depth_planes(const int2 size, const int stride, const int reach, __global const float* restrict value, __global const float* restrict sigma,
                           __global float* restrict fit, __global float* restrict slope_x, __global float* restrict slope_y,
                           __global float* restrict residual, __global float* restrict count, __global const volatile int* stop)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y || stopped(stop)) return;
    const int at = (y + DEPTH_PAD) * stride + x + DEPTH_PAD;
    const float own = value[at], error = sigma[at], per_reach = 0.6f / (reach * reach);
    // Over a wider step where the window is wide: noise bends the first slope less.
    const int far = reach > 2 ? reach / 2 : 1;
    float plane = own;
    float sx = smaller_step(value[at - far], own, value[at + far]) / far, sy = smaller_step(value[at - far * stride], own, value[at + far * stride]) / far;
    float rms = 0.0f, number = 1.0f;

    for (int turn = 0; turn < 4; ++turn) {
        const float limit = loose(own, error, sx, sy) * (turn == 0 ? 1.5f : 1.0f);
        // Sums of distances from the plane so far, so that float32 holds what is left.
        float w0 = 0.0f, wx = 0.0f, wy = 0.0f, wxx = 0.0f, wxy = 0.0f, wyy = 0.0f, wv = 0.0f, wvx = 0.0f, wvy = 0.0f, wvv = 0.0f;
        for (int j = -reach; j <= reach; ++j)
            for (int i = -reach; i <= reach; ++i) {
                const float fx = i, fy = j, other = value[at + j * stride + i];
                const float off = (other - plane) - (sx * fx + sy * fy);
                const float weight = 1.0f / (1.0f + (fx * fx + fy * fy) * per_reach);
                const float w = other > 0.0f && fabs(off) < limit ? weight : 0.0f;
                const float v = w * off;
                w0 += w;
                wx = fma(w, fx, wx);
                wy = fma(w, fy, wy);
                wxx = fma(w, fx * fx, wxx);
                wxy = fma(w, fx * fy, wxy);
                wyy = fma(w, fy * fy, wyy);
                wv += v;
                wvx = fma(v, fx, wvx);
                wvy = fma(v, fy, wvy);
                wvv = fma(v, off, wvv);
            }
        // The normal equations by Cramer's rule.
        const float c00 = wxx * wyy - wxy * wxy, c01 = wxy * wy - wx * wyy, c02 = wx * wxy - wxx * wy;
        const float determinant = w0 * c00 + wx * c01 + wy * c02;
        const int good = w0 > 2.0f && determinant > 0.5f;
        const float inverse = good ? 1.0f / determinant : 0.0f;
        const float da = (wv * c00 + wvx * c01 + wvy * c02) * inverse;
        const float dx = (wv * c01 + wvx * (w0 * wyy - wy * wy) + wvy * (wx * wy - w0 * wxy)) * inverse;
        const float dy = (wv * c02 + wvx * (wx * wy - w0 * wxy) + wvy * (w0 * wxx - wx * wx)) * inverse;
        plane = good ? plane + da : own;
        sx += dx;
        sy += dy;
        rms = good ? sqrt(fmax(wvv - (da * wv + dx * wvx + dy * wvy), 0.0f) / w0) : 0.5f * loose(own, error, sx, sy);
        number = good ? 1.2f * w0 : 1.0f;
    }
    fit[at] = plane;
    slope_x[at] = sx;
    slope_y[at] = sy;
    residual[at] = rms;
    count[at] = number;
}

// depth_creases: at a crease no plane fits, and the plane of one of the eight windows `reach` pixels beside it is taken where that explains the
// pixel five times better.
__kernel void depth_creases(const int2 size, const int stride, const int reach, __global const float* restrict value, __global const float* restrict sigma,
                            __global const float* restrict fit, __global const float* restrict slope_x, __global const float* restrict slope_y,
                            __global const float* restrict residual, __global const float* restrict count, __global float* restrict new_fit,
                            __global float* restrict new_slope_x, __global float* restrict new_slope_y, __global float* restrict new_residual,
                            __global float* restrict new_count, __global const volatile int* stop)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= size.x || y >= size.y || stopped(stop)) return;
    const int at = (y + DEPTH_PAD) * stride + x + DEPTH_PAD;
    const float own = value[at], error = sigma[at];
    const int crease = own > 0.0f && residual[at] >= 2.0f * error + 1e-7f * own;
    float best = residual[at] / sqrt(fmax(count[at], 1.0f)) + 0.5f * fabs(fit[at] - own);
    float plane = fit[at], sx = slope_x[at], sy = slope_y[at], rms = residual[at], number = count[at];
    for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
            const int other = at + j * reach * stride + i * reach;
            const int there = x + i * reach >= 0 && x + i * reach < size.x && y + j * reach >= 0 && y + j * reach < size.y && (i != 0 || j != 0);
            const int from = there ? other : at;
            const float gx = slope_x[from], gy = slope_y[from];
            const float here = fit[from] - gx * (float)(i * reach) - gy * (float)(j * reach);
            const float score = residual[from] / sqrt(fmax(count[from], 1.0f)) + 0.5f * fabs(here - own);
            const int take = crease && there && value[from] > 0.0f && score < 0.2f * best
                             && fabs(here - own) < 3.0f * error + 0.5f * (fabs(gx) + fabs(gy)) + 3e-7f * own;
            best = take ? score : best;
            plane = take ? here : plane;
            sx = take ? gx : sx;
            sy = take ? gy : sy;
            rms = take ? residual[from] : rms;
            number = take ? count[from] : number;
        }
    new_fit[at] = plane;
    new_slope_x[at] = sx;
    new_slope_y[at] = sy;
    new_residual[at] = rms;
    new_count[at] = number;
}
