// Shadow rays through depth images: each receiver's segments to stratified points of the light, walked in the image itself
// (common/depth_walk.h).
//
// Several images are an exact union: a launch for each adds to the same bits, one a sample, and depth_count makes visibility of them.
//
// Specialisation constants
//   LANES   samples that are tested at once: 16 or 8 on CPU devices, 1 on GPUs
#include "common/shared.h"
#include "common/lanes.clh"
#include "common/depth_walk.h"

// SplitMix64's finaliser, as in host/trace/light_samples.cpp: the same samples as the host's rays.
inline ulong mixed(ulong z)
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9UL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebUL;
    return z ^ (z >> 31);
}

inline ulong sample_key(const DepthLight light, const ulong pixel)
{
    const ulong seed = (ulong)(uint)light.seed_high << 32 | (uint)light.seed_low;
    return mixed(mixed(seed + 0x9e3779b97f4a7c15UL) + 0x9e3779b97f4a7c15UL * (pixel + 1UL));
}

// A jittered point of stratum k, in [-1, 1]^2; step: 2^-16 of a stratum.
inline float2 jittered(const float2 low, const float2 step, const ulong key, const int k)
{
    uint h = (uint)k * 0x9e3779b9U + (uint)key;
    h = ((h ^ (h >> 16)) * 0x7feb352dU) ^ (uint)(key >> 32);
    h = (h ^ (h >> 15)) * 0x846ca68bU;
    h ^= h >> 16;
    return low + (convert_float2((int2)(h & 0xffff, h >> 16)) + 0.5f) * step;
}

// The square onto the disc (Shirley and Chiu 1997), with the host's series.
inline float2 square_to_disc(const float2 s)
{
    const int wide = fabs(s.x) > fabs(s.y);
    const float radius = wide ? s.x : s.y, other = wide ? s.y : s.x;
    const float angle = radius != 0.0f ? 0.785398163f * other / radius : 0.0f, a2 = angle * angle;
    const float cosine = 1.0f + a2 * (-1.0f / 2 + a2 * (1.0f / 24 + a2 * (-1.0f / 720 + a2 * (1.0f / 40320))));
    const float sine = angle * (1.0f + a2 * (-1.0f / 6 + a2 * (1.0f / 120 + a2 * (-1.0f / 5040 + a2 * (1.0f / 362880)))));
    return (float2)(radius * (wide ? cosine : sine), radius * (wide ? sine : cosine));
}

inline float3 of3(const float* v)
{
    return (float3)(v[0], v[1], v[2]);
}

inline float3 moved(const float* m, const float3 p)
{
    return (float3)(m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7], m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]);
}

inline float3 turned(const float* m, const float3 p)
{
    return (float3)(m[0] * p.x + m[1] * p.y + m[2] * p.z, m[4] * p.x + m[5] * p.y + m[6] * p.z, m[8] * p.x + m[9] * p.y + m[10] * p.z);
}

// A light's disc that faces the receiver.
inline void face_receiver(const float3 centre, float3* half_u, float3* half_v)
{
    const float3 axis = normalize(centre), size = fabs(axis);
    const float3 other = size.x <= size.y && size.x <= size.z ? (float3)(1, 0, 0) : size.y <= size.z ? (float3)(0, 1, 0) : (float3)(0, 0, 1);
    const float radius = length(*half_u);
    *half_u = normalize(cross(axis, other)) * radius;
    *half_v = normalize(cross(axis, *half_u)) * radius;
}

