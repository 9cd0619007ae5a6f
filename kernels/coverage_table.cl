// Tables of the share of a textured rectangle beyond an edge, for every pair of places of its two ends on the light (Assarsson 2003, Paper III, 3.3).
//
// With the share of the light between the centre's rays through both ends as a walk along its border, Green's theorem gives each entry from three line integrals:
//     A(a, b) = R(a) - R(b) + (S(b) - S(a)) - I(a, b)
// I: of the emission's integral over x, along the edge; R: the same from an end outwards to the border; S: along the border, counter-clockwise. Emission is
// constant within each texel, so all of them are exact but for rounding.
//
//   CHANNELS   of the emission: 1 or 3
#ifndef CHANNELS
#define CHANNELS 1
#endif
#include "common/shared.h"
#include "common/stop.clh"

// The emission comes as each row's running sum from the left, `sums` [height][width + 1][CHANNELS].

// On the light from -1 to 1 each way, y up, to texels, y down.
inline float2 texel_at(const Emission emission, const float2 place)
{
    const float2 part = (float2)(0.5f + 0.5f * place.x, 0.5f - 0.5f * place.y);
    return (float2)(emission.left, emission.top) + part * (float2)(emission.right - emission.left, emission.bottom - emission.top);
}

// Adds the mean of a row's running sum between two columns, times `height`.
inline void add_mean(float* sum, const Emission emission, __global const float* sums, const int row, const float x0, const float x1, const float height)
{
    const float low = fmin(x0, x1), high = fmax(x0, x1), width = high - low;
    __global const float* line = sums + row * (emission.width + 1) * CHANNELS;
    // Within a texel the running sum is linear: its middle is its mean. Of less than 2^-12 of a texel the middle's error is below 2^-13 of a texel's light.
    if (width < 0x1p-12f) {
        const int column = clamp((int)floor(0.5f * (low + high)), 0, emission.width - 1);
        const float in = 0.5f * (low + high) - column;
        for (int c = 0; c < CHANNELS; ++c) sum[c] += height * mix(line[column * CHANNELS + c], line[(column + 1) * CHANNELS + c], in);
        return;
    }
    for (int column = clamp((int)floor(low), 0, emission.width - 1); column < emission.width && column < high; ++column) {
        const float from = fmax(low, (float)column), to = fmin(high, column + 1.0f);
        if (!(to > from)) continue;
        const float in = 0.5f * (from + to) - column, weight = height * (to - from) / width;
        for (int c = 0; c < CHANNELS; ++c) sum[c] += weight * mix(line[column * CHANNELS + c], line[(column + 1) * CHANNELS + c], in);
    }
}

// Adds `sign` times the integral of the row sums along the line from a to b (texels), so that a closed path that turns counter-clockwise on the light gives the light inside.
inline void add_line(float* sum, const Emission emission, __global const float* sums, const float2 a, const float2 b, const float sign)
{
    const float2 top = a.y < b.y ? a : b, bottom = a.y < b.y ? b : a;
    const float down = a.y < b.y ? -sign : sign; // y goes down here, and the path's direction counts
    if (!(bottom.y > top.y)) return;
    const float slope = (bottom.x - top.x) / (bottom.y - top.y);
    for (int row = clamp((int)floor(top.y), 0, emission.height - 1); row < emission.height && row < bottom.y; ++row) {
        const float y0 = fmax(top.y, (float)row), y1 = fmin(bottom.y, row + 1.0f);
        if (!(y1 > y0)) continue;
        const float lowest = fmin(a.x, b.x), highest = fmax(a.x, b.x);
        const float x0 = clamp(fma(y0 - top.y, slope, top.x), lowest, highest), x1 = clamp(fma(y1 - top.y, slope, top.x), lowest, highest);
        add_mean(sum, emission, sums, row, x0, x1, down * (y1 - y0));
    }
}

// A place in halves of a step from the light's centre: whole numbers, and odd, as n is even; what is decided by them is decided alike everywhere.
inline int2 steps_of(const int number, const int n) { return (int2)(2 * (number % n) - (n - 1), 2 * (number / n) - (n - 1)); }

