// Soft Shadow Maps in double precision, as the paper says it (3.4, 3.5): every texel against every receiver, no culling, shares summed,
// maps merged by the larger occlusion. Each value comes with a bound on how far a binary32 implementation may be from it.
//
// The bound, per pair. With K = k / (d - d_p) a patch of width h has an edge at u = 1/2 + (a - xi) K on the light. Every operation of the
// kernel rounds by at most e = 2^-24 relative, and it may take one edge from the other, h K away:
//     K            k, d - d_p, the division, the product with k                                         4 e (|a - xi| + h) K
//     a - xi       one rounding, and the edge i * texel - 1 itself, off by                              e (|a - xi| + h) K
//                  2 e (texel) + e (product) + e / 2 (difference) = 7/2 e, where the map's sides
//                  are powers of two by nothing                                                         7/2 e K
//     sums         half a unit in the last place of u, which for what saturation keeps is at most       e max(1, |u| + h K) / 2
// U = sat(u1) - sat(u0) is evaluated as an interval from that, and rounds once (e / 2, as U <= 1); the share U V c rounds twice.
// Back-projected texels no wider than the light in a map with sides of powers of two: less than 2^-19 a share.
//
// The bound of the sum. Shares are positive, so partial sums grow. Recursive binary32: the i-th addition rounds by half a unit in the last
// place of the i-th partial sum, e S_i. Compensated (Kahan; Higham, Accuracy and Stability, 4.3): (2 e + O(n e^2)) S.
//
// A texel within rounding of a receiver's limit may count or not: its whole share goes into the bound.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace penumbra::oracle {

constexpr double e = 0x1p-24;

struct Interval {
    double low = 0, high = 0;
};

// `step_x` and `step_y`: how much the surface's disparity changes to the next texel (slope_steps, which has a test of its own).
struct Texel {
    double disparity = 0, covered = 0, step_x = 0, step_y = 0;
};

struct Map {
    int width = 0, height = 0;
    std::vector<Texel> texels;

    Texel at(int x, int y) const
    {
        if (x < 0 || y < 0 || x >= width || y >= height) return {};
        return texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
    }
    // Edge i of the map in xi; in eta with the sign turned.
    double edge_x(int i) const { return 2.0 * i / width - 1; }
    double edge_y(int j) const { return 1 - 2.0 * j / height; }
    double edge_error() const
    {
        const auto power_of_two = [](int n) { return (n & (n - 1)) == 0; };
        return power_of_two(width) && power_of_two(height) ? 0 : 3.5 * e;
    }
};

struct Receiver {
    double xi = 0, eta = 0, d = 0;
};

enum class Sum { binary32, compensated };

struct Settings {
    double kx = 1, ky = 1;      // light extent tangents over the light's full width and height
    double bias = 1;            // as in SoftShadowMap
    double precision = 0x1p-24; // of the depths, relative
    Sum sum = Sum::binary32;
    // How far the receivers and texels that the implementation saw may be from these: 0 when they are the same numbers.
    double place_error = 0;     // of xi and eta
    double disparity_error = 0; // relative, of every disparity
};

struct Bounded {
    double value = 0, bound = 0;
};

// Where an edge at `distance` from the receiver falls on the light, scaled to [0, 1] and saturated, with what rounding may do to it.
inline Interval edge_on_light(double distance, double width, double K, double K_error, double place_error)
{
    const double u = 0.5 + distance * K, reach = (std::abs(distance) + width) * K;
    const double off = reach * (5 * e + K_error) + place_error * K + 0.5 * e * std::max(1.0, std::abs(u) + width * K);
    return {std::clamp(u - off, 0.0, 1.0), std::clamp(u + off, 0.0, 1.0)};
}

inline double saturate(double x) { return std::clamp(x, 0.0, 1.0); }

// What a patch hides of the light on one axis.
struct Overlap {
    double value;
    Interval interval;
};
inline Overlap overlap(double low, double high, double place, double k, const Receiver& p, double d, double edge_error, const Settings& s)
{
    const double K = k / (d - p.d);
    const double K_error = s.disparity_error * (d + p.d) / (d - p.d);
    const double place_error = edge_error + s.place_error;
    const Interval to = edge_on_light(high - place, high - low, K, K_error, place_error);
    const Interval from = edge_on_light(low - place, high - low, K, K_error, place_error);
    const double value = saturate(0.5 + (high - place) * K) - saturate(0.5 + (low - place) * K);
    return {value, {std::max(0.0, to.low - from.high - e / 2), to.high - from.low + (to.high > from.low ? e / 2 : 0)}};
}

// What the stairs of a texel's surface reach, as the kernel's limits_of has it.
inline double slope_of(const Map& map, const Texel& texel, const Settings& s)
{
    const double bracket = 1 - 0.5 * (texel.step_x / (s.kx * 2 / map.width) + texel.step_y / (s.ky * 2 / map.height));
    return s.bias * 0.5 * (texel.step_x + texel.step_y) / std::max(bracket, 0.25);
}