// depth_trace: which of the light's samples each receiver does not see.
//
//   points, normals [receivers][3]   in the receivers' camera's coordinates; z = 0: no receiver. Without has_normals the normals are not read
//   strata [samples]                 low corners; step: 2^-16 of their size
//   blocked, crossed, unknown [words][count]   bits are added: not seen; not seen for certain; not known. The last two where `bounds` is not 0
//   left [count]                     samples whose segments left the image; where `bounds` is not 0
//
// Launched over count receivers.
__kernel void depth_trace(const DepthView view, const DepthLight light, const int bounds, __global const DepthPixel* restrict pixels,
                          __global const float* restrict nearest, __global const float* restrict points, __global const float* restrict normals,
                          __global const float2* restrict strata, const float2 step, __global uint* restrict blocked, __global uint* restrict crossed,
                          __global uint* restrict unknown, __global uint* restrict left)
{
    const int item = get_global_id(0);
    if (item >= light.count) return;
    const int i = light.first + item;
    const float3 given = vload3(i, points);
    if (!(given.z > 0.0f)) return;
    const float3 point = moved(light.image_from_receiver, given);
    const float3 normal = light.has_normals ? turned(light.image_from_receiver, vload3(i, normals)) : (float3)(0.0f);
    float3 centre = of3(light.centre), half_u = of3(light.half_u), half_v = of3(light.half_v);
    if (!light.endless) centre -= point;
    if (light.sphere && dot(half_u, half_u) > 0.0f) face_receiver(centre, &half_u, &half_v);
    const ulong key = sample_key(light, (ulong)(i + light.key_first));
    const DepthVector start = {point.x, point.y, point.z};
    uint outside = 0;

    for (int first = 0; first < light.samples; first += 32) {
        const int word = (first / 32) * light.count + item;
        uint bits = blocked[word], sure = bounds ? crossed[word] : 0, maybe = bounds ? unknown[word] : 0;
        for (int k = first; k < min(first + 32, light.samples); ++k) {
            const uint bit = 1U << (k - first);
            if ((bounds ? sure : bits) & bit) continue;
            float2 sample = jittered(strata[k], step, key, k);
            if (light.disc) sample = square_to_disc(sample);
            const float3 way = centre + sample.x * half_u + sample.y * half_v;
            if (light.has_normals && dot(way, normal) <= 0.0f) {
                bits |= bit;
                sure |= bit;
                continue;
            }
            const DepthVector direction = {way.x, way.y, way.z};
            const DepthLine line = depth_line(view, start, direction, light.endless, light.own);
            const DepthMet met = depth_walk(view, pixels, nearest, DEPTH_LEVELS, line, bounds, 0);
            bits |= met.blocked ? bit : 0;
            // What is blocked for certain is blocked: a crossing that the surface's own back hides is not counted.
            sure |= met.crossed && met.blocked ? bit : 0;
            maybe |= met.behind || met.crossed ? bit : 0;
            outside += !met.crossed && met.left;
        }
        blocked[word] = bits;
        if (!bounds) continue;
        crossed[word] = sure;
        unknown[word] = maybe;
    }
    if (bounds) left[item] += outside;
}

// The samples of a bundle, and vectors of them.
#define BUNDLE 64
#define GROUPS (BUNDLE / LANES)
// Groups of 16 samples: 4 x 4 strata side by side.
#define CLOSE_GROUPS (16 / LANES)

#if LANES == 1
typedef uint uintn;
#define convert_uintn convert_uint
#define lane_numbers() 0
#elif LANES == 8
typedef uint8 uintn;
#define convert_uintn convert_uint8
#define lane_numbers() (int8)(0, 1, 2, 3, 4, 5, 6, 7)
#else
typedef uint16 uintn;
#define convert_uintn convert_uint16
#define lane_numbers() (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
#endif

// Lines of a bundle, as DepthLine has them: they start at one point.
typedef struct {
    floatn step_x, step_y, step_value, inverse_x, inverse_y, speed, from, to;
    intn blocked;
} Lines;

// What holds for all lines of a bundle, against the distance s from the start along its major axis: minor coordinate and value lie between
// start + low s and start + high s.
typedef struct {
    float minor_low, minor_high, value_low, value_high, end;
} Fan;

inline float least_lane(const floatn v)
{
    float lanes[LANES];
    store_lanes(v, lanes);
    float least = lanes[0];
    for (int i = 1; i < LANES; ++i) least = lanes[i] < least ? lanes[i] : least;
    return least;
}

inline float low_end(const float start, const float rate, const float s0, const float s1)
{
    return start + rate * (rate < 0.0f ? s1 : s0);
}

inline float high_end(const float start, const float rate, const float s0, const float s1)
{
    return start + rate * (rate > 0.0f ? s1 : s0);
}

