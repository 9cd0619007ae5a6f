#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <penumbra/error.hpp>

#include "scene/memory.hpp"
#include "scene/weld.hpp"
#include "silhouette/edges.hpp"

namespace penumbra {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using EdgeUse = Topology::EdgeUse;

constexpr double bytes_per_triangle = 250; // at the most, while it is made

bool finite(const Imath::V3f& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// Differences of float32 have at most 25 bits unless their exponents lie far apart, so that their products are exact in double.
bool has_area(const Imath::V3f& a, const Imath::V3f& b, const Imath::V3f& c)
{
    if (a == b || b == c || c == a) return false;
    return (Vec3(b) - Vec3(a)).cross(Vec3(c) - Vec3(a)) != Vec3(0, 0, 0);
}

void check_sizes(std::span<const TriangleMesh* const> meshes)
{
    std::uint64_t triangles = 0;
    for (std::size_t m = 0; m < meshes.size(); ++m) {
        triangles += meshes[m]->triangles.size();
        const std::size_t positions = meshes[m]->positions.size();
        for (std::size_t t = 0; t < meshes[m]->triangles.size(); ++t)
            for (const std::uint32_t index : meshes[m]->triangles[t])
                if (index >= positions)
                    throw Error(ErrorCode::invalid_input,
                                "mesh " + std::to_string(m) + ", triangle " + std::to_string(t) + ": vertex " + std::to_string(index) +
                                    " of " + std::to_string(positions),
                                "expected indices below the number of positions");
    }
    // Sides are numbered in 32 bits. Vertices are fewer: each belongs to a side.
    if (3 * triangles >= no_side)
        throw Error(ErrorCode::too_large, "meshes: " + std::to_string(triangles) + " triangles",
                    "expected fewer than " + std::to_string(no_side / 3));
    require_memory(bytes_per_triangle * static_cast<double>(triangles), "the edges of " + std::to_string(triangles) + " triangles");
}

// Ordered by (low, high, triangle): buckets by the lower vertex, in order within, as they are small.
std::vector<EdgeUse> sorted_edge_uses(std::span<const Triangle> triangles, std::size_t vertices)
{
    std::vector<std::uint32_t> begin(vertices + 1, 0);
    const auto next = [](std::size_t corner) { return corner == 2 ? 0 : corner + 1; };
    for (const Triangle& t : triangles)
        for (std::size_t c = 0; c < 3; ++c) ++begin[std::min(t[c], t[next(c)]) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());

    std::vector<EdgeUse> uses(3 * triangles.size());
    std::vector<std::uint32_t> end(begin.begin(), begin.end() - 1);
    for (std::size_t i = 0; i < triangles.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t from = triangles[i][c], to = triangles[i][next(c)];
            uses[end[std::min(from, to)]++] = {.low = std::min(from, to),
                                               .high = std::max(from, to),
                                               .triangle = static_cast<std::uint32_t>(i),
                                               .corner = static_cast<std::uint8_t>(c),
                                               .forward = from < to};
        }
    for (std::size_t v = 0; v < vertices; ++v)
        std::sort(uses.begin() + begin[v], uses.begin() + begin[v + 1],
                  [](const EdgeUse& a, const EdgeUse& b) { return a.high != b.high ? a.high < b.high : a.triangle < b.triangle; });
    return uses;
}

// Triangles joined by edges of exactly two.
struct Patches {
    std::vector<std::uint32_t> of;    // the patch of each triangle
    std::vector<std::uint8_t> turned; // triangles to turn so that every patch is wound alike, if it can be
    std::size_t count = 0;
};

// One that cannot be wound alike (a Moebius strip) keeps an edge that two triangles pass the same way; so it comes out open.
Patches patches_of(std::span<const EdgeUse> uses, std::size_t triangles)
{
    // What lies across each side, and whether it passes the edge the same way, so that one of the two has to be turned.
    struct Neighbour {
        std::uint32_t triangle = no_side;
        bool same_way = false;
    };
    std::vector<Neighbour> across(3 * triangles);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() != 2) return;
        const bool same_way = edge[0].forward == edge[1].forward;
        across[side_of(edge[0])] = {edge[1].triangle, same_way};
        across[side_of(edge[1])] = {edge[0].triangle, same_way};
    });

    Patches patches{.of = std::vector<std::uint32_t>(triangles, no_side), .turned = std::vector<std::uint8_t>(triangles, 0), .count = 0};
    std::vector<std::uint32_t> reached;
    for (std::uint32_t first = 0; first < triangles; ++first) {
        if (patches.of[first] != no_side) continue;
        const auto patch = static_cast<std::uint32_t>(patches.count++);
        reached.assign(1, first);
        patches.of[first] = patch;
        for (std::size_t i = 0; i < reached.size(); ++i)
            for (std::uint32_t c = 0; c < 3; ++c) {
                const std::uint32_t t = reached[i];
                const Neighbour n = across[3 * t + c];
                if (n.triangle == no_side || patches.of[n.triangle] != no_side) continue;
                patches.of[n.triangle] = patch;
                patches.turned[n.triangle] = static_cast<std::uint8_t>(patches.turned[t] ^ static_cast<std::uint8_t>(n.same_way));
                reached.push_back(n.triangle);
            }
    }
    return patches;
}

