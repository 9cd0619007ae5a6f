// What occlusion_texture computes, slowly and in double precision: from the slices' bits to visibility, and from triangles to bits. Places
// are had by drawing lines from the light's corners through the receiver, not by the formulas of the kernels.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <penumbra/technique.hpp>

#include "common/shared.h"

namespace penumbra::oracle::slices {

constexpr double e = 0x1p-24; // what a binary32 operation rounds by, relative

struct Value {
    double value, bound; // bound: what binary32 may be off by
};

// Bit k of a texel: slice k holds something there. Row 0 lies at low_y.
using Bits = std::vector<std::uint64_t>;

// One texture of occlusion as counts of filled texels below and to the left of each border.
class Texture {
public:
    template <class Filled> Texture(int side, const Filled& filled) : side_(side)
    {
        const auto width = static_cast<std::size_t>(side + 1);
        counts_.resize(width * width);
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const auto at = static_cast<std::size_t>(y + 1) * width + static_cast<std::size_t>(x + 1);
                counts_[at] = counts_[at - 1] + counts_[at - width] - counts_[at - width - 1] + (filled(x, y) ? 1.0 : 0.0);
            }
    }
    int side() const { return side_; }

    // Filled area of a rectangle, in texels; nothing is filled outside.
    double area(double x0, double x1, double y0, double y1) const { return below(x1, y1) - below(x0, y1) - below(x1, y0) + below(x0, y0); }

private:
    double count(int x, int y) const
    {
        return counts_[static_cast<std::size_t>(y) * static_cast<std::size_t>(side_ + 1) + static_cast<std::size_t>(x)];
    }
    double below(double x, double y) const
    {
        x = std::clamp(x, 0.0, static_cast<double>(side_));
        y = std::clamp(y, 0.0, static_cast<double>(side_));
        const int ix = std::min(static_cast<int>(x), side_ - 1), iy = std::min(static_cast<int>(y), side_ - 1);
        const double fx = x - ix, fy = y - iy;
        return (1 - fy) * ((1 - fx) * count(ix, iy) + fx * count(ix + 1, iy)) +
               fy * ((1 - fx) * count(ix, iy + 1) + fx * count(ix + 1, iy + 1));
    }
    int side_;
    std::vector<double> counts_;
};

enum class Levels { nbuffer, mipmap, table, smooth };

inline std::vector<double> smooth_weights(int level)
{
    std::vector<double> all{1};
    for (int l = 0; l < level; ++l) {
        const std::size_t apart = std::size_t{1} << l;
        std::vector<double> next(all.size() + 4 * apart);
        constexpr double weights[5] = {0.0625, 0.25, 0.375, 0.25, 0.0625};
        for (std::size_t i = 0; i < all.size(); ++i)
            for (std::size_t tap = 0; tap < 5; ++tap) next[i + tap * apart] += weights[tap] * all[i];
        all = std::move(next);
    }
    return all;
}

// A level's value at a whole place (3.2). N-buffers: the mean of 2^l x 2^l texels around the border `x` (level 0: of texel x). Mip-maps: of
// the x-th square of as many. Smooth: taps of (1, 4, 6, 4, 1) / 16, again and again, twice as far apart each time.
inline double level_value(const Texture& texture, Levels kind, int level, int x, int y)
{
    const double size = std::ldexp(1, level), half = size / 2;
    if (level == 0) return texture.area(x, x + 1, y, y + 1);
    if (kind == Levels::nbuffer) return texture.area(x - half, x + half, y - half, y + half) / (size * size);
    if (kind == Levels::mipmap) return texture.area(x * size, (x + 1) * size, y * size, (y + 1) * size) / (size * size);
    // All taps together are one row of weights, along each axis.
    const std::vector<double> weights = smooth_weights(level);
    const int reach = static_cast<int>(weights.size()) / 2;
    double sum = 0;
    for (int j = std::max(y - reach, 0); j <= std::min(y + reach, texture.side() - 1); ++j)
        for (int i = std::max(x - reach, 0); i <= std::min(x + reach, texture.side() - 1); ++i)
            sum += weights[static_cast<std::size_t>(i - x + reach)] * weights[static_cast<std::size_t>(j - y + reach)] *
                   texture.area(i, i + 1, j, j + 1);
    return sum;
}

// Bilinear around a place in texels.
inline double level_at(const Texture& texture, Levels kind, int level, double x, double y)
{
    const double scale = kind == Levels::mipmap ? std::ldexp(1, -level) : 1, shift = kind == Levels::nbuffer && level > 0 ? 0 : 0.5;
    x = x * scale - shift;
    y = y * scale - shift;
    const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
    const double fx = x - ix, fy = y - iy;
    return (1 - fy) * ((1 - fx) * level_value(texture, kind, level, ix, iy) + fx * level_value(texture, kind, level, ix + 1, iy)) +
           fy * ((1 - fx) * level_value(texture, kind, level, ix, iy + 1) + fx * level_value(texture, kind, level, ix + 1, iy + 1));
}

