// A line against every pixel of a depth image, in double precision and in no order.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "depth_image/depth_image.hpp"

namespace penumbra::oracle::depth_walk {

struct Met {
    bool blocked = false;
    bool sure = true; // no decision that matters was closer than float32's rounding
};

// The part of t where start + t step lies in [low, high].
inline void clip(double start, double step, double low, double high, double& from, double& to)
{
    if (step == 0) {
        if (start < low || start >= high) to = from - 1;
        return;
    }
    const double a = (low - start) / step, b = (high - start) / step;
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
}

inline Met met(const DepthImage& image, const DepthLine& line)
{
    const double sx = line.step_x, sy = line.step_y, sv = line.step_value, x0 = line.x, y0 = line.y, speed = std::abs(sx) + std::abs(sy);
    Met sure_hit, result;
    for (int y = 0; y < image.view.height; ++y)
        for (int x = 0; x < image.view.width; ++x) {
            const DepthPixel& p =
                image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.view.width) + static_cast<std::size_t>(x)];
            if (!(p.value > 0)) continue;
            double from = line.from, to = line.to;
            clip(x0, sx, x, x + 1, from, to);
            clip(y0, sy, y, y + 1, from, to);
            // Borders are places over steps: a few roundings of t and of the places.
            const double doubt_t =
                8 * 0x1p-24 *
                (std::abs(from) + (std::abs(x0) + std::abs(y0) + x + y + 2) / std::max(std::min(std::abs(sx), std::abs(sy)), 1e-3));
            if (to < from - doubt_t) continue;
            const bool passes = to > from + doubt_t, own = from * speed >= line.own;
            const bool own_sure = std::abs(from * speed - line.own) > doubt_t * speed || line.own == 0;
            // How far behind the front the line is: a sum of terms, each rounded.
            const double base = p.value + p.slope_x * (x0 - x - .5) + p.slope_y * (y0 - y - .5) - line.value,
                         rise = p.slope_x * sx + p.slope_y * sy - sv;
            const double size = std::abs(p.value) + std::abs(p.slope_x) * (std::abs(x0) + x + 1) +
                                std::abs(p.slope_y) * (std::abs(y0) + y + 1) + std::abs(line.value) +
                                (std::abs(p.slope_x * sx) + std::abs(p.slope_y * sy) + std::abs(sv)) * (std::abs(from) + std::abs(to));
            const double doubt = 8 * 0x1p-24 * size + doubt_t * std::abs(rise);
            const double a = base + from * rise, b = base + to * rise, deep = std::max(a, b) - p.slack,
                         out = p.back + p.slack - std::min(a, b);
            if (deep < -doubt || out < -doubt) continue;
            const bool sure = deep > doubt && out > doubt && own_sure && passes;
            if (sure && own) sure_hit.blocked = true;
            if (!sure) result.sure = false;
        }
    // One sure hit is enough; without any, near misses are not known.
    return sure_hit.blocked ? sure_hit : result;
}

} // namespace penumbra::oracle::depth_walk