// The fan of lines that are not blocked yet. major: 0 for x, 1 for y; sign: the way that they all go along it.
inline Fan fan_of(const Lines* lines, const int groups, const int major, const float sign)
{
    const floatn most = (floatn)(MAXFLOAT);
    floatn minor_low = most, minor_high = most, value_low = most, value_high = most, end = most;
    for (int g = 0; g < groups; ++g) {
        const floatn along = sign * (major ? lines[g].step_y : lines[g].step_x), inverse = 1.0f / along;
        const floatn minor = (major ? lines[g].step_x : lines[g].step_y) * inverse, value = lines[g].step_value * inverse;
        const intn open = lines[g].blocked == 0;
        const floatn minor_there = select_lanes(most, minor, open), value_there = select_lanes(most, value, open);
        const floatn minor_back = select_lanes(most, -minor, open), value_back = select_lanes(most, -value, open);
        const floatn reach = select_lanes(most, -lines[g].to * along, open);
        minor_low = select_lanes(minor_low, minor_there, minor_there < minor_low);
        minor_high = select_lanes(minor_high, minor_back, minor_back < minor_high);
        value_low = select_lanes(value_low, value_there, value_there < value_low);
        value_high = select_lanes(value_high, value_back, value_back < value_high);
        end = select_lanes(end, reach, reach < end);
    }
    const Fan fan = {least_lane(minor_low), -least_lane(minor_high), least_lane(value_low), -least_lane(value_high), -least_lane(end)};
    return fan;
}

// Whether all lines go the same way along an axis: +1 or -1, else 0; and how far the slowest moves a unit of t.
inline float common_way(const Lines* lines, const int axis, float* slowest)
{
    floatn low = (floatn)(MAXFLOAT), high = (floatn)(MAXFLOAT);
    for (int g = 0; g < GROUPS; ++g) {
        const floatn step = axis ? lines[g].step_y : lines[g].step_x;
        const intn open = lines[g].blocked == 0;
        const floatn there = select_lanes((floatn)(MAXFLOAT), step, open), back = select_lanes((floatn)(MAXFLOAT), -step, open);
        low = select_lanes(low, there, there < low);
        high = select_lanes(high, back, back < high);
    }
    const float least = least_lane(low), most = -least_lane(high);
    *slowest = least > 0.0f ? least : most < 0.0f ? -most : 0.0f;
    return least > 0.0f ? 1.0f : -1.0f;
}

// Adds what a pixel blocks: depth_walk's test of a pixel, for every line of the bundle.
inline void block_lines(Lines* lines, const int groups, const DepthPixel pixel, const int cx, const int cy, const float base, const float own, const float x, const float y)
{
    const float deep = pixel.back + pixel.slack, clear = depth_own(own, base, pixel.slack, pixel.slope_x, pixel.slope_y, pixel.value);
    for (int g = 0; g < groups; ++g) {
        const floatn left = (float)cx - x, right = (float)(cx + 1) - x, top = (float)cy - y, bottom = (float)(cy + 1) - y;
        const intn ahead_x = lines[g].step_x >= 0.0f, ahead_y = lines[g].step_y >= 0.0f;
        const floatn near_x = select_lanes(right, left, ahead_x) * lines[g].inverse_x, far_x = select_lanes(left, right, ahead_x) * lines[g].inverse_x;
        const floatn near_y = select_lanes(bottom, top, ahead_y) * lines[g].inverse_y, far_y = select_lanes(top, bottom, ahead_y) * lines[g].inverse_y;
        const floatn enter = select_lanes(near_y, near_x, near_x > near_y), leave = select_lanes(far_y, far_x, far_x < far_y);
        const floatn begin = select_lanes(lines[g].from, enter, enter > lines[g].from), end = select_lanes(lines[g].to, leave, leave < lines[g].to);
        const floatn rise = pixel.slope_x * lines[g].step_x + pixel.slope_y * lines[g].step_y - lines[g].step_value;
        const floatn a = base + begin * rise, b = base + end * rise;
        const floatn high = select_lanes(b, a, a > b), low = select_lanes(a, b, a > b);
        lines[g].blocked |= (begin < end) & (high > pixel.slack) & (low < deep) & (begin * lines[g].speed >= clear);
    }
}

inline int all_blocked(const Lines* lines, const int groups)
{
    intn together = lines[0].blocked;
    for (int g = 1; g < groups; ++g) together &= lines[g].blocked;
    return ALL(together != 0);
}

