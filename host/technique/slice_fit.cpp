#include "technique/slice_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace penumbra {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double widest_tangent = 4;

struct Point {
    double x, y, z;
};

Point vertex(const SliceCasters& casters, std::size_t i)
{
    return {casters.vertices[3 * i], casters.vertices[3 * i + 1], casters.vertices[3 * i + 2]};
}

std::array<Point, 3> corners(const SliceCasters& casters, std::size_t triangle)
{
    const std::int32_t* const t = casters.triangles.data() + 3 * triangle;
    return {vertex(casters, static_cast<std::size_t>(t[0])), vertex(casters, static_cast<std::size_t>(t[1])),
            vertex(casters, static_cast<std::size_t>(t[2]))};
}

// Calls with every corner of every triangle's part at or beyond depth `near`.
template <class Function> void for_each_corner(const SliceCasters& casters, double near, const Function& function)
{
    for (std::size_t t = 0; t < casters.triangles.size() / 3; ++t) {
        const auto points = corners(casters, t);
        for (std::size_t i = 0; i < 3; ++i) {
            const Point &a = points[i], &b = points[(i + 1) % 3];
            if (a.z >= near) function(a);
            if ((a.z < near) == (b.z < near)) continue;
            const double at = (near - a.z) / (b.z - a.z);
            function(Point{a.x + at * (b.x - a.x), a.y + at * (b.y - a.y), near});
        }
    }
}

double area_of(const std::array<Point, 3>& p)
{
    const Vec3 a(p[0].x, p[0].y, p[0].z), b(p[1].x, p[1].y, p[1].z), c(p[2].x, p[2].y, p[2].z);
    return 0.5 * (b - a).cross(c - a).length();
}

// How much of the casters' area lies in each of even steps of depth.
std::vector<double> area_by_depth(const SliceCasters& casters, const SliceRange& range, std::size_t bins)
{
    // A triangle's area is spread evenly over its depths: two sums, one of what is spread over whole bins, one of what lies in one bin.
    std::vector<double> starts(bins + 1), area(bins);
    const double per_bin = static_cast<double>(bins) / (range.far - range.near);
    const auto bin_of = [&](double z) { return std::min(static_cast<std::size_t>((z - range.near) * per_bin), bins - 1); };
    for (std::size_t t = 0; t < casters.triangles.size() / 3; ++t) {
        const auto points = corners(casters, t);
        const double low = std::min({points[0].z, points[1].z, points[2].z}), high = std::max({points[0].z, points[1].z, points[2].z});
        if (high < range.near) continue;
        const std::size_t first = bin_of(std::max(low, range.near)), last = bin_of(high);
        const double share = area_of(points) / static_cast<double>(last - first + 1);
        starts[first] += share;
        starts[last + 1] -= share;
    }
    double running = 0;
    for (std::size_t i = 0; i < bins; ++i) area[i] = running += starts[i];
    return area;
}

// Where the running sum of what the bins hold reaches each of `slices` even shares.
std::vector<double> shares_of(const std::vector<double>& bins, int slices)
{
    double total = 0;
    for (const double value : bins) total += std::max(value, 0.0);
    std::vector<double> at{0};
    double sum = 0;
    for (std::size_t i = 0; i < bins.size(); ++i) {
        const double value = std::max(bins[i], 0.0);
        while (at.size() < static_cast<std::size_t>(slices) && value > 0 &&
               sum + value >= total * static_cast<double>(at.size()) / slices) {
            const double wanted = total * static_cast<double>(at.size()) / slices;
            at.push_back((static_cast<double>(i) + std::clamp((wanted - sum) / value, 0.0, 1.0)) / static_cast<double>(bins.size()));
        }
        sum += value;
    }
    while (at.size() <= static_cast<std::size_t>(slices)) at.push_back(1);
    at.back() = 1;
    return at;
}

// How far behind the light the centre of projection lies so that the frustum through the light's edges holds the casters: at one point, along
// x and y, half z / (|x| - half).
double behind_for_frustum(const SliceCasters& casters, const SliceRange& range, const SlicePart& part)
{
    double behind_x = infinite, behind_y = infinite;
    for_each_corner(casters, range.near, [&](const Point& p) {
        const double out_x = std::abs(p.x - part.centre_x) - part.half_u, out_y = std::abs(p.y - part.centre_y) - part.half_v;
        if (out_x > 0) behind_x = std::min(behind_x, part.half_u * p.z / out_x);
        if (out_y > 0) behind_y = std::min(behind_y, part.half_v * p.z / out_y);
    });
    return std::min(std::max(behind_x, behind_y), range.far);
}

// The least that keeps all casters within tangents of `widest_tangent`: what lies beside the light near its plane would take the window.
double behind_for_width(const SliceCasters& casters, const SliceRange& range, const SlicePart& part)
{
    double behind = 0;
    for_each_corner(casters, range.near, [&](const Point& p) {
        const double out = std::max(std::abs(p.x - part.centre_x), std::abs(p.y - part.centre_y));
        behind = std::max(behind, out / widest_tangent - p.z);
    });
    return behind;
}

} // namespace