// For every label (of triangles) whether some edge is passed more often one way than the other by its triangles.
std::vector<std::uint8_t> open_labels(std::span<const EdgeUse> uses, std::span<const std::uint32_t> label_of, std::size_t labels)
{
    std::vector<std::uint8_t> open(labels, 0);
    std::vector<std::pair<std::uint32_t, int>> passes;
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        passes.clear();
        for (const EdgeUse& use : edge) passes.emplace_back(label_of[use.triangle], use.forward ? 1 : -1);
        std::sort(passes.begin(), passes.end());
        for (std::size_t i = 0; i < passes.size();) {
            const std::uint32_t label = passes[i].first;
            int net = 0;
            for (; i < passes.size() && passes[i].first == label; ++i) net += passes[i].second;
            if (net != 0) open[label] = 1;
        }
    });
    return open;
}

// Joins the open patches that meet at an edge under one label (that of one of them); closed ones keep their own.
void join_open_patches(std::span<const EdgeUse> uses, std::span<const std::uint8_t> open, std::vector<std::uint32_t>& patch_of)
{
    std::vector<std::uint32_t> parent(open.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t p) {
        while (parent[p] != p) p = parent[p] = parent[parent[p]];
        return p;
    };
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() <= 2) return;
        std::uint32_t first = no_side;
        for (const EdgeUse& use : edge) {
            const std::uint32_t patch = patch_of[use.triangle];
            if (open[patch] == 0) continue;
            if (first == no_side) first = patch;
            parent[root(patch)] = root(first);
        }
    });
    for (std::uint32_t& patch : patch_of) patch = root(patch);
}

} // namespace

Topology::Topology(std::span<const TriangleMesh* const> meshes)
{
    check_sizes(meshes);

    // Keep what has an area, each place once a mesh.
    for (const TriangleMesh* mesh : meshes) {
        check_stop();
        Welder weld(vertices_, mesh->positions.size());
        for (const Triangle& t : mesh->triangles) {
            const Imath::V3f &a = mesh->positions[t[0]], &b = mesh->positions[t[1]], &c = mesh->positions[t[2]];
            if (finite(a) && finite(b) && finite(c) && has_area(a, b, c)) {
                const std::uint32_t va = weld(a), vb = weld(b), vc = weld(c);
                triangles_.push_back({va, vb, vc});
            } else {
                ++left_out_;
            }
        }
    }

    // Find the edges.
    edge_uses_ = sorted_edge_uses(triangles_, vertices_.size());
    for_each_edge(edge_uses_, [this](std::span<const EdgeUse> edge) {
        open_edges_ += edge.size() == 1;
        nonmanifold_edges_ += edge.size() > 2;
    });

    // Wind each patch alike, find which components are closed: single patches, then what the open ones make together.
    Patches patches = patches_of(edge_uses_, triangles_.size());
    turn(patches.turned);
    std::vector<std::uint8_t> open = open_labels(edge_uses_, patches.of, patches.count);
    join_open_patches(edge_uses_, open, patches.of);
    open = open_labels(edge_uses_, patches.of, patches.count);
    component_ = patches.of;
    closed_.resize(triangles_.size());
    for (std::size_t t = 0; t < triangles_.size(); ++t) closed_[t] = open[patches.of[t]] == 0;

    // Turn those inside out whose signed volume, seen from a vertex of their own, is negative.
    std::vector<double> volume(patches.count, 0);
    std::vector<std::uint32_t> origin(patches.count, no_side);
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        const Triangle& t = triangles_[i];
        std::uint32_t& from = origin[patches.of[i]];
        if (from == no_side) from = t[0];
        const Vec3 o(vertices_[from]);
        volume[patches.of[i]] += (Vec3(vertices_[t[0]]) - o).dot((Vec3(vertices_[t[1]]) - o).cross(Vec3(vertices_[t[2]]) - o));
    }
    for (std::size_t t = 0; t < triangles_.size(); ++t) patches.turned[t] = closed_[t] != 0 && volume[patches.of[t]] < 0;
    turn(patches.turned);
}

void Topology::turn(const std::vector<std::uint8_t>& turned)
{
    for (std::size_t t = 0; t < triangles_.size(); ++t)
        if (turned[t] != 0) std::swap(triangles_[t][1], triangles_[t][2]);
    // a b c becomes a c b: side b c stays the middle one, the other two change places.
    for (EdgeUse& use : edge_uses_)
        if (turned[use.triangle] != 0) {
            use.forward = !use.forward;
            use.corner = static_cast<std::uint8_t>(2 - use.corner);
        }
}

std::uint64_t Topology::bytes() const
{
    return vertices_.capacity() * sizeof(vertices_[0]) + triangles_.capacity() * sizeof(triangles_[0]) + closed_.capacity() +
           component_.capacity() * sizeof(component_[0]) + edge_uses_.capacity() * sizeof(edge_uses_[0]);
}

} // namespace penumbra