// The mean over a square (smooth: a disc, by its variance) from levels 0 to count - 1.
inline double mean(const Texture& texture, Levels kind, int count, double x, double y, double size)
{
    const double highest = std::ldexp(1, count - 1), middle = 0.5 * texture.side();
    double thinner = 1;
    if (kind != Levels::smooth && size > highest) {
        // Of a square larger than the highest level's, which holds all there is: the part that lies inside, thinned.
        const auto moved = [&](double at) {
            return middle + std::copysign(std::max(std::abs(at - middle) - 0.5 * (size - highest), 0.0), at - middle);
        };
        x = moved(x);
        y = moved(y);
        thinner = highest / size;
    }
    const double place = kind == Levels::smooth ? 0.5 * std::log2(1 + 3.0 / 16 * size * size) : std::log2(std::max(size, 1.0));
    const double level = std::min(place, count - 1.0);
    const int lower = static_cast<int>(level), upper = std::min(lower + 1, count - 1);
    const double part = level - lower;
    return ((1 - part) * level_at(texture, kind, lower, x, y) + part * level_at(texture, kind, upper, x, y)) * thinner * thinner;
}

// What a mask depends on: the window and the planes between the slices, what they hold, and the light's part.
struct Scene {
    SliceView view{};
    std::vector<float> depths;
    Bits bits;
    OcclusionTexture settings;
    double centre_x = 0, centre_y = 0, half_u = 0, half_v = 0;
};

inline Levels levels_of(const Scene& s)
{
    if (s.settings.prefilter == Prefilter::summed_area) return Levels::table;
    if (s.settings.prefilter == Prefilter::mipmap) return Levels::mipmap;
    return s.view.orthographic ? Levels::smooth : Levels::nbuffer;
}

inline bool layered(const Scene& s) { return s.settings.combine == Combine::layered || s.settings.combine == Combine::layered_max; }

inline Texture texture_of(const Scene& s, int slice, int layer)
{
    return Texture(s.view.width, [&](int x, int y) {
        const std::uint64_t bits =
            s.bits[static_cast<std::size_t>(y) * static_cast<std::size_t>(s.view.width) + static_cast<std::size_t>(x)];
        const std::uint64_t all = s.settings.leak_fix ? bits | bits << 1 : bits;
        if (!(all >> slice & 1)) return false;
        if (!layered(s)) return true;
        const int before = std::popcount(all & ((std::uint64_t{1} << slice) - 1));
        return std::min(before, s.settings.layers - 1) == layer;
    });
}

// Where the lines from the light's borders through (x, z) meet depth `far`, in texels along one axis.
inline std::array<double, 2> span_of(const Scene& s, double far, double centre, double half, double low, double per, double x, double z)
{
    std::array<double, 2> span{};
    for (int i = 0; i < 2; ++i) {
        const double border = i == 0 ? -half : half;
        if (s.view.orthographic) {
            span[static_cast<std::size_t>(i)] = (x + border * (z - far) - low) * per;
        } else {
            const double light = centre + border, there = light + (x - light) * far / z;
            span[static_cast<std::size_t>(i)] = ((there - centre) / (far + static_cast<double>(s.view.behind)) - low) * per;
        }
    }
    return {std::min(span[0], span[1]), std::max(span[0], span[1])};
}

// The largest kernel of a slice: of a receiver infinitely far.
inline std::array<double, 2> largest(const Scene& s, std::size_t k)
{
    const double far = s.depths[k + 1], per = s.view.orthographic ? 1 : 1 / (far + static_cast<double>(s.view.behind));
    return {2 * s.half_u * per * s.view.per_x, 2 * s.half_v * per * s.view.per_y};
}

inline std::array<int, 2> taps_of(const Scene& s)
{
    double x = 1, y = 1;
    for (std::size_t k = 0; k + 1 < s.depths.size(); ++k) {
        x = std::max(x, largest(s, k)[0]);
        y = std::max(y, largest(s, k)[1]);
    }
    const auto taps = [](double ratio) { return static_cast<int>(std::clamp(std::ceil(ratio * (1 - 0x1p-20)), 1.0, 16.0)); };
    return {taps(x / y), taps(y / x)};
}