SliceCasters slice_casters(const LightFrame& light, std::span<const TriangleMesh* const> meshes)
{
    SliceCasters casters;
    for (const TriangleMesh* mesh : meshes) {
        const std::size_t first = casters.vertices.size() / 3;
        casters.vertices.reserve(casters.vertices.size() + 3 * mesh->positions.size());
        for (const Imath::V3f& position : mesh->positions) {
            const Vec3 point = light_from_world(light, Vec3(position));
            casters.vertices.insert(casters.vertices.end(),
                                    {static_cast<float>(point.x), static_cast<float>(point.y), static_cast<float>(point.z)});
        }
        casters.triangles.reserve(casters.triangles.size() + 3 * mesh->triangles.size());
        for (const auto& triangle : mesh->triangles) {
            const bool finite = std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) {
                const float* const p = casters.vertices.data() + 3 * (first + v);
                return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
            });
            casters.left_out += !finite;
            if (finite)
                for (const std::uint32_t v : triangle) casters.triangles.push_back(static_cast<std::int32_t>(first + v));
        }
    }
    return casters;
}

SliceRange slice_range(const SliceCasters& casters, bool directional)
{
    double low = infinite, high = -infinite;
    for (const std::int32_t v : casters.triangles) {
        const double z = casters.vertices[3 * static_cast<std::size_t>(v) + 2];
        low = std::min(low, z);
        high = std::max(high, z);
    }
    if (!(low <= high)) return {};
    if (directional) return {.near = low, .far = high, .cut = 0};
    SliceRange range{.near = std::max(low, high * 0x1p-10), .far = high, .cut = 0};
    if (low < range.near)
        for (std::size_t t = 0; t < casters.triangles.size() / 3; ++t) {
            const auto p = corners(casters, t);
            range.cut += std::min({p[0].z, p[1].z, p[2].z}) < range.near;
        }
    return range;
}

std::vector<float> slice_depths(const SliceCasters& casters, const SliceRange& range, int slices, Placement placement, bool directional)
{
    const std::size_t count = static_cast<std::size_t>(slices);
    std::vector<double> at; // of the range
    if (placement == Placement::occupied && range.far > range.near)
        at = shares_of(area_by_depth(casters, range, 4096), slices);
    else
        for (std::size_t i = 0; i <= count; ++i) at.push_back(static_cast<double>(i) / slices);

    std::vector<float> depths;
    for (std::size_t i = 0; i <= count; ++i) {
        double z = range.near + at[i] * (range.far - range.near);
        if (placement == Placement::reciprocal && !directional) z = 1 / (1 / range.near + at[i] * (1 / range.far - 1 / range.near));
        depths.push_back(static_cast<float>(z));
    }
    depths.front() = static_cast<float>(range.near);
    depths.back() = static_cast<float>(range.far);
    return depths;
}

SliceView slice_view(const SliceCasters& casters, const SliceRange& range, const SlicePart& part, const OcclusionTexture& settings,
                     bool directional)
{
    const int resolution = settings.resolution;
    const double wanted = directional                                                ? 0
                          : settings.projection_centre == ProjectionCentre::light ? behind_for_width(casters, range, part)
                                                                                     : behind_for_frustum(casters, range, part);
    const double behind = static_cast<double>(static_cast<float>(wanted)); // as the device adds it

    Vec2 low(infinite, infinite), high(-infinite, -infinite);
    for_each_corner(casters, directional ? -infinite : range.near, [&](const Point& p) {
        const double per = directional ? 1 : 1 / (p.z + behind);
        const Vec2 at((p.x - part.centre_x) * per, (p.y - part.centre_y) * per);
        low = {std::min(low.x, at.x), std::min(low.y, at.y)};
        high = {std::max(high.x, at.x), std::max(high.y, at.y)};
    });
    // A window of no width takes a little of the other side's.
    const double least =
        std::max({(high.x - low.x) * 0x1p-10, (high.y - low.y) * 0x1p-10, std::abs(low.x) * 0x1p-16, std::abs(low.y) * 0x1p-16, 1e-30});
    const auto widen = [&](double& from, double& to) {
        if (to - from >= least) return;
        const double middle = 0.5 * (from + to);
        from = middle - 0.5 * least;
        to = middle + 0.5 * least;
    };
    widen(low.x, high.x);
    widen(low.y, high.y);
    return {.width = resolution,
            .height = resolution,
            .slices = settings.slices,
            .orthographic = directional ? 1 : 0,
            .behind = static_cast<float>(behind),
            .centre_x = static_cast<float>(part.centre_x),
            .centre_y = static_cast<float>(part.centre_y),
            .low_x = static_cast<float>(low.x),
            .low_y = static_cast<float>(low.y),
            .per_x = static_cast<float>(resolution / (high.x - low.x)),
            .per_y = static_cast<float>(resolution / (high.y - low.y))};
}

} // namespace penumbra