// Everything that some lines can meet, column by column along their common axis from column m on: blocks that lie behind all of them are passed
// over, or before all that they show, then pixels; the pixels that are left are tested against every line. With `probe` none is tested, and the walk ends at the first of them.
// Returns the column where it ends; beyond the image when there is nothing more to meet.
inline int walk_bundle(const DepthView view, __global const DepthPixel* restrict pixels, __global const float* restrict nearest, const float x,
                        const float y, const float value, const float own, const int major, const float sign, int m, const int probe, const int groups, Lines* lines)
{
    const Fan fan = fan_of(lines, groups, major, sign);
    const float start = major ? y : x, minor_start = major ? x : y;
    const int majors = major ? view.height : view.width, minors = major ? view.width : view.height;
    const int ahead = sign > 0.0f;
    const float steepest = 1.0f + fmax(fabs(fan.minor_low), fabs(fan.minor_high));
    int entered = 1;
    while (m >= 0 && m < majors) {
        const float s0 = fmax(sign * ((float)(ahead ? m : m + 1) - start), 0.0f);
        if (s0 > fan.end) break;
        if (fan.value_low > 0.0f && value + fan.value_low * s0 > view.nearest) break;

        // The coarsest blocks that begin here and lie behind.
        int passed = 0;
        for (int level = 0; level < DEPTH_LEVELS && !passed; ++level) {
            const int side = DEPTH_BLOCK(level);
            if (!entered && (ahead ? m : m + 1) % side != 0) continue;
            const int block = m / side, border = ahead ? (block + 1) * side : block * side;
            const float s1 = fmin(sign * ((float)border - start), fan.end);
            const float low = low_end(minor_start, fan.minor_low, s0, s1) - 0.01f, high = high_end(minor_start, fan.minor_high, s0, s1) + 0.01f;
            const int first = (int)fmax(low, 0.0f) / side, last = (int)fmin(high, (float)(minors - 1)) / side;
            const float lowest = low_end(value, fan.value_low, s0, s1);
            const float limit = lowest - 1e-6f * fabs(lowest);
            const float highest = high_end(value, fan.value_high, s0, s1), far_limit = highest + 1e-6f * fabs(highest);
            int apart = last - first < 16;
            for (int n = first; n <= last && apart; ++n) {
                const int bx = major ? n : block, by = major ? block : n, at = view.level_offset[level] + by * view.level_width[level] + bx;
                apart = nearest[at] < limit || nearest[view.blocks + at] > far_limit;
            }
            if (!apart && (high >= 0.0f && low < (float)minors)) continue;
            passed = 1;
            m = ahead ? border : border - 1;
        }
        entered = 0;
        if (passed) continue;

        // One column of pixels.
        const float s1 = fmin(sign * ((float)(ahead ? m + 1 : m) - start), fan.end);
        if (s1 * steepest >= own) {
            const int first = (int)fmax(low_end(minor_start, fan.minor_low, s0, s1) - 0.01f, 0.0f);
            const int last = (int)fmin(high_end(minor_start, fan.minor_high, s0, s1) + 0.01f, (float)(minors - 1));
            int met = 0;
            const float column_limit = low_end(value, fan.value_low, s0, s1) * (1.0f - 1e-6f);
            const float column_far = high_end(value, fan.value_high, s0, s1) * (1.0f + 1e-6f);
            for (int n = first; n <= last; ++n) {
                // The finest blocks of it that lie apart.
                if (last - first > 8 && (n == first || n % DEPTH_BLOCK(DEPTH_LEVELS - 1) == 0)) {
                    const int level = DEPTH_LEVELS - 1, side = DEPTH_BLOCK(level), bx = (major ? n : m) / side, by = (major ? m : n) / side;
                    const int at = view.level_offset[level] + by * view.level_width[level] + bx;
                    if (nearest[at] < column_limit || nearest[view.blocks + at] > column_far) {
                        n = (n / side + 1) * side - 1;
                        continue;
                    }
                }
                const int cx = major ? n : m, cy = major ? m : n;
                const DepthPixel pixel = pixels[cy * view.width + cx];
                if (!(pixel.value > 0.0f)) continue;
                // How far behind the front the lines can be in this column.
                const float base = pixel.value + pixel.slope_x * (x - (float)cx - 0.5f) + pixel.slope_y * (y - (float)cy - 0.5f) - value;
                const float along = sign * (major ? pixel.slope_y : pixel.slope_x), across = major ? pixel.slope_x : pixel.slope_y;
                const float across_low = across * fan.minor_low, across_high = across * fan.minor_high;
                const float most = along + fmax(across_low, across_high) - fan.value_low, least = along + fmin(across_low, across_high) - fan.value_high;
                if (high_end(base, most, s0, s1) <= 0.5f * pixel.slack || low_end(base, least, s0, s1) >= pixel.back + 2.0f * pixel.slack) continue;
                if (probe) return m;
                block_lines(lines, groups, pixel, cx, cy, base, own, x, y);
                met = 1;
            }
            if (met && all_blocked(lines, groups)) return -1;
        }
        m += ahead ? 1 : -1;
    }
    return -1;
}

