// What holds for the silhouette of anything, checked by brute force.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "silhouette/shapes.hpp"

namespace penumbra::test {

using Vec3l = Imath::Vec3<long double>;
using Chain = std::map<std::pair<std::uint32_t, std::uint32_t>, int>; // (low, high): times from low to high less times back

inline void pass(Chain& chain, std::uint32_t from, std::uint32_t to, int times = 1)
{
    int& count = chain[{std::min(from, to), std::max(from, to)}];
    count += from < to ? times : -times;
    if (count == 0) chain.erase({std::min(from, to), std::max(from, to)});
}

inline Chain boundary(std::span<const Triangle> triangles)
{
    Chain chain;
    for (const Triangle& t : triangles)
        for (std::size_t c = 0; c < 3; ++c) pass(chain, t[c], t[(c + 1) % 3]);
    return chain;
}

// The same cycle of vertices, begun at the smallest.
inline Triangle rotated(Triangle t)
{
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
}

// Six times the volume of point and triangle, negative where it is seen counter-clockwise; and how far double may be off: each factor is a
// difference rounded once (2^-53 of itself), and six products of three, each below |a| |b| |c|, are rounded and added, at most 8 roundings
// a product: (3 + 8) * 6 = 66 in all.
inline std::pair<long double, long double> volume_of(const Topology& topology, const Triangle& t, const Vec3& point)
{
    const auto v = topology.vertices();
    const Vec3l p(point), a = Vec3l(v[t[0]]) - p, b = Vec3l(v[t[1]]) - p, c = Vec3l(v[t[2]]) - p;
    const long double lengths = std::sqrt(a.dot(a)) * std::sqrt(b.dot(b)) * std::sqrt(c.dot(c));
    return {a.dot(b.cross(c)), 66 * 0x1p-53L * lengths};
}

inline void expect_facing(const Topology& topology, const Vec3& point, const Silhouette& silhouette)
{
    std::multiset<Triangle> found;
    for (const Triangle& t : silhouette.facing) found.insert(rotated(t));
    EXPECT_EQ(found.size(), silhouette.facing.size());
    for (std::uint32_t i = 0; i < topology.triangles().size(); ++i) {
        const Triangle t = topology.triangles()[i], other = {t[0], t[2], t[1]};
        const auto [volume, error] = volume_of(topology, t, point);
        const bool seen = found.contains(rotated(t)), seen_turned = found.contains(rotated(other));
        if (seen)
            found.erase(found.find(rotated(t)));
        else if (seen_turned && !topology.closed(i))
            found.erase(found.find(rotated(other)));
        EXPECT_TRUE(volume >= -error || seen) << "triangle " << i;
        EXPECT_TRUE(volume <= error || topology.closed(i) || seen_turned) << "triangle " << i;
        EXPECT_FALSE(volume > error && topology.closed(i) && seen) << "triangle " << i;
    }
    EXPECT_TRUE(found.empty()) << "facing triangles that the topology does not have";
}

// As many edges come to each vertex as go; returns how many edges meet at each.
inline std::map<std::uint32_t, int> expect_even_degrees(const Silhouette& silhouette)
{
    std::map<std::uint32_t, int> degree, net;
    for (const SilhouetteEdge& e : silhouette.edges) {
        ++degree[e.from], ++degree[e.to];
        ++net[e.from], --net[e.to];
    }
    for (const auto& [vertex, n] : net) EXPECT_EQ(n, 0) << "vertex " << vertex;
    return degree;
}

inline void expect_loops(const Silhouette& s)
{
    ASSERT_FALSE(s.loop_begin.empty());
    EXPECT_EQ(s.loop_begin.front(), 0u);
    EXPECT_EQ(s.loop_begin.back(), s.edges.size());
    for (std::size_t i = 0; i < s.loops(); ++i) {
        const std::uint32_t begin = s.loop_begin[i], end = s.loop_begin[i + 1];
        ASSERT_GE(end, begin + 3) << "loop " << i;
        for (std::uint32_t e = begin; e < end; ++e) {
            EXPECT_EQ(s.edges[e].to, s.edges[e + 1 < end ? e + 1 : begin].from) << "loop " << i;
            EXPECT_EQ(s.edges[e].sheet, s.edges[begin].sheet) << "loop " << i;
        }
    }
}

// Each sheet hangs together by shared edges, and its edges are its boundary, every facing triangle on the left of its own.
inline void expect_sheets(const Silhouette& s)
{
    ASSERT_FALSE(s.facing_begin.empty());
    EXPECT_EQ(s.facing_begin.front(), 0u);
    EXPECT_EQ(s.facing_begin.back(), s.facing.size());
    std::vector<Chain> border(s.sheets());
    for (const SilhouetteEdge& e : s.edges) pass(border.at(e.sheet), e.from, e.to);
    for (std::size_t sheet = 0; sheet < s.sheets(); ++sheet) {
        const std::span all(s.facing);
        const auto triangles = all.subspan(s.facing_begin[sheet], s.facing_begin[sheet + 1] - s.facing_begin[sheet]);
        ASSERT_FALSE(triangles.empty());
        EXPECT_EQ(boundary(triangles), border[sheet]) << "sheet " << sheet;

        std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::size_t>> beside;
        for (std::size_t i = 0; i < triangles.size(); ++i)
            for (std::size_t c = 0; c < 3; ++c) beside[std::minmax(triangles[i][c], triangles[i][(c + 1) % 3])].push_back(i);
        std::vector<std::uint8_t> reached(triangles.size(), 0);
        std::vector<std::size_t> todo{0};
        reached[0] = 1;
        std::size_t count = 1;
        while (!todo.empty()) {
            const Triangle t = triangles[todo.back()];
            todo.pop_back();
            for (std::size_t c = 0; c < 3; ++c)
                for (const std::size_t i : beside[std::minmax(t[c], t[(c + 1) % 3])])
                    if (reached[i] == 0) {
                        reached[i] = 1;
                        ++count;
                        todo.push_back(i);
                    }
        }
        EXPECT_EQ(count, triangles.size()) << "sheet " << sheet << " is in pieces";
    }
}

// Everything; returns the silhouette.
inline Silhouette checked(const Topology& topology, const Vec3& point)
{
    const Silhouette silhouette = silhouette_of(topology, point);
    expect_facing(topology, point, silhouette);
    Chain edges;
    for (const SilhouetteEdge& e : silhouette.edges) pass(edges, e.from, e.to);
    EXPECT_EQ(edges, boundary(silhouette.facing));
    // None of them cancelled: an edge stands there as often as it counts.
    std::size_t times = 0;
    for (const auto& [edge, count] : edges) times += static_cast<std::size_t>(std::abs(count));
    EXPECT_EQ(times, silhouette.edges.size());
    expect_even_degrees(silhouette);
    expect_loops(silhouette);
    expect_sheets(silhouette);
    return silhouette;
}

// Triangles counter-clockwise seen from the point less those clockwise that a ray from there passes, in double; `point` and `direction` are
// random, so that no ray meets an edge.
inline int crossings(const Topology& topology, std::span<const Triangle> triangles, const Vec3& point, const Vec3& direction)
{
    int count = 0;
    for (const Triangle& t : triangles) {
        const auto v = topology.vertices();
        const Vec3 a = Vec3(v[t[0]]) - point, b = Vec3(v[t[1]]) - point, c = Vec3(v[t[2]]) - point;
        const double ab = direction.dot(a.cross(b)), bc = direction.dot(b.cross(c)), ca = direction.dot(c.cross(a));
        // Inside where the ray passes all sides on one hand. Then it points at the triangle or away from it.
        if (!((ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0))) continue;
        const Vec3 normal = (b - a).cross(c - a);
        if (normal.dot(a) / normal.dot(direction) <= 0) continue;
        count += normal.dot(direction) < 0 ? 1 : -1;
    }
    return count;
}

// How often the loops wind around the ray, counter-clockwise as the point sees them. All must lie before the plane through the point across
// the ray: angles add up, as 2 pi for each turn.
inline int winding_number(const Topology& topology, const Silhouette& silhouette, const Vec3& point, const Vec3& direction)
{
    const Vec3 z = direction.normalized(), x = z.cross(std::abs(z.x) < 0.5 ? Vec3(1, 0, 0) : Vec3(0, 1, 0)).normalized(), y = x.cross(z);
    double angle = 0;
    for (const SilhouetteEdge& e : silhouette.edges) {
        const Vec3 a = Vec3(topology.vertices()[e.from]) - point, b = Vec3(topology.vertices()[e.to]) - point;
        EXPECT_GT(a.dot(z), 0);
        EXPECT_GT(b.dot(z), 0);
        const double ax = a.dot(x) / a.dot(z), ay = a.dot(y) / a.dot(z), bx = b.dot(x) / b.dot(z), by = b.dot(y) / b.dot(z);
        angle += std::atan2(ax * by - ay * bx, ax * bx + ay * by);
    }
    return static_cast<int>(std::lround(angle / (2 * std::numbers::pi)));
}

} // namespace penumbra::test
