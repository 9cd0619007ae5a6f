#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <penumbra/error.hpp>

#include "scene/camera.hpp"
#include "scene/memory.hpp"
#include "scene/stop.hpp"
#include "silhouette/silhouette.hpp"

namespace penumbra {
namespace {

constexpr std::uint32_t none = 0xffffffff;
constexpr double bytes_per_texel = 100;

// Texels by what is linear on planes: disparity, an orthographic camera's depth; 0: nothing there. And which neighbours are joined.
class Texels {
public:
    Texels(const DepthMap& map, bool orthographic) : map_(map), orthographic_(orthographic), joins_(map.depth.size(), 0)
    {
        const auto join = [&](int x, int y, int dx, int dy) {
            return joined(value(x - dx, y - dy), value(x, y), value(x + dx, y + dy), value(x + 2 * dx, y + 2 * dy), map.precision);
        };
        for (int y = 0; y < map.height; ++y) {
            check_stop();
            for (int x = 0; x < map.width; ++x)
                joins_[index(x, y)] = static_cast<std::uint8_t>((join(x, y, 1, 0) ? to_right : 0) | (join(x, y, 0, 1) ? to_below : 0));
        }
    }

    bool inside(int x, int y) const { return x >= 0 && y >= 0 && x < map_.width && y < map_.height; }
    std::size_t index(int x, int y) const
    {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(map_.width) + static_cast<std::size_t>(x);
    }
    double value(int x, int y) const
    {
        if (!inside(x, y)) return 0;
        const double depth = map_.at(x, y);
        if (!std::isfinite(depth) || depth <= 0) return 0;
        return orthographic_ ? depth : 1 / depth;
    }
    double depth(double value) const { return orthographic_ ? value : 1 / value; }

    bool right(int x, int y) const { return inside(x, y) && (joins_[index(x, y)] & to_right) != 0; }
    bool below(int x, int y) const { return inside(x, y) && (joins_[index(x, y)] & to_below) != 0; }

    // Change of value from one texel to the next, of those joined to this.
    Vec2 slope(int x, int y) const
    {
        const auto between = [this, x, y](bool before, bool after, int dx, int dy) {
            const double step_in = before ? value(x, y) - value(x - dx, y - dy) : 0;
            const double step_out = after ? value(x + dx, y + dy) - value(x, y) : 0;
            return before && after ? (step_in + step_out) / 2 : step_in + step_out;
        };
        return {between(right(x - 1, y), right(x, y), 1, 0), between(below(x, y - 1), below(x, y), 0, 1)};
    }

private:
    static constexpr int to_right = 1, to_below = 2;
    const DepthMap& map_;
    bool orthographic_;
    std::vector<std::uint8_t> joins_;
};

// The four texels around the corner at pixel (x, y), clockwise from the upper left.
constexpr int left_of[] = {-1, 0, 0, -1}, above[] = {-1, -1, 0, 0};

// Which of them hang together: each has the number of the first that it is joined to, on either way round.
std::array<int, 4> groups_around(const Texels& texels, int x, int y)
{
    const bool joined_to_next[] = {texels.right(x - 1, y - 1), texels.below(x, y - 1), texels.right(x - 1, y), texels.below(x - 1, y - 1)};
    std::array<int, 4> group{0, 1, 2, 3};
    for (std::size_t i = 0; i < 4; ++i) {
        const int a = group[i], b = group[(i + 1) % 4];
        if (joined_to_next[i])
            for (int& g : group)
                if (g == a || g == b) g = std::min(a, b);
    }
    return group;
}

// The corner's value for one group.
double corner_value(const Texels& texels, int x, int y, const std::array<int, 4>& groups, int group)
{
    int count = 0;
    double mean = 0, extended = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        if (groups[i] != group) continue;
        const int tx = x + left_of[i], ty = y + above[i];
        const Vec2 slope = texels.slope(tx, ty);
        const double value = texels.value(tx, ty);
        ++count;
        mean += value;
        extended += value + (left_of[i] < 0 ? slope.x : -slope.x) / 2 + (above[i] < 0 ? slope.y : -slope.y) / 2;
    }
    // Four texels have the corner in their middle; fewer do not. A plane that reaches the horizon before the corner has no point there.
    return (count == 4 || extended <= 0 ? mean : extended) / count;
}

} // namespace

bool joined(double before, double a, double b, double after, double precision)
{
    if (a <= 0 || b <= 0) return false;
    constexpr double steepening = 1 + std::numbers::sqrt2;
    const double step = b - a;
    const auto explained = [&](double slope, double slope_rounding) {
        const double rounding = precision * (a + b) + steepening * slope_rounding;
        return step >= std::min(0.0, steepening * slope) - rounding && step <= std::max(0.0, steepening * slope) + rounding;
    };
    return explained(0, 0) || (before > 0 && explained(a - before, precision * (before + a))) ||
           (after > 0 && explained(after - b, precision * (b + after)));
}

TriangleMesh mesh_of_texels(const DepthMap& map, const Camera& camera)
{
    // At most four vertices a texel, numbered in 32 bits.
    if (map.depth.size() >= none / 4)
        throw Error(ErrorCode::too_large, "depth map: " + std::to_string(map.width) + " x " + std::to_string(map.height) + " texels",
                    "expected fewer than " + std::to_string(none / 4));
    // Vertices, their values, two triangles, and what vectors that grow hold for a moment.
    require_memory(bytes_per_texel * static_cast<double>(map.depth.size()),
                   "surfaces of a depth map of " + std::to_string(map.width) + " x " + std::to_string(map.height));
    const Texels texels(map, camera.orthographic);
    TriangleMesh mesh;

    // A vertex for every group of texels around a corner. Texels get theirs clockwise from the lower right one, as corners get texels.
    std::vector<std::array<std::uint32_t, 4>> vertex(map.depth.size());
    std::vector<double> value;
    for (int y = 0; y <= map.height; ++y)
        for (int x = 0; x <= map.width; ++x) {
            const std::array<int, 4> groups = groups_around(texels, x, y);
            std::array<std::uint32_t, 4> of_group{none, none, none, none};
            for (std::size_t i = 0; i < 4; ++i) {
                const int tx = x + left_of[i], ty = y + above[i];
                if (texels.value(tx, ty) == 0) continue;
                std::uint32_t& v = of_group[static_cast<std::size_t>(groups[i])];
                if (v == none) {
                    v = static_cast<std::uint32_t>(mesh.positions.size());
                    value.push_back(corner_value(texels, x, y, groups, groups[i]));
                    mesh.positions.emplace_back(world_point(camera, map.width, map.height, x, y, texels.depth(value.back())));
                }
                vertex[texels.index(tx, ty)][i] = v;
            }
        }

    // Two triangles a texel along the diagonal whose ends differ less, counter-clockwise as the camera sees them.
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
            if (texels.value(x, y) == 0) continue;
            const auto [br, bl, tl, tr] = vertex[texels.index(x, y)];
            if (std::abs(value[tl] - value[br]) < std::abs(value[tr] - value[bl])) {
                mesh.triangles.push_back({tl, bl, br});
                mesh.triangles.push_back({tl, br, tr});
            } else {
                mesh.triangles.push_back({tl, bl, tr});
                mesh.triangles.push_back({tr, bl, br});
            }
        }
    return mesh;
}

} // namespace penumbra