// The lines of a bundle's samples, those below the receiver's plane blocked. Returns whether they can be walked together.
inline int bundle_lines(const DepthView view, const DepthLight light, const float3 point, const float3 normal, const float3 centre, const float3 half_u,
                        const float3 half_v, const ulong key, __global const float2* restrict strata, const float2 step, const int first, Lines* lines)
{
    const float start_value = depth_value(view, point.z);
    for (int g = 0; g < GROUPS; ++g) {
        const intn k = first + g * LANES + lane_numbers();
        // Samples, as jittered() has them.
        float low_x[LANES], low_y[LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            const float2 low = strata[min(first + g * LANES + lane, light.samples - 1)];
            low_x[lane] = low.x;
            low_y[lane] = low.y;
        }
        uintn h = convert_uintn(k) * 0x9e3779b9U + (uint)key;
        h = ((h ^ (h >> 16)) * 0x7feb352dU) ^ (uint)(key >> 32);
        h = (h ^ (h >> 15)) * 0x846ca68bU;
        h ^= h >> 16;
        floatn u = load_lanes(low_x) + (convert_floatn(h & 0xffffU) + 0.5f) * step.x, v = load_lanes(low_y) + (convert_floatn(h >> 16) + 0.5f) * step.y;
        if (light.disc) {
            float us[LANES], vs[LANES];
            store_lanes(u, us);
            store_lanes(v, vs);
            for (int lane = 0; lane < LANES; ++lane) {
                const float2 s = square_to_disc((float2)(us[lane], vs[lane]));
                us[lane] = s.x;
                vs[lane] = s.y;
            }
            u = load_lanes(us);
            v = load_lanes(vs);
        }
        const floatn dx = centre.x + u * half_u.x + v * half_v.x, dy = centre.y + u * half_u.y + v * half_v.y, dz = centre.z + u * half_u.z + v * half_v.z;
        intn blocked = k >= light.samples;
        if (light.has_normals) blocked |= dx * normal.x + dy * normal.y + dz * normal.z <= 0.0f;

        // depth_line, for a start that is before the camera.
        floatn sx = (dx * point.z - dz * point.x) / view.pixel_x, sy = -(dy * point.z - dz * point.y) / view.pixel_y, sv = -dz, to;
        if (view.orthographic) {
            sx = dx / view.pixel_x;
            sy = -dy / view.pixel_y;
            to = light.endless ? (floatn)(3e38f) : (floatn)(1.0f);
        } else if (light.endless) {
            to = select_lanes((floatn)(3e38f), 1.0f / (point.z * dz), dz > 0.0f);
        } else {
            const floatn end_z = point.z + dz;
            to = select_lanes((floatn)(3e38f), 1.0f / (point.z * end_z), end_z > 0.0f);
        }
        const floatn across = fmax(fabs(sx), fabs(sy)), unit = fmax(across, fabs(sv) / fmax(fabs(start_value), 1e-30f));
        sx /= unit;
        sy /= unit;
        sv /= unit;
        to = fmin(to * unit, 3e38f);
        const floatn turn = (view.nearest - start_value) / sv;
        to = select_lanes(to, fmin(to, turn), sv > 0.0f);
        lines[g].from = select_lanes((floatn)(0.0f), fmax(turn, 0.0f), sv < 0.0f);
        lines[g].step_x = sx;
        lines[g].step_y = sy;
        lines[g].step_value = sv;
        lines[g].inverse_x = select_lanes((floatn)(3e38f), 1.0f / sx, sx != 0.0f);
        lines[g].inverse_y = select_lanes((floatn)(3e38f), 1.0f / sy, sy != 0.0f);
        lines[g].speed = fabs(sx) + fabs(sy);
        lines[g].to = to;
        lines[g].blocked = blocked;
    }
    return 1;
}

