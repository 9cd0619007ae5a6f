#include "depth_image/edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/parallel.hpp"

namespace penumbra {
namespace {

// A pixel's value, 0 outside.
struct Values {
    const ValueImage& image;
    float operator()(int x, int y) const
    {
        if (x < 0 || y < 0 || x >= image.width || y >= image.height) return 0;
        return image.value[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x)];
    }
};

constexpr std::array<std::array<int, 2>, 4> directions{{{1, 0}, {0, 1}, {1, 1}, {-1, 1}}};

// A running minimum or maximum over 2 reach + 1 pixels of each row, then of each column: a square window.
template <class Image, class Pick> Image over_square(const Image& from, int width, int height, int reach, const Pick& pick)
{
    Image rows(from.size()), result(from.size());
    const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); };
    parallel_for(height, [&](int y) {
        for (int x = 0; x < width; ++x) {
            auto best = from[at(x, y)];
            for (int i = std::max(0, x - reach); i <= std::min(width - 1, x + reach); ++i) best = pick(best, from[at(i, y)]);
            rows[at(x, y)] = best;
        }
    });
    parallel_for(height, [&](int y) {
        for (int x = 0; x < width; ++x) {
            auto best = rows[at(x, y)];
            for (int j = std::max(0, y - reach); j <= std::min(height - 1, y + reach); ++j) best = pick(best, rows[at(x, j)]);
            result[at(x, y)] = best;
        }
    });
    return result;
}

constexpr auto larger = [](auto a, auto b) { return std::max(a, b); };
constexpr auto smaller = [](auto a, auto b) { return std::min(a, b); };

} // namespace

Between between_two_surfaces(const ValueImage& image)
{
    const std::size_t count = image.value.size();
    Between result{.mixed = std::vector<std::uint8_t>(count), .toward_x = std::vector<std::int8_t>(count), .toward_y = std::vector<std::int8_t>(count)};
    const Values value{image};
    std::vector<std::array<std::uint64_t, 3>> counted(static_cast<std::size_t>(image.height));
    parallel_for(image.height, [&](int y) {
        for (int x = 0; x < image.width; ++x) {
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
            const float here = image.value[i];
            if (!(here > 0)) continue;
            for (const auto& [dx, dy] : directions) {
                const float after = value(x + dx, y + dy), before = value(x - dx, y - dy);
                const float beyond = std::abs(value(x + 2 * dx, y + 2 * dy) - after), outer = std::abs(before - value(x - 2 * dx, y - 2 * dy));
                const float up = after - here, down = here - before;
                const float limit = 3 * std::max(beyond, outer) + 6 * image.sigma[i] + 1e-3f * here;
                const bool found = (up > 0) == (down > 0) && std::abs(up) > limit && std::abs(down) > limit;
                if (dx == 0 || dy == 0) {
                    auto& [between, steps, seen_steps] = counted[static_cast<std::size_t>(y)];
                    const bool step = std::abs(up) > 3 * std::max(std::abs(down), beyond) + 6 * image.sigma[i] + 2e-3f * here;
                    between += found;
                    steps += step;
                    seen_steps += step && before > 0 && after > 0;
                }
                if (!found || result.mixed[i]) continue;
                result.mixed[i] = 1;
                result.toward_x[i] = static_cast<std::int8_t>(up > 0 ? dx : -dx);
                result.toward_y[i] = static_cast<std::int8_t>(up > 0 ? dy : -dy);
            }
        }
    });
    for (const auto& [between, steps, seen_steps] : counted) {
        result.between += between;
        result.steps += steps;
        result.seen_steps += seen_steps;
    }
    return result;
}

