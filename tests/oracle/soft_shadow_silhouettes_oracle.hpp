// Double-precision twin of soft_shadow_silhouettes: a segment to each of the light's 32 x 32 samples against every triangle.
//
// `range`: samples that are hidden from everywhere close by, and from anywhere: what binary32 may decide either way.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra::oracle::silhouettes {

using Triangle = std::array<Vec3, 3>; // light space: the light is [-half.x, half.x] x [-half.y, half.y] at z = 0

// Whether the triangle lies between p and s.
inline bool between(const Triangle& t, const Vec3& p, const Vec3& s)
{
    const auto volume = [](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) { return (b - a).dot((c - a).cross(d - a)); };
    const double from = volume(t[0], t[1], t[2], p), to = volume(t[0], t[1], t[2], s);
    if ((from > 0) == (to > 0)) return false;
    const double a = volume(p, s, t[0], t[1]), b = volume(p, s, t[1], t[2]), c = volume(p, s, t[2], t[0]);
    return (a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0);
}

inline double reversed(int k)
{
    int r = 0;
    for (int bit = 0; bit < 5; ++bit) r |= (k >> bit & 1) << (4 - bit);
    return r;
}

// A linear map of a number's bits, and 21.
inline double mapped(int i)
{
    constexpr int rows[5] = {5, 19, 3, 15, 11};
    int m = 21;
    for (int bit = 0; bit < 5; ++bit) m ^= (std::popcount(static_cast<unsigned>(rows[bit] & i)) & 1) << bit;
    return m;
}

// Calls f(u, v) for the samples' places, 0 to 1.
template <class F> void for_each_sample(F&& f)
{
    for (int k = 0; k < 32; ++k)
        for (int i = 0; i < 32; ++i)
            f((i + (reversed(k) + 0.5) / 32) / 32, (k + (mapped(i) + 0.5) / 32) / 32);
}

inline bool blocked(const std::vector<Triangle>& triangles, const Vec3& p, const Vec2& half, double u, double v)
{
    const Vec3 s((2 * u - 1) * half.x, (2 * v - 1) * half.y, 0);
    return std::ranges::any_of(triangles, [&](const Triangle& t) { return between(t, p, s); });
}

// The share of the samples that is hidden.
inline double hidden(const std::vector<Triangle>& triangles, const Vec3& p, const Vec2& half)
{
    int count = 0;
    for_each_sample([&](double u, double v) { count += blocked(triangles, p, half, u, v); });
    return count / 1024.0;
}

struct Range {
    double least, most;
};
inline Range range(const std::vector<Triangle>& triangles, const Vec3& p, const Vec2& half)
{
    int all = 0, any = 0;
    for_each_sample([&](double u, double v) {
        constexpr double close = 1e-4; // of the light
        int hits = 0;
        for (const double x : {-close, close})
            for (const double y : {-close, close}) hits += blocked(triangles, p, half, u + x, v + y);
        all += hits == 4;
        any += hits > 0;
    });
    return {all / 1024.0, any / 1024.0};
}

} // namespace penumbra::oracle::silhouettes