// How much a texture hides from a receiver, and what binary32 may be off by. Places are six roundings of numbers up to `reach` texels; a
// mean changes by at most 2 / size a texel along each axis (1/16 of a texel is the least size of a table's, a texel that of levels), and by
// at most 1 a level, of which a relative change of size makes 1.5. Eight roundings on the way from a level to the mean.
inline Value hidden(const Scene& s, std::size_t k, const Texture& texture, double x, double y, double z)
{
    const double far = s.depths[k + 1];
    const auto sx = span_of(s, far, s.centre_x, s.half_u, s.view.low_x, s.view.per_x, x, z);
    const auto sy = span_of(s, far, s.centre_y, s.half_v, s.view.low_y, s.view.per_y, y, z);
    const double reach = std::max({std::abs(sx[0]), std::abs(sx[1]), std::abs(sy[0]), std::abs(sy[1])}) +
                         2 * std::max(std::abs(s.view.low_x * s.view.per_x), std::abs(s.view.low_y * s.view.per_y));
    const Levels kind = levels_of(s);
    const double mx = 0.5 * (sx[0] + sx[1]), my = 0.5 * (sy[0] + sy[1]);
    if (kind == Levels::table) {
        const double there = z > far ? 1 : 0, hx = std::max(0.5 * there * (sx[1] - sx[0]), 1.0 / 32),
                     hy = std::max(0.5 * there * (sy[1] - sy[0]), 1.0 / 32);
        const double area = texture.area(mx - hx, mx + hx, my - hy, my + hy);
        // Whole texels, and those at either end, are numbers up to the texels that the kernel meets: 8 roundings of that over its area.
        const double meets = (2 * hx + 2) * (2 * hy + 2) / (4 * hx * hy);
        return {area / (4 * hx * hy), 6 * e * reach * (1 / hx + 1 / hy) + 8 * e * meets};
    }
    const auto taps = taps_of(s);
    // A receiver before the slice's far plane (self shadow own) sees a point of it.
    const double there = z > far ? 1 : 0, step_x = there * (sx[1] - sx[0]) / taps[0], step_y = there * (sy[1] - sy[0]) / taps[1],
                 size = std::max(step_x, step_y);
    const auto [most_x, most_y] = largest(s, k);
    const double most = s.view.orthographic && (s.half_u > 0 || s.half_v > 0) ? 1e30 : std::max(most_x / taps[0], most_y / taps[1]);
    const auto highest = [](double texels) { return static_cast<int>(std::ceil(std::log2(std::max(texels, 1.0)))); };
    const int count = std::min(highest(most), highest(texture.side())) + 1;
    double sum = 0;
    for (int j = 0; j < taps[1]; ++j)
        for (int i = 0; i < taps[0]; ++i)
            sum += mean(texture, kind, count, mx + step_x * (i - 0.5 * (taps[0] - 1)), my + step_y * (j - 0.5 * (taps[1] - 1)), size);
    const double rise = s.view.orthographic ? (z - far) / z : 1 - far / z;
    const double stored = s.settings.storage == LevelStorage::normalized16 ? 0.5 / 65535 * (count - 1) : 0;
    return {sum / (taps[0] * taps[1]), 6 * e * reach * 4 / std::max(size, 1.0) + 1.5 * 4 * e * (size > 1 ? std::max(1 / rise, 1.0) : 0) +
                                           8 * e + 3 * e * count + stored};
}

// How much a slice counts (3.4.2), for a receiver at depth z.
inline Value weight(const Scene& s, std::size_t k, double z)
{
    const double near = s.depths[k], far = s.depths[k + 1];
    const double beyond = far + 0x1p-20 * std::abs(far);
    const auto ramp = [&](double from, double to) -> Value {
        if (!(to > from)) return {z > from ? 1.0 : 0.0, 0};
        const double at = (z - from) / (to - from);
        return {std::clamp(at, 0.0, 1.0), at < -0x1p-10 || at > 1 + 0x1p-10 ? 0 : 4 * e * (z / (to - from) + 1)};
    };
    if (s.settings.self_shadow == SelfShadow::own) return ramp(near, far); // automatic: receivers may cast in these scenes, so fade
    const bool last = k + 2 == s.depths.size();
    return last || s.settings.self_shadow == SelfShadow::omit ? ramp(beyond, beyond) : ramp(beyond, static_cast<double>(s.depths[k + 2]));
}

// [slice][layer]
inline std::vector<std::vector<Texture>> textures_of(const Scene& s)
{
    std::vector<std::vector<Texture>> textures(s.depths.size() - 1);
    for (std::size_t k = 0; k < textures.size(); ++k)
        for (int layer = 0; layer < (layered(s) ? s.settings.layers : 1); ++layer)
            textures[k].push_back(texture_of(s, static_cast<int>(k), layer));
    return textures;
}