std::vector<std::uint8_t> ramps(const ValueImage& image, int half_width)
{
    const int width = image.width, height = image.height, k = half_width;
    const Values value{image};
    // The gradient: half the difference of the two neighbours that are there.
    std::vector<float> slope(image.value.size()), nearest_low(image.value.size());
    const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); };
    parallel_for(height, [&](int y) {
        for (int x = 0; x < width; ++x) {
            const float here = value(x, y);
            const auto half = [&](float before, float after) {
                if (before > 0 && after > 0) return (after - before) / 2;
                return after > 0 ? after - here : before > 0 ? here - before : 0.f;
            };
            slope[at(x, y)] = here > 0 ? std::hypot(half(value(x - 1, y), value(x + 1, y)), half(value(x, y - 1), value(x, y + 1))) : 0.f;
            nearest_low[at(x, y)] = here > 0 ? here : 3e38f;
        }
    });
    const std::vector<float> top = over_square(image.value, width, height, k, larger), bottom = over_square(nearest_low, width, height, k, smaller);

    std::vector<std::uint8_t> found(image.value.size());
    parallel_for(height, [&](int y) {
        std::vector<float> around;
        for (int x = 0; x < width; ++x) {
            const std::size_t i = at(x, y);
            // What the quantile could not change is passed over: it is not negative.
            if (!(slope[i] > 1.5e-3f * image.value[i]) || !(top[i] - bottom[i] > .02f * top[i])) continue;
            around.clear();
            for (int v = std::max(0, y - 2 * k); v <= std::min(height - 1, y + 2 * k); ++v)
                for (int u = std::max(0, x - 2 * k); u <= std::min(width - 1, x + 2 * k); ++u)
                    if (image.value[at(u, v)] > 0) around.push_back(slope[at(u, v)]);
            const auto quantile = around.begin() + static_cast<std::ptrdiff_t>(.3 * static_cast<double>(around.size() - 1));
            std::nth_element(around.begin(), quantile, around.end());
            const float base = *quantile;
            found[i] = slope[i] > 4 * base + 1.5e-3f * image.value[i] && top[i] - bottom[i] > static_cast<float>(4 * k) * base + .02f * top[i];
        }
    });
    std::vector<std::uint8_t> grown = over_square(found, width, height, 1, larger);
    for (std::size_t i = 0; i < grown.size(); ++i) grown[i] = grown[i] && image.value[i] > 0;
    return grown;
}

bool is_smeared(const ValueImage& image, const std::vector<std::uint8_t>& ramp, std::uint64_t seen_steps)
{
    const auto pixels = static_cast<std::uint64_t>(std::count_if(image.value.begin(), image.value.end(), [](float v) { return v > 0; }));
    // Pixels beside holes say nothing: their edge may have been dropped.
    const std::vector<std::uint8_t> there = [&] {
        std::vector<std::uint8_t> holds(image.value.size());
        for (std::size_t i = 0; i < holds.size(); ++i) holds[i] = image.value[i] > 0;
        return over_square(holds, image.width, image.height, 3, smaller);
    }();
    std::uint64_t on_ramps = 0;
    for (std::size_t i = 0; i < ramp.size(); ++i) on_ramps += ramp[i] && there[i];
    // Measured: 4 to 11 pixels a step where edges are steps, 13,000 and more where none is; 256 pixels are two short edges.
    return on_ramps > 60 * std::max<std::uint64_t>(seen_steps, 1) && on_ramps > std::max<std::uint64_t>(256, pixels / 500);
}

std::vector<std::uint8_t> closed_holes(int width, int height, const std::vector<std::uint8_t>& there, int reach)
{
    // What lies outside the image counts as its border does: windows end there.
    const std::vector<std::uint8_t> grown = over_square(there, width, height, reach, larger);
    std::vector<std::uint8_t> closed = over_square(grown, width, height, reach, smaller);
    for (std::size_t i = 0; i < closed.size(); ++i) closed[i] = closed[i] && !there[i];
    return closed;
}

std::vector<std::uint8_t> silhouettes(const DepthFit& fit)
{
    std::vector<std::uint8_t> edge(fit.value.size());
    const auto inside = [&](int x, int y) { return x >= 0 && y >= 0 && x < fit.width && y < fit.height; };
    parallel_for(fit.height, [&](int y) {
        for (int x = 0; x < fit.width; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!fit.there[i] || fit.mixed[i]) continue;
            for (const auto& [dx, dy] : {std::array{1, 0}, std::array{-1, 0}, std::array{0, 1}, std::array{0, -1}}) {
                int u = x + dx, v = y + dy;
                if (inside(u, v) && fit.mixed[fit.index(u, v)]) u += dx, v += dy;
                if (!inside(u, v)) continue;
                const std::size_t j = fit.index(u, v);
                const float behind = fit.there[j] ? fit.value[j] : 0.f;
                if (fit.value[i] - behind > fit.joint(i)) edge[i] = 1;
            }
        }
    });
    return edge;
}

} // namespace penumbra
