#include <array>
#include <cmath>

#include "scene/camera.hpp"
#include "scene/depth.hpp"

namespace penumbra {
namespace {

// Disparities with a border of nothing.
struct Disparities {
    const DepthMap& map;
    double operator()(int x, int y) const
    {
        if (x < 0 || y < 0 || x >= map.width || y >= map.height) return 0;
        const float depth = map.at(x, y);
        return std::isfinite(depth) && depth > 0 ? 1.0 / depth : 0.0;
    }
};

// A step is explained by a slope of the same sign, up to twice its size: curvature may double a slope from one texel to the next.
bool explains(double slope, double step, double rounding)
{
    return std::abs(step) <= rounding || (step * slope > 0 && std::abs(step) <= 2 * std::abs(slope) + rounding);
}

// Which sides of the cell whose upper left texel is (x, y) are on one surface.
struct Cell {
    bool top, bottom, left, right;
};

Cell cell_at(const Disparities& d, int x, int y, double precision)
{
    const auto across = [&](int row) { return connected(d(x - 1, row), d(x, row), d(x + 1, row), d(x + 2, row), precision); };
    const auto down = [&](int column) { return connected(d(column, y - 1), d(column, y), d(column, y + 1), d(column, y + 2), precision); };
    return {.top = across(y), .bottom = across(y + 1), .left = down(x), .right = down(x + 1)};
}

} // namespace

bool connected(double before, double a, double b, double after, double precision)
{
    if (a <= 0 || b <= 0) return false;
    // Each disparity is off by up to `precision` of itself: a difference of two by twice that, and a doubled slope by twice that again.
    const double rounding = 6 * precision * std::max(a, b);
    const double step = b - a;
    return std::abs(step) <= rounding || (before > 0 && explains(a - before, step, rounding)) ||
           (after > 0 && explains(after - b, step, rounding));
}

TriangleMesh mesh_from_depth(const DepthMap& depth, const Camera& camera)
{
    TriangleMesh mesh;
    const Disparities d{depth};

    // A vertex a texel that holds something.
    constexpr std::uint32_t none = 0xffffffff;
    std::vector<std::uint32_t> vertex(depth.depth.size(), none);
    for (int y = 0; y < depth.height; ++y)
        for (int x = 0; x < depth.width; ++x) {
            if (d(x, y) == 0) continue;
            vertex[static_cast<std::size_t>(y) * static_cast<std::size_t>(depth.width) + static_cast<std::size_t>(x)] =
                static_cast<std::uint32_t>(mesh.positions.size());
            mesh.positions.emplace_back(world_point(camera, depth.width, depth.height, x + 0.5, y + 0.5, depth.at(x, y)));
        }

    // Two triangles where all four sides of a cell are joined, the one at a corner where only that corner's two sides are.
    // Counter-clockwise as the camera sees them.
    for (int y = 0; y + 1 < depth.height; ++y)
        for (int x = 0; x + 1 < depth.width; ++x) {
            const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(depth.width) + static_cast<std::size_t>(x);
            const std::uint32_t tl = vertex[at], tr = vertex[at + 1];
            const std::uint32_t bl = vertex[at + static_cast<std::size_t>(depth.width)],
                                br = vertex[at + static_cast<std::size_t>(depth.width) + 1];
            const Cell cell = cell_at(d, x, y, depth.precision);
            const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh.triangles.push_back({a, b, c}); };
            if (cell.top && cell.bottom && cell.left && cell.right) {
                // Along the diagonal whose ends differ less.
                if (std::abs(d(x, y) - d(x + 1, y + 1)) < std::abs(d(x + 1, y) - d(x, y + 1))) {
                    add(tl, bl, br);
                    add(tl, br, tr);
                } else {
                    add(tl, bl, tr);
                    add(tr, bl, br);
                }
            } else if (cell.top && cell.left) {
                add(tl, bl, tr);
            } else if (cell.left && cell.bottom) {
                add(bl, br, tl);
            } else if (cell.bottom && cell.right) {
                add(br, tr, bl);
            } else if (cell.right && cell.top) {
                add(tr, tl, br);
            }
        }
    return mesh;
}

} // namespace penumbra