// Visibility at a place of light space (Eq. 5, or one of the other ways to combine).
inline Value visibility(const Scene& s, const std::vector<std::vector<Texture>>& textures, double x, double y, double z)
{
    const int layers = layered(s) ? s.settings.layers : 1;
    double product = 1, sum = 0, greatest = 0, bound = 2 * e;
    std::vector<double> of_layer(static_cast<std::size_t>(layers));
    for (std::size_t k = 0; k + 1 < s.depths.size(); ++k) {
        const Value counts = weight(s, k, z);
        if (counts.value == 0 && counts.bound == 0) continue;
        for (int layer = 0; layer < layers; ++layer) {
            const Value one = hidden(s, k, textures[k][static_cast<std::size_t>(layer)], x, y, z);
            const double by = counts.value * one.value;
            if (one.value > 0) bound += counts.value * one.bound + one.value * counts.bound + 3 * e;
            product *= 1 - by;
            sum += by;
            greatest = std::max(greatest, by);
            of_layer[static_cast<std::size_t>(layer)] += by;
        }
    }
    double lit = product;
    if (s.settings.combine == Combine::sum) lit = 1 - std::min(sum, 1.0);
    if (s.settings.combine == Combine::max) lit = 1 - std::min(greatest, 1.0);
    if (layered(s)) {
        lit = 1;
        for (const double by : of_layer)
            lit = s.settings.combine == Combine::layered ? lit * (1 - std::min(by, 1.0)) : std::min(lit, 1 - std::min(by, 1.0));
    }
    return {std::clamp(lit, 0.0, 1.0), bound};
}

// --- From triangles to bits ------------------

struct Triangle {
    std::array<std::array<double, 3>, 3> corner; // light space
};

// Which slices a texel's line marks for sure, and which it may.
struct Marks {
    std::uint64_t surely = 0, maybe = 0;
};

// The device sees corners from the line, a difference of products: four roundings of numbers up to `reach`. What lies nearer than that to
// the line may fall on either side of it. A depth is off by as much as that moves it over the triangle.
inline void mark(Marks& marks, const SliceView& view, const std::vector<float>& depths, const Triangle& triangle, int texel_x, int texel_y)
{
    const double tx = view.low_x + (texel_x + 0.5) / view.per_x, ty = view.low_y + (texel_y + 0.5) / view.per_y;
    std::array<std::array<double, 2>, 3> p{};
    double reach = 0, from = 1e300, to = -1e300;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto& c = triangle.corner[i];
        const double away = view.orthographic ? 1 : c[2] + static_cast<double>(view.behind);
        p[i] = {c[0] - view.centre_x - tx * away, c[1] - view.centre_y - ty * away};
        const double out = std::max(std::abs(tx), std::abs(ty)) * std::abs(away);
        reach = std::max({reach, std::abs(c[0]) + std::abs(view.centre_x) + out, std::abs(c[1]) + std::abs(view.centre_y) + out});
        from = std::min(from, c[2]);
        to = std::max(to, c[2]);
    }
    const double slack = 8 * e * reach; // and as much again for the line's own direction
    const auto cross = [](const std::array<double, 2>& a, const std::array<double, 2>& b) { return a[0] * b[1] - a[1] * b[0]; };
    std::array<double, 3> side{};
    double sum = 0, longest = 0, surely_in = 1e300, surely_out = -1e300;
    for (std::size_t i = 0; i < 3; ++i) sum += side[i] = cross(p[(i + 1) % 3], p[(i + 2) % 3]);
    for (std::size_t i = 0; i < 3; ++i) {
        const auto &a = p[(i + 1) % 3], &b = p[(i + 2) % 3];
        const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
        longest = std::max(longest, length);
        const double inward = (sum > 0 ? side[i] : -side[i]) / std::max(length, 1e-300);
        surely_in = std::min(surely_in, inward);
        surely_out = std::max(surely_out, -inward);
    }
    if (surely_out > slack || longest == 0) return;
    const bool sure = surely_in > slack;
    double z =
        sum == 0 ? from : (side[0] * triangle.corner[0][2] + side[1] * triangle.corner[1][2] + side[2] * triangle.corner[2][2]) / sum;
    z = std::clamp(z, from, to);
    const double height = std::abs(sum) / longest, off = 4 * e * (std::abs(z) + static_cast<double>(view.behind)) +
                                                         (height > 0 ? std::min(1.0, 4 * slack / height) : 1) * (to - from);
    for (int k = 0; k < view.slices; ++k) {
        const bool last = k + 1 == view.slices;
        const double near = depths[static_cast<std::size_t>(k)], far = depths[static_cast<std::size_t>(k) + 1];
        // What the device lets the ends of the range be off by: for sure, and at most.
        const double ends = 0x1p-21 * (std::abs(z) + static_cast<double>(view.behind));
        if (z + off + (k == 0 ? 2 * ends : 0) < near || z - off - (last ? 2 * ends : 0) > far) continue;
        marks.maybe |= std::uint64_t{1} << k;
        const bool beyond_near = k == 0 ? z - off >= near - ends : z - off >= near,
                   before_far = last ? z + off <= far + ends : z + off < far;
        if (sure && beyond_near && before_far) marks.surely |= std::uint64_t{1} << k;
    }
}

} // namespace penumbra::oracle::slices
