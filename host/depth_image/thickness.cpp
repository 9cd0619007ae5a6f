#include "depth_image/thickness.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "depth_image/edges.hpp"
#include "scene/parallel.hpp"

namespace penumbra {
namespace {

constexpr float far_off = 1e12f; // squared distance where nothing is marked

// Lower envelope of parabolas: the squared distance along one line, from the squared distances across it.
void distances_along(std::vector<float>& line, std::vector<int>& vertex, std::vector<float>& border, std::vector<float>& result)
{
    const int n = static_cast<int>(line.size());
    int k = -1;
    for (int q = 0; q < n; ++q) {
        if (line[static_cast<std::size_t>(q)] >= far_off) continue;
        float s = -std::numeric_limits<float>::infinity();
        while (k >= 0) {
            const int v = vertex[static_cast<std::size_t>(k)];
            s = ((line[static_cast<std::size_t>(q)] + static_cast<float>(q) * static_cast<float>(q)) -
                 (line[static_cast<std::size_t>(v)] + static_cast<float>(v) * static_cast<float>(v))) /
                (2 * static_cast<float>(q - v));
            if (s > border[static_cast<std::size_t>(k)]) break;
            --k;
        }
        if (k < 0) s = -std::numeric_limits<float>::infinity();
        ++k;
        vertex[static_cast<std::size_t>(k)] = q;
        border[static_cast<std::size_t>(k)] = s;
    }
    if (k < 0) {
        std::fill(result.begin(), result.end(), far_off);
        return;
    }
    const int last = k;
    k = 0;
    for (int q = 0; q < n; ++q) {
        while (k < last && border[static_cast<std::size_t>(k) + 1] < static_cast<float>(q)) ++k;
        const int v = vertex[static_cast<std::size_t>(k)];
        result[static_cast<std::size_t>(q)] = static_cast<float>(q - v) * static_cast<float>(q - v) + line[static_cast<std::size_t>(v)];
    }
}

// Squared distances.
template <class Marked> std::vector<float> squared_distances(int width, int height, const Marked& marked)
{
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    std::vector<float> across(w * h), result(w * h);
    // Rows: two sweeps count the pixels since the last mark.
    parallel_for(height, [&](int y) {
        float* const row = across.data() + static_cast<std::size_t>(y) * w;
        float since = 1e6f;
        for (std::size_t x = 0; x < w; ++x) row[x] = since = marked(static_cast<std::size_t>(y) * w + x) ? 0 : since + 1;
        since = 1e6f;
        for (std::size_t x = w; x-- > 0;) row[x] = std::min(row[x], since = marked(static_cast<std::size_t>(y) * w + x) ? 0 : since + 1);
        for (std::size_t x = 0; x < w; ++x) row[x] = row[x] >= 1e6f ? far_off : row[x] * row[x];
    });
    // Columns, some at a time for each task.
    constexpr int strip = 16;
    parallel_for((width + strip - 1) / strip, [&](int first) {
        std::vector<float> line(h), border(h), down(h);
        std::vector<int> vertex(h);
        for (int x = first * strip; x < std::min(width, (first + 1) * strip); ++x) {
            for (std::size_t y = 0; y < h; ++y) line[y] = across[y * w + static_cast<std::size_t>(x)];
            distances_along(line, vertex, border, down);
            for (std::size_t y = 0; y < h; ++y) result[y * w + static_cast<std::size_t>(x)] = down[y];
        }
    });
    return result;
}

} // namespace

std::vector<float> distance_to(const std::vector<std::uint8_t>& marked, int width, int height)
{
    std::vector<float> squared = squared_distances(width, height, [&](std::size_t i) { return marked[i] != 0; });
    for (float& d : squared) d = d >= far_off ? std::numeric_limits<float>::infinity() : std::sqrt(d);
    return squared;
}

std::vector<float> local_thickness(const std::vector<float>& distance, int width, int height)
{
    std::vector<float> widest = distance;
    float largest = 0;
    for (const float d : distance)
        if (std::isfinite(d)) largest = std::max(largest, d);
    for (float r = 1; r < std::min(160.f, largest); r += std::max(.5f, .06f * r)) {
        // Pixels within r of one that is r from the silhouette.
        const std::vector<float> to_core = squared_distances(width, height, [&](std::size_t i) { return distance[i] >= r; });
        parallel_for(height, [&](int y) {
            for (int x = 0; x < width; ++x) {
                const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
                if (to_core[i] <= r * r) widest[i] = std::max(widest[i], r);
            }
        });
    }
    return widest;
}

std::vector<float> thickness_of(const DepthFit& fit)
{
    const std::vector<std::uint8_t> edge = silhouettes(fit);
    // The silhouette's line runs half a pixel beyond its pixels' centres. Without any, everything is as wide as can be.
    std::vector<float> distance = distance_to(edge, fit.width, fit.height);
    for (float& d : distance) d = std::isfinite(d) ? d + .5f : static_cast<float>(fit.width + fit.height);
    const std::vector<float> radius = local_thickness(distance, fit.width, fit.height);
    const std::vector<float> span = membrane(fit, edge);
    std::vector<float> thickness(fit.value.size());
    parallel_for(fit.height, [&](int y) {
        for (int x = 0; x < fit.width; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!fit.there[i] || fit.mixed[i]) continue;
            const float z = fit.depth(i), footprint = static_cast<float>(fit.pixel_y) * (fit.orthographic ? 1 : z);
            const float round = footprint * 2 * std::sqrt(std::max(distance[i] * (2 * radius[i] - distance[i]), 0.f));
            const double behind = fit.orthographic ? fit.far - static_cast<double>(span[i]) : 1 / std::max(static_cast<double>(span[i]), 1e-37);
            const float mirrored = 2 * std::max(static_cast<float>(behind - static_cast<double>(z)), 0.f);
            thickness[i] = std::max(std::min(round, 2 * mirrored), .2f * round) + .5f * footprint;
        }
    });
    return thickness;
}

} // namespace penumbra