// What the surface that a receiver lies on may reach (the kernel's own_steps), seen from a place on the map: that of its own texel where that
// explains it, else that of the neighbour that comes nearest to it, else 0. All that rounding leaves possible goes into the interval.
inline void add_reach(Interval& reach, const Map& map, const Receiver& p, const Settings& s, double column, double row, double off)
{
    const double rounding = (8 * e + 2 * s.precision) * p.d;
    const auto add = [&](double slope) { reach = {std::min(reach.low, slope), std::max(reach.high, slope)}; };
    // -1: does not explain the receiver; 1: does; 0: too close to tell.
    const auto explains = [&](const Texel& t, int x, int y, double apart_x, double apart_y) {
        if (!(t.disparity > 0) || x < 0 || y < 0 || x >= map.width || y >= map.height) return -1;
        const double beyond = std::abs(t.disparity - p.d) - ((apart_x + 0.5) * t.step_x + (apart_y + 0.5) * t.step_y + rounding);
        const double unsure = (8 * e + s.disparity_error) * (t.disparity + p.d) + (off + 8 * e * map.width) * t.step_x + (off + 8 * e * map.height) * t.step_y;
        return beyond > unsure ? -1 : beyond < -unsure ? 1 : 0;
    };
    const int cx = static_cast<int>(std::floor(column)), cy = static_cast<int>(std::floor(row));
    const Texel own = map.at(cx, cy);
    const int by_own = explains(own, cx, cy, 0.5, 0.5);
    if (by_own >= 0) add(slope_of(map, own, s));
    if (by_own == 1) return;

    double least = 1e300; // of the neighbours that surely do
    for (int y = cy - 1; y <= cy + 1; ++y)
        for (int x = cx - 1; x <= cx + 1; ++x)
            if (const Texel t = map.at(x, y); explains(t, x, y, std::abs(column - x - 0.5), std::abs(row - y - 0.5)) == 1)
                least = std::min(least, std::abs(t.disparity - p.d));
    if (least == 1e300) add(0);
    for (int y = cy - 1; y <= cy + 1; ++y)
        for (int x = cx - 1; x <= cx + 1; ++x) {
            const Texel t = map.at(x, y);
            const double unsure = (8 * e + 2 * s.disparity_error) * (t.disparity + p.d);
            if (explains(t, x, y, std::abs(column - x - 0.5), std::abs(row - y - 0.5)) >= 0 && std::abs(t.disparity - p.d) <= least + unsure)
                add(slope_of(map, t, s));
        }
}

// The disparity above which a texel counts (the kernel's limits_of): the receiver's own, plus rounding, plus what the stairs of its own surface
// reach. An interval, because the receiver's texel is uncertain within rounding of its border.
inline Interval limit_of(const Map& map, const Receiver& p, const Settings& s)
{
    const double rounding = (8 * e + 2 * s.precision) * p.d;
    const double column = (p.xi + 1) / 2 * map.width, row = (1 - p.eta) / 2 * map.height;
    const double near_border = 4 * e * (std::max(map.width, map.height) + 1) + s.place_error * std::max(map.width, map.height);
    Interval reach{1e300, 0};
    for (const double dx : {-near_border, near_border})
        for (const double dy : {-near_border, near_border}) add_reach(reach, map, p, s, column + dx, row + dy, 2 * near_border);
    const double unsure = (8 * e + s.disparity_error) * (p.d + reach.high);
    return {p.d + rounding + reach.low - unsure, p.d + rounding + reach.high + unsure};
}

// The share of the light that one map hides from a receiver; above 1 where patches overlap.
inline Bounded occlusion(const Map& map, const Receiver& p, const Settings& s)
{
    const Interval limit = limit_of(map, p, s);
    double sum = 0, low = 0, high = 0, rounding = 0, additions = 0;
    for (int j = 0; j < map.height; ++j)
        for (int i = 0; i < map.width; ++i) {
            const Texel texel = map.at(i, j);
            if (!(texel.disparity > limit.low) || !(texel.disparity > p.d)) continue;
            const Overlap u = overlap(map.edge_x(i), map.edge_x(i + 1), p.xi, s.kx, p, texel.disparity, map.edge_error(), s);
            const Overlap v = overlap(map.edge_y(j + 1), map.edge_y(j), p.eta, s.ky, p, texel.disparity, map.edge_error(), s);
            if (u.interval.high * v.interval.high == 0) continue;
            const bool certain = texel.disparity > limit.high;
            sum += certain ? u.value * v.value * texel.covered : 0;
            low += certain ? u.interval.low * v.interval.low * texel.covered * (1 - 2 * e) : 0;
            high += u.interval.high * v.interval.high * texel.covered * (1 + 2 * e);
            rounding += e * high;
            ++additions;
        }
    if (s.sum == Sum::compensated) rounding = (2 * e + additions * 8 * e * e) * high;
    return {sum, std::max(sum - low, high - sum) + rounding};
}

// Visibility past several maps of the same light: 1 - the larger occlusion (3.5), which rounds once.
inline Bounded visibility(const std::vector<Map>& maps, const Receiver& p, const Settings& s)
{
    Bounded darkest;
    for (const Map& map : maps) {
        const Bounded o = occlusion(map, p, s);
        darkest = {std::max(darkest.value, std::min(o.value, 1.0)), std::max(darkest.bound, o.bound)};
    }
    return {1 - darkest.value, darkest.bound + e / 2};
}

} // namespace penumbra::oracle
