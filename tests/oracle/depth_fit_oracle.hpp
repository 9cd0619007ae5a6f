// Planes of depth images in double precision: weighted least squares in each pixel's window, then creases, as depth_fit.cl's contract says.
//
// Float32 and double decide alike unless a pixel lies very near a limit. The oracle carries a bound of float32's error along, marks pixels
// where a decision was closer than that (`sure` = false), and gives the bound for the others.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace penumbra::oracle::depth_fit {

struct Image {
    int width, height;
    std::vector<double> value, sigma; // 0: nothing there
    double at(int x, int y) const
    {
        if (x < 0 || y < 0 || x >= width || y >= height) return 0;
        return value[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
    }
};

struct PixelPlane {
    double value = 0, slope_x = 0, slope_y = 0, residual = 0, count = 1;
    double value_error = 0, slope_error = 0, square_error = 0; // of float32; of the residual's square
    bool sure = true;
};

constexpr double u = 0x1p-24;

inline double loose(double value, double sigma, double sx, double sy)
{
    return 4 * sigma + .8 * (std::abs(sx) + std::abs(sy)) + 3e-7 * value;
}

inline double smaller_step(double before, double here, double after)
{
    const double a = after > 0 ? after - here : HUGE_VAL, b = before > 0 ? here - before : HUGE_VAL;
    const double least = std::abs(a) < std::abs(b) ? a : b;
    return std::isfinite(least) ? least : 0;
}

// The sums of one pass; `s` sums of sizes, for the bound.
struct Sums {
    double w = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, v = 0, vx = 0, vy = 0, vv = 0;
    double s = 0, sx = 0, sy = 0; // weight times the distance's size, and times i and j
    double x_size = 0, y_size = 0;
    int terms = 0;
    void add(double weight, double i, double j, double off)
    {
        w += weight, x += weight * i, y += weight * j, xx += weight * i * i, xy += weight * i * j, yy += weight * j * j;
        v += weight * off, vx += weight * off * i, vy += weight * off * j, vv += weight * off * off;
        s += weight * std::abs(off), sx += weight * std::abs(off * i), sy += weight * std::abs(off * j);
        x_size += weight * std::abs(i), y_size += weight * std::abs(j);
        ++terms;
    }
};

// One pass: the sums over the pixels within `limit` of the plane.
inline Sums gather(const Image& image, PixelPlane& p, int px, int py, int reach, double limit)
{
    Sums sums;
    // A distance is wrong by the plane's error at that pixel, by two roundings of the slopes' product and one of the difference.
    const double doubt =
        p.value_error + 2 * reach * p.slope_error + 4 * u * reach * (std::abs(p.slope_x) + std::abs(p.slope_y)) + 4 * u * limit;
    for (int j = -reach; j <= reach; ++j)
        for (int i = -reach; i <= reach; ++i) {
            const double other = image.at(px + i, py + j);
            if (!(other > 0)) continue;
            const double off = other - p.value - p.slope_x * i - p.slope_y * j;
            p.sure &= std::abs(std::abs(off) - limit) > doubt + 2 * u * std::abs(other - p.value);
            if (std::abs(off) < limit) sums.add(1 / (1 + .6 * (i * i + j * j) / (reach * reach)), i, j, off);
        }
    return sums;
}

// What Cramer's rule makes of float32's sums, at most: each sum of n terms is off by (n + 4) u of the sum of its terms' sizes, and so is
// each product of them; a quotient by what the determinant is off. Each distance is off by `each_off` besides: three roundings of the
// slopes' products.
inline void bound(const Sums& q, double determinant, double da, double dx, double dy, double each_off, PixelPlane& p)
{
    const double x = std::abs(q.x) + u, y = std::abs(q.y) + u, xy = std::abs(q.xy) + u;
    const double c00 = q.xx * q.yy + xy * xy, c01 = xy * y + x * q.yy, c02 = x * xy + q.xx * y, c11 = q.w * q.yy + y * y,
                 c12 = x * y + q.w * xy, c22 = q.w * q.xx + x * x;
    const double each = (3 * q.terms + 12) * u, whole = (q.w * c00 + x * c01 + y * c02) / determinant;
    const double a = (q.s * c00 + q.sx * c01 + q.sy * c02) / determinant + std::abs(da) * whole;
    const double b = (q.s * c01 + q.sx * c11 + q.sy * c12) / determinant + std::abs(dx) * whole;
    const double c = (q.s * c02 + q.sx * c12 + q.sy * c22) / determinant + std::abs(dy) * whole;
    p.value_error = u * p.value + each * a + each_off * (q.w * c00 + q.x_size * c01 + q.y_size * c02) / determinant;
    p.slope_error =
        u * (std::abs(p.slope_x) + std::abs(p.slope_y)) + each * std::max(b, c) +
        each_off * std::max(q.w * c01 + q.x_size * c11 + q.y_size * c12, q.w * c02 + q.x_size * c12 + q.y_size * c22) / determinant;
    p.square_error = each * (q.vv + std::abs(da) * q.s + std::abs(dx) * q.sx + std::abs(dy) * q.sy) / q.w +
                     each * (a * q.s + b * q.sx + c * q.sy) / q.w + 2 * each_off * q.s / q.w + each_off * each_off;
}

inline PixelPlane plane_at(const Image& image, int x, int y, int reach)
{
    const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
    const double own = image.value[at], sigma = image.sigma[at];
    PixelPlane p{.value = own};
    p.slope_x = smaller_step(image.at(x - 1, y), own, image.at(x + 1, y));
    p.slope_y = smaller_step(image.at(x, y - 1), own, image.at(x, y + 1));
    p.slope_error = u * (std::abs(p.slope_x) + std::abs(p.slope_y));
    for (int turn = 0; turn < 4; ++turn) {
        const double limit = loose(own, sigma, p.slope_x, p.slope_y) * (turn == 0 ? 1.5 : 1);
        // Least squares by Cramer's rule.
        const double each_off = 3 * u * reach * (std::abs(p.slope_x) + std::abs(p.slope_y));
        const Sums q = gather(image, p, x, y, reach, limit);
        const double c00 = q.xx * q.yy - q.xy * q.xy, c01 = q.xy * q.y - q.x * q.yy, c02 = q.x * q.xy - q.xx * q.y;
        const double determinant = q.w * c00 + q.x * c01 + q.y * c02;
        p.sure &= std::abs(determinant - .5) > 1e-3 && std::abs(q.w - 2) > 1e-4;
        if (q.w > 2 && determinant > .5) {
            const double cross = q.x * q.y - q.w * q.xy;
            const double da = (q.v * c00 + q.vx * c01 + q.vy * c02) / determinant;
            const double dx = (q.v * c01 + q.vx * (q.w * q.yy - q.y * q.y) + q.vy * cross) / determinant;
            const double dy = (q.v * c02 + q.vx * cross + q.vy * (q.w * q.xx - q.x * q.x)) / determinant;
            p.value += da, p.slope_x += dx, p.slope_y += dy;
            p.residual = std::sqrt(std::max(q.vv - (da * q.v + dx * q.vx + dy * q.vy), 0.) / q.w);
            p.count = 1.2 * q.w;
            bound(q, determinant, da, dx, dy, each_off, p);
        } else {
            p.value = own;
            p.residual = .5 * loose(own, sigma, p.slope_x, p.slope_y);
            p.count = 1;
            p.value_error = 0;
            p.square_error = 4 * u * p.residual * p.residual;
        }
    }
    return p;
}

inline double score(const PixelPlane& p, double own, double here)
{
    return p.residual / std::sqrt(std::max(p.count, 1.)) + .5 * std::abs(here - own);
}
inline double score_error(const PixelPlane& p, int reach)
{
    const double rms = std::sqrt(p.residual * p.residual + p.square_error) - p.residual;
    return rms + p.value_error + reach * p.slope_error + 2 * u * p.value;
}

// The plane that a pixel has after creases were looked at.
inline PixelPlane beside_crease(const Image& image, const std::vector<PixelPlane>& planes, int x, int y, int reach)
{
    const auto index = [&](int i, int j) {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(i);
    };
    const double own = image.value[index(x, y)], sigma = image.sigma[index(x, y)];
    PixelPlane result = planes[index(x, y)];
    const double edge = 2 * sigma + 1e-7 * own;
    const double doubt = std::sqrt(result.residual * result.residual + result.square_error) - result.residual + 4 * u * edge;
    result.sure &= std::abs(result.residual - edge) > doubt;
    if (result.residual < edge) return result;
    double best = score(result, own, result.value), best_error = score_error(result, reach);
    for (int j = -reach; j <= reach; j += reach)
        for (int i = -reach; i <= reach; i += reach) {
            if ((i == 0 && j == 0) || !(image.at(x + i, y + j) > 0)) continue;
            const PixelPlane& from = planes[index(x + i, y + j)];
            const double here = from.value - from.slope_x * i - from.slope_y * j, mark = score(from, own, here),
                         error = score_error(from, reach);
            const double limit = 3 * sigma + .5 * (std::abs(from.slope_x) + std::abs(from.slope_y)) + 3e-7 * own;
            const bool near = std::abs(here - own) < limit;
            if (near || std::abs(std::abs(here - own) - limit) < error) result.sure &= std::abs(mark - .2 * best) > error + .2 * best_error;
            if (mark < .2 * best || std::abs(mark - .2 * best) < error + .2 * best_error)
                result.sure &= std::abs(std::abs(here - own) - limit) > error;
            if (!near || !(mark < .2 * best)) continue;
            best = mark, best_error = error;
            const bool sure = result.sure && from.sure;
            result = from;
            result.value = here;
            // Two products and two differences more.
            result.value_error +=
                reach * 2 * from.slope_error + 2 * u * (std::abs(here) + reach * (std::abs(from.slope_x) + std::abs(from.slope_y)));
            result.sure = sure;
        }
    return result;
}

// The planes, and the value that is used: of what was measured what lies beyond three standard errors stays.
inline std::vector<PixelPlane> used_planes(const Image& image, int reach)
{
    std::vector<PixelPlane> first, result;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) first.push_back(plane_at(image, x, y, reach));
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            PixelPlane p = beside_crease(image, first, x, y, reach);
            const double own = image.at(x, y), sigma = image.sigma[result.size()], more = own - p.value;
            const double stray = loose(own, sigma, p.slope_x, p.slope_y);
            p.sure &= std::abs(std::abs(more) - stray) > p.value_error + 2 * p.slope_error + 4 * u * stray;
            if (std::abs(more) > stray)
                p.value = own, p.value_error = 0;
            else
                p.value += std::copysign(std::max(std::abs(more) - 3 * sigma, 0.), more), p.value_error += 2 * u * own;
            result.push_back(p);
        }
    return result;
}

} // namespace penumbra::oracle::depth_fit