// depth_trace_bundles: depth_trace without bounds, for bundles of 64 samples: their lines start at one point and stay close, so that one search
// finds what any of them can meet.
//
// Launched over count receivers x bundles.
__kernel void depth_trace_bundles(const DepthView view, const DepthLight light, __global const DepthPixel* restrict pixels,
                                  __global const float* restrict nearest, __global const float* restrict points, __global const float* restrict normals,
                                  __global const float2* restrict strata, const float2 step, __global uint* restrict blocked)
{
    const int item = get_global_id(0), first = get_global_id(1) * BUNDLE;
    if (item >= light.count || first >= light.samples) return;
    const int i = light.first + item;
    const float3 given = vload3(i, points);
    if (!(given.z > 0.0f)) return;
    const float3 point = moved(light.image_from_receiver, given);
    const float3 normal = light.has_normals ? turned(light.image_from_receiver, vload3(i, normals)) : (float3)(0.0f);
    float3 centre = of3(light.centre), half_u = of3(light.half_u), half_v = of3(light.half_v);
    if (!light.endless) centre -= point;
    if (light.sphere && dot(half_u, half_u) > 0.0f) face_receiver(centre, &half_u, &half_v);
    const ulong key = sample_key(light, (ulong)i);

    // Where the lines start.
    const float spread = view.orthographic ? 1.0f : point.z;
    const int before = view.orthographic || point.z >= 0.5f / view.nearest;
    const float x = point.x / spread / view.pixel_x + view.middle_x, y = view.middle_y - point.y / spread / view.pixel_y;
    const int inside = before && x >= 0.0f && y >= 0.0f && x < (float)view.width && y < (float)view.height;
    const float own = light.own;

    Lines lines[GROUPS];
    float slowest_x = 0.0f, slowest_y = 0.0f;
    if (inside) {
        bundle_lines(view, light, point, normal, centre, half_u, half_v, key, strata, step, first, lines);
        if (!all_blocked(lines, GROUPS)) {
            const float way_x = common_way(lines, 0, &slowest_x), way_y = common_way(lines, 1, &slowest_y);
            const int major = slowest_y > slowest_x;
            if (slowest_x > 0.0f || slowest_y > 0.0f) {
                // All together to the first pixel that any may meet; from there on the few that stay closest.
                const float value = depth_value(view, point.z), sign = major ? way_y : way_x;
                const int from = clamp((int)floor(major ? y : x), 0, (major ? view.height : view.width) - 1);
                const int met = walk_bundle(view, pixels, nearest, x, y, value, own, major, sign, from, 1, GROUPS, lines);
                for (int g = 0; g < GROUPS && met >= 0; g += CLOSE_GROUPS)
                    if (!all_blocked(lines + g, CLOSE_GROUPS))
                        walk_bundle(view, pixels, nearest, x, y, value, own, major, sign, met, 0, CLOSE_GROUPS, lines + g);
            }
        }
    }
    const int together = inside && (slowest_x > 0.0f || slowest_y > 0.0f || all_blocked(lines, GROUPS));
    for (int word = 0; word < BUNDLE / 32 && first + 32 * word < light.samples; ++word) {
        const int at = (first / 32 + word) * light.count + item;
        uint bits = blocked[at];
        if (together) {
            for (int g = word * GROUPS / 2; g < (word + 1) * GROUPS / 2; ++g) {
                int lanes[LANES];
                store_int_lanes(lines[g].blocked, lanes);
                for (int lane = 0; lane < LANES; ++lane) bits |= lanes[lane] != 0 ? 1U << ((g * LANES + lane) & 31) : 0U;
            }
            if (first + 32 * word + 32 > light.samples) bits &= (1U << (light.samples & 31)) - 1U;
        } else {
            // One by one: lines that start elsewhere, or that go every way.
            for (int k = first + 32 * word; k < min(first + 32 * word + 32, light.samples); ++k) {
                float2 sample = jittered(strata[k], step, key, k);
                if (light.disc) sample = square_to_disc(sample);
                const float3 way = centre + sample.x * half_u + sample.y * half_v;
                const int below = light.has_normals && dot(way, normal) <= 0.0f;
                const DepthVector start = {point.x, point.y, point.z}, direction = {way.x, way.y, way.z};
                if (below || depth_walk(view, pixels, nearest, DEPTH_LEVELS, depth_line(view, start, direction, light.endless, own), 0, 0).blocked)
                    bits |= 1U << (k & 31);
            }
        }
        blocked[at] = bits;
    }
}

