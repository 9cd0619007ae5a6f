#include "scene/cracks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

namespace penumbra {
namespace {

// Vertices whose distance is not so many times less than their edges are detail.
constexpr double crack_ratio = 16;

// Places by cells of a side of `tolerance`: what is within it lies in the same cell or one next to it.
class Cells {
public:
    explicit Cells(double tolerance) : tolerance_(tolerance) {}

    // Calls visit(place, distance) for all that were added within the tolerance, in the order of their cells, then as they were added.
    template <class Visit> void near(std::span<const Imath::V3f> places, const Imath::V3f& p, const Visit& visit) const
    {
        const std::array<std::int64_t, 3> cell = cell_of(p);
        for (std::int64_t z = cell[2] - 1; z <= cell[2] + 1; ++z)
            for (std::int64_t y = cell[1] - 1; y <= cell[1] + 1; ++y)
                for (std::int64_t x = cell[0] - 1; x <= cell[0] + 1; ++x) {
                    const auto found = cells_.find(key(x, y, z));
                    if (found == cells_.end()) continue;
                    for (const std::uint32_t other : found->second) {
                        const double distance = (Vec3(places[other]) - Vec3(p)).length();
                        if (distance <= tolerance_) visit(other, distance);
                    }
                }
    }
    void add(std::uint32_t index, const Imath::V3f& p)
    {
        const std::array<std::int64_t, 3> cell = cell_of(p);
        cells_[key(cell[0], cell[1], cell[2])].push_back(index);
    }

private:
    // Cells far out share one: distances decide in the end.
    std::array<std::int64_t, 3> cell_of(const Imath::V3f& p) const
    {
        const auto cell = [&](float at) { return static_cast<std::int64_t>(std::clamp(std::floor(at / tolerance_), -0x1p60, 0x1p60)); };
        return {cell(p.x), cell(p.y), cell(p.z)};
    }
    static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z)
    {
        const auto u = [](std::int64_t i) { return static_cast<std::uint64_t>(i); };
        return (u(x) * 0x9e3779b97f4a7c15u) ^ (u(y) * 0xc2b2ae3d27d4eb4fu) ^ (u(z) * 0x165667b19e3779f9u);
    }

    double tolerance_;
    std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

// Of each vertex the length of its shortest edge that one triangle alone has; 0 without one.
std::vector<double> border_lengths(const TriangleMesh& mesh)
{
    std::vector<std::uint64_t> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const auto& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
            edges.push_back(std::uint64_t{low} << 32 | high);
        }
    std::ranges::sort(edges);
    std::vector<double> shortest(mesh.positions.size());
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t end = i + 1;
        while (end < edges.size() && edges[end] == edges[i]) ++end;
        if (end == i + 1) {
            const auto a = static_cast<std::uint32_t>(edges[i] >> 32), b = static_cast<std::uint32_t>(edges[i]);
            const double length = (Vec3(mesh.positions[a]) - Vec3(mesh.positions[b])).length();
            for (const std::uint32_t vertex : {a, b}) shortest[vertex] = shortest[vertex] > 0 ? std::min(shortest[vertex], length) : length;
        }
        i = end;
    }
    return shortest;
}

} // namespace

std::vector<std::uint32_t> joined_within(std::span<const Imath::V3f> places, double tolerance)
{
    Cells kept(tolerance);
    std::vector<std::uint32_t> joined(places.size());
    for (std::uint32_t i = 0; i < places.size(); ++i) {
        joined[i] = i;
        kept.near(places, places[i], [&](std::uint32_t other, double) { joined[i] = std::min(joined[i], other); });
        if (joined[i] == i) kept.add(i, places[i]);
    }
    return joined;
}

Cracks find_cracks(const TriangleMesh& mesh, double widest)
{
    if (!(widest > 0)) return {};
    const std::vector<double> shortest = border_lengths(mesh);
    Cells cells(widest);
    std::vector<bool> meets(mesh.positions.size());
    Cracks cracks;
    for (std::uint32_t i = 0; i < shortest.size(); ++i) {
        if (!(shortest[i] > 0)) continue;
        bool alone = true; // one of each cluster is kept, so that a cell never holds many
        cells.near(mesh.positions, mesh.positions[i], [&](std::uint32_t other, double distance) {
            alone = false;
            if (!(crack_ratio * distance < std::min(shortest[i], shortest[other]))) return;
            meets[i] = meets[other] = true;
            cracks.widest = std::max(cracks.widest, distance);
        });
        if (alone) cells.add(i, mesh.positions[i]);
    }
    cracks.vertices = static_cast<std::size_t>(std::ranges::count(meets, true));
    return cracks;
}

} // namespace penumbra