// How far round the border the ray from the centre through a place meets it (see around() in wedge_analytic.clh), and where.
inline float round_of(const int2 steps)
{
    const float x = steps.x, y = steps.y;
    if (abs(steps.x) >= abs(steps.y)) return (steps.x > 0 ? 0.0f : 4.0f) + y / x;
    return (steps.y > 0 ? 2.0f : 6.0f) - x / y;
}

inline float2 border_of(const int2 steps) { return convert_float2(steps) / (float)max(abs(steps.x), abs(steps.y)); }

inline bool turns_left(const int2 a, const int2 b) { return a.x * b.y - b.x * a.y >= 0; }

// From one place round the border to another, to the side that the line between them turns to (left where the centre is on it).
inline float border_between_places(const int2 a, const float a_round, const int2 b, const float b_round)
{
    const float length = b_round - a_round;
    return turns_left(a, b) ? (length < -2.0f ? length + 8.0f : length) : (length > 2.0f ? length - 8.0f : length);
}

// border_sums: S and R. `border` [n n][CHANNELS] is the integral along the border from the lower right corner, counter-clockwise, to where the ray through
// each place leaves; `radial` [n n][CHANNELS] that along the ray from the place to there.
__kernel void border_sums(const int n, const Emission emission, __global const float* restrict sums, __global float* restrict border,
                          __global float* restrict radial)
{
    const int at = get_global_id(0);
    if (at >= n * n) return;
    const int2 steps = steps_of(at, n);
    const float2 place = convert_float2(steps) / (float)(n - 1), leaves = border_of(steps);
    float along[CHANNELS], out[CHANNELS];
    for (int c = 0; c < CHANNELS; ++c) along[c] = out[c] = 0.0f;
    add_line(out, emission, sums, texel_at(emission, place), texel_at(emission, leaves), 1.0f);
    // Only the right side and the left one have a change of y. From the lower right corner, at -1: up the right side until 1, along the top until 3, down the left
    // side until 5, along the bottom.
    const float round = round_of(steps);
    const float2 lower_right = texel_at(emission, (float2)(1.0f, -1.0f)), upper_left = texel_at(emission, (float2)(-1.0f, 1.0f));
    const float2 upper_right = texel_at(emission, (float2)(1.0f, 1.0f)), lower_left = texel_at(emission, (float2)(-1.0f, -1.0f));
    add_line(along, emission, sums, lower_right, round < 1.0f ? texel_at(emission, leaves) : upper_right, 1.0f);
    if (round > 3.0f) add_line(along, emission, sums, upper_left, round < 5.0f ? texel_at(emission, leaves) : lower_left, 1.0f);
    for (int c = 0; c < CHANNELS; ++c) {
        border[at * CHANNELS + c] = along[c];
        radial[at * CHANNELS + c] = out[c];
    }
}

// coverage_table: table [n n][n n][CHANNELS], of the first end's place and the second's; shares of the light's whole `total` (1 over each channel's).
__kernel void coverage_table(const int n, const Emission emission, const float4 per_total, __global const float* restrict sums,
                             __global const float* restrict border, __global const float* restrict radial, __global float* restrict table,
                             __global const volatile int* stop)
{
    const int second = get_global_id(0), first = get_global_id(1);
    if (first >= n * n || second >= n * n || stopped(stop)) return;
    const int2 a = steps_of(first, n), b = steps_of(second, n);
    float share[CHANNELS];
    for (int c = 0; c < CHANNELS; ++c) share[c] = 0.0f;
    add_line(share, emission, sums, texel_at(emission, convert_float2(a) / (float)(n - 1)),
             texel_at(emission, convert_float2(b) / (float)(n - 1)), -1.0f);

    const float length = round_of(b) - round_of(a), turned = border_between_places(a, round_of(a), b, round_of(b));
    const float whole = turned > length ? 1.0f : turned < length ? -1.0f : 0.0f;
    const float totals[4] = {per_total.x, per_total.y, per_total.z, per_total.w};
    for (int c = 0; c < CHANNELS; ++c) {
        const float between = border[second * CHANNELS + c] - border[first * CHANNELS + c];
        const float sum = share[c] + radial[first * CHANNELS + c] - radial[second * CHANNELS + c] + between;
        table[((long)first * n * n + second) * CHANNELS + c] = sum * totals[c] + whole;
    }
}
