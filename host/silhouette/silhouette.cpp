#include <algorithm>
#include <cmath>
#include <string>

#include <penumbra/error.hpp>

#include "silhouette/edges.hpp"

namespace penumbra {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using EdgeUse = Topology::EdgeUse;

enum class Facing : std::uint8_t { no, as_wound, turned };

// Rounding can misjudge a triangle seen edge-on only; whatever set of triangles comes out, its boundary is closed.
std::vector<Facing> facing_of(const Topology& topology, const Vec3& point)
{
    const auto vertices = topology.vertices();
    const auto triangles = topology.triangles();
    std::vector<Facing> facing(triangles.size());
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
        const Triangle& t = triangles[i];
        const Vec3 a = Vec3(vertices[t[0]]) - point, b = Vec3(vertices[t[1]]) - point, c = Vec3(vertices[t[2]]) - point;
        // Six times the volume between point and triangle: negative where a, b, c run counter-clockwise as the point sees them.
        const double volume = a.dot(b.cross(c));
        if (volume < 0)
            facing[i] = Facing::as_wound;
        else
            facing[i] = volume > 0 && !topology.closed(i) ? Facing::turned : Facing::no;
    }
    return facing;
}

// The facing triangles as a surface: what lies across each of their sides, and the sides where nothing does.
struct Surface {
    std::span<const Triangle> triangles;
    std::vector<Facing> facing;
    std::vector<std::uint32_t> across; // by side, of facing triangles; no_side on the border
    std::vector<std::uint32_t> border; // sides, in the order of the edges

    bool turned(std::uint32_t triangle) const { return facing[triangle] == Facing::turned; }

    // The ends of a side as the facing triangle passes it.
    std::uint32_t from(std::uint32_t side) const { return triangles[side / 3][(side % 3 + (turned(side / 3) ? 1 : 0)) % 3]; }
    std::uint32_t to(std::uint32_t side) const { return triangles[side / 3][(side % 3 + (turned(side / 3) ? 0 : 1)) % 3]; }

    // The side of the same triangle that begins where this one ends.
    std::uint32_t next(std::uint32_t side) const
    {
        const std::uint32_t triangle = side / 3, corner = side % 3;
        return 3 * triangle + (corner + (turned(triangle) ? 2 : 1)) % 3;
    }
};

Surface surface_of(const Topology& topology, const Vec3& point)
{
    Surface surface{.triangles = topology.triangles(),
                    .facing = facing_of(topology, point),
                    .across = std::vector<std::uint32_t>(3 * topology.triangles().size()),
                    .border = {}};
    // Pair off, edge by edge, the sides that run opposite ways.
    std::vector<std::uint32_t> forward, backward;
    for_each_edge(topology.edge_uses(), [&](std::span<const EdgeUse> edge) {
        forward.clear();
        backward.clear();
        for (const EdgeUse& use : edge) {
            const Facing facing = surface.facing[use.triangle];
            if (facing != Facing::no) (use.forward == (facing == Facing::as_wound) ? forward : backward).push_back(side_of(use));
        }
        for (std::size_t i = 0; i < std::max(forward.size(), backward.size()); ++i) {
            const std::uint32_t f = i < forward.size() ? forward[i] : no_side, b = i < backward.size() ? backward[i] : no_side;
            if (f != no_side) surface.across[f] = b;
            if (b != no_side) surface.across[b] = f;
            if (f == no_side || b == no_side) surface.border.push_back(f == no_side ? b : f);
        }
    });
    return surface;
}

// Lists the facing triangles sheet after sheet; returns the sheet of every triangle.
std::vector<std::uint32_t> list_sheets(const Topology& topology, const Surface& surface, Silhouette& silhouette)
{
    constexpr std::uint32_t none = 0xffffffff;
    std::vector<std::uint32_t> sheet_of(surface.triangles.size(), none);
    std::vector<std::uint32_t> reached;
    for (std::uint32_t first = 0; first < surface.triangles.size(); ++first) {
        if (surface.facing[first] == Facing::no || sheet_of[first] != none) continue;
        const auto sheet = static_cast<std::uint32_t>(silhouette.facing_begin.size());
        silhouette.facing_begin.push_back(static_cast<std::uint32_t>(reached.size()));
        sheet_of[first] = sheet;
        reached.push_back(first);
        std::size_t turned = 0;
        for (std::size_t i = reached.size() - 1; i < reached.size(); ++i) {
            turned += surface.turned(reached[i]);
            for (std::uint32_t corner = 0; corner < 3; ++corner) {
                const std::uint32_t other = surface.across[3 * reached[i] + corner];
                if (other == no_side || sheet_of[other / 3] != none) continue;
                sheet_of[other / 3] = sheet;
                reached.push_back(other / 3);
            }
        }
        const std::size_t count = reached.size() - silhouette.facing_begin.back();
        silhouette.sides.push_back({.component = topology.component(first), .turned = 2 * turned > count});
    }
    silhouette.facing_begin.push_back(static_cast<std::uint32_t>(reached.size()));

    silhouette.facing.reserve(reached.size());
    for (const std::uint32_t i : reached) {
        const Triangle& t = surface.triangles[i];
        silhouette.facing.push_back(surface.turned(i) ? Triangle{t[0], t[2], t[1]} : t);
    }
    silhouette.facing_numbers = std::move(reached);
    return sheet_of;
}

// Links the border's sides into loops. From a side that ends at a vertex, cross the triangles of the fan around that vertex until one's
// side is on the border. Each step can be undone, so no side is reached from two others, and none turns in circles.
void link_loops(Surface& surface, std::span<const std::uint32_t> sheet_of, Silhouette& silhouette)
{
    constexpr std::uint32_t taken = no_side - 1; // no number of a side: Topology bounds them
    silhouette.edges.reserve(surface.border.size());
    for (const std::uint32_t first : surface.border) {
        if (surface.across[first] == taken) continue;
        silhouette.loop_begin.push_back(static_cast<std::uint32_t>(silhouette.edges.size()));
        for (std::uint32_t side = first; surface.across[side] != taken;) {
            surface.across[side] = taken;
            silhouette.edges.push_back({.from = surface.from(side), .to = surface.to(side), .sheet = sheet_of[side / 3]});
            side = surface.next(side);
            while (surface.across[side] < taken) side = surface.next(surface.across[side]);
        }
    }
    silhouette.loop_begin.push_back(static_cast<std::uint32_t>(silhouette.edges.size()));
}

} // namespace

Silhouette silhouette_of(const Topology& topology, const Vec3& point)
{
    if (!std::isfinite(point.x) || !std::isfinite(point.y) || !std::isfinite(point.z))
        throw Error(ErrorCode::invalid_input,
                    "silhouette: the point (" + std::to_string(point.x) + ", " + std::to_string(point.y) + ", " + std::to_string(point.z) +
                        ") is not finite",
                    "expected finite numbers");
    Silhouette silhouette;
    Surface surface = surface_of(topology, point);
    const std::vector<std::uint32_t> sheet_of = list_sheets(topology, surface, silhouette);
    link_loops(surface, sheet_of, silhouette);
    return silhouette;
}

} // namespace penumbra
