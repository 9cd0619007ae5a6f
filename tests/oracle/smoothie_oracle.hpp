// Smoothies in double precision, as the paper constructs them (section 3): a rectangle for each silhouette edge, outwards, and a corner
// between the rectangles beside each vertex, everything in the light's image.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <Imath/ImathVec.h>

namespace penumbra::oracle::smoothie {

using Point = Imath::V2d; // tangents of the light's image

// What faces the light lies on the left of an edge.
struct Edge {
    Point a, b;
    double d_a, d_b; // disparities
};

struct Corner {
    Point v;
    double d;
    Point from, to; // counter-clockwise from the one normal to the other, at most half a turn
};

struct Fins {
    std::vector<Edge> rectangles;
    std::vector<Corner> corners;
};

inline double cross(const Point& a, const Point& b) { return a.x * b.y - a.y * b.x; }
inline Point outward(const Edge& e)
{
    const Point along = (e.b - e.a).normalized();
    return {along.y, -along.x};
}

// Around a vertex edges follow each other by angle. Where two have free space of more than half a turn between them, their rectangles leave
// a gap between their normals: the corner. Of more than two edges the paper fills it by triangles to the averaged normal; here the gap is
// one corner, whose alpha is the same.
inline Fins fins_of(const std::vector<Edge>& edges)
{
    Fins fins{.rectangles = edges, .corners = {}};
    struct Spoke {
        double angle; // of the edge away from the vertex
        Point normal;
        bool ends; // here: counter-clockwise of it, seen from the vertex, is outside
    };
    std::map<std::pair<double, double>, std::pair<double, std::vector<Spoke>>> vertices;
    for (const Edge& e : edges) {
        const Point out = outward(e), along = e.b - e.a;
        auto& begin = vertices[{e.a.x, e.a.y}];
        begin.first = e.d_a;
        begin.second.push_back({std::atan2(along.y, along.x), out, false});
        auto& end = vertices[{e.b.x, e.b.y}];
        end.first = e.d_b;
        end.second.push_back({std::atan2(-along.y, -along.x), out, true});
    }
    for (auto& [place, vertex] : vertices) {
        std::vector<Spoke>& spokes = vertex.second;
        std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) { return a.angle < b.angle; });
        for (std::size_t i = 0; i < spokes.size(); ++i) {
            const Spoke &one = spokes[i], &next = spokes[(i + 1) % spokes.size()];
            double gap = next.angle - one.angle;
            if (gap <= 0) gap += 2 * std::numbers::pi;
            if (one.ends && !next.ends && gap > std::numbers::pi)
                fins.corners.push_back({{place.first, place.second}, vertex.first, one.normal, next.normal});
        }
    }
    return fins;
}

struct Width {
    double t;                                                                                 // fixed: t as a tangent; 0: from the light
    double light;                                                                             // half the light's size
    double at(double b, double r) const { return t > 0 ? t * (1 - r / b) : light * (b - r); } // disparities: Eq. 1's 1 - b / r of depths
};

struct Alpha {
    double alpha = 1, d = 0; // d of the fin; 0: there is none
};

// The same of edges by their distance as segments, on their outer side: what the kernels construct. Fins reach half a turn around their
// ends.
inline Alpha alpha_of_segments(const std::vector<Edge>& edges, const Width& width, const Point& p, double r, double blocker)
{
    Alpha least;
    for (const Edge& e : edges) {
        const Point along = e.b - e.a, from = p - e.a;
        if (from.dot(outward(e)) < 0) continue;
        const double part = std::clamp(from.dot(along) / along.length2(), 0.0, 1.0), b = e.d_a + part * (e.d_b - e.d_a);
        const double distance = (from - along * part).length(), w = width.at(b, r);
        if (w > 0 && b >= blocker && distance < w && distance / w < least.alpha) least = {.alpha = distance / w, .d = b};
    }
    return least;
}

// The least alpha at `p` of fins that reach it, of a receiver at disparity `r`, before the map's `blocker`.
inline Alpha alpha_at(const Fins& fins, const Width& width, const Point& p, double r, double blocker)
{
    Alpha least;
    const auto meet = [&](double distance, double b) {
        const double w = width.at(b, r);
        if (w <= 0 || b < blocker || distance >= w || distance / w >= least.alpha) return;
        least.alpha = distance / w;
        least.d = b;
    };
    for (const Edge& e : fins.rectangles) {
        const Point along = e.b - e.a, from = p - e.a;
        const double part = from.dot(along) / along.length2(), out = from.dot(outward(e));
        if (part >= 0 && part <= 1 && out >= 0) meet(out, e.d_a + part * (e.d_b - e.d_a));
    }
    for (const Corner& c : fins.corners) {
        const Point from = p - c.v;
        if (cross(c.from, from) >= 0 && cross(from, c.to) >= 0) meet(from.length(), c.d);
    }
    return least;
}

} // namespace penumbra::oracle::smoothie