// depth_count: visibility, and with `bounds` the lowest and the highest that it can be. 1 where no receiver is.
//
// Launched over count receivers.
__kernel void depth_count(const int first, const int count, const int samples, const int bounds, __global const float* restrict points,
                          __global const uint* restrict blocked, __global const uint* restrict crossed, __global const uint* restrict unknown,
                          __global float* restrict visibility, __global float* restrict low, __global float* restrict high)
{
    const int item = get_global_id(0);
    if (item >= count) return;
    uint not_seen = 0, sure = 0, maybe = 0;
    for (int word = 0; word < (samples + 31) / 32; ++word) {
        const int at = word * count + item;
        not_seen += popcount(blocked[at]);
        if (!bounds) continue;
        sure += popcount(crossed[at]);
        maybe += popcount(crossed[at] | unknown[at]);
    }
    const int there = points[3 * (first + item) + 2] > 0.0f;
    visibility[first + item] = there ? 1.0f - (float)not_seen / (float)samples : 1.0f;
    if (!bounds) return;
    low[first + item] = there ? 1.0f - (float)maybe / (float)samples : 1.0f;
    high[first + item] = there ? 1.0f - (float)sure / (float)samples : 1.0f;
}

// depth_view: what a camera sees of a depth image: each pixel's first surface and where that body ends.
//
//   front, back [height][width]  planar depth from the camera; +infinity where nothing is. Merged with what is there: the nearer front, the
//                                further back
//
// Launched over width x height.
__kernel void depth_view(const DepthView view, const DepthSight sight, __global const DepthPixel* restrict pixels, __global const float* restrict nearest,
                         __global float* restrict front, __global float* restrict back)
{
    const int x = get_global_id(0), y = get_global_id(1);
    if (x >= sight.width || y >= sight.height) return;
    const float tx = (2 * x + 1 - sight.width) * 0.5f * sight.pixel_x, ty = (sight.height - 2 * y - 1) * 0.5f * sight.pixel_y;
    const float3 eye = sight.orthographic ? (float3)(tx, ty, 0.0f) : (float3)(0.0f);
    const float3 way = sight.orthographic ? (float3)(0.0f, 0.0f, 1.0f) : (float3)(tx, ty, 1.0f);
    const float3 point = moved(sight.image_from_camera, eye), direction = turned(sight.image_from_camera, way);
    const DepthVector start = {point.x, point.y, point.z}, along = {direction.x, direction.y, direction.z};
    const DepthLine line = depth_line(view, start, along, 1, 0.0f);
    const DepthMet met = depth_walk(view, pixels, nearest, DEPTH_LEVELS, line, 0, 1);
    if (!met.blocked) return;

    // What was passed over before the image's nearest surface counts, too.
    const float skipped = view.orthographic ? 0.0f : fmax((line.start_z - point.z) / direction.z, 0.0f);
    const float passed = line.start_z == point.z ? 0.0f : skipped;
    const float enter = passed + depth_along(view, line, met.enter), leave = passed + depth_along(view, line, met.leave);
    const int at = y * sight.width + x;
    if (enter > 0.0f && enter < front[at]) front[at] = enter;
    if (leave > 0.0f && leave < 1e30f && !(back[at] < INFINITY && back[at] >= leave)) back[at] = leave;
}
