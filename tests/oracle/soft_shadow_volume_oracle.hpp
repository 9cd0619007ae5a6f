// Soft shadow volumes in double precision, without wedges: by Green's theorem the hard shadow less all edges' shares is the signed area, on
// the light, of the triangles that face its centre, projected from the receiver. Each is clipped to what lies before the light's plane and
// before the receiver, projected, cut with the light, and added; no hard shadow, no silhouette, no culling.
//
// Units: half extents of the light (the radius of a disc), as in the kernel, so that the light is [-1, 1]^2 or the unit disc.
//
// The bound on what binary32 may make of it, for each edge that projects on the light. Every coordinate that comes in (vertices, tangents,
// disparity) and every operation rounds by at most e = 2^-24 of the larger of its terms. In homogeneous coordinates (X, Y, W) those are at
// most M = max(|x| + |z t|, |y| + |z t|, 1 + |z d|) over both ends. Rounded are: vertex, tangent, disparity, product and sum (5); the
// difference of the ends (1); the two values that a clip compares, their difference and quotient, on up to two clips (8), and the point
// itself, its reciprocal and product (3): 17 times 2 M e at the most, over the least W on the light. An end that moves by that moves the
// share by no more, as the light is 4 or pi large and no chord longer than 2 sqrt(2). Places on the border, up to 8 around it, round by
// less than 16 e, an angle by as much, and the sum by e an edge.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra::oracle::wedge {

enum class Shape { square, disc };
enum class Joined { sum, max, half_min, product };

struct Receiver {
    Vec3 at; // light space
};

using Triangle = std::array<Vec3, 3>; // counter-clockwise as the light's centre sees it

// Homogeneous coordinates on the light, and the distance before its plane.
struct Point {
    double x, y, w, before;
};

// What of a convex polygon has f >= 0.
template <class F> std::vector<Point> clipped(const std::vector<Point>& polygon, F&& f)
{
    std::vector<Point> result;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        const double fa = f(a), fb = f(b);
        if (fa >= 0) result.push_back(a);
        if ((fa < 0) == (fb < 0)) continue;
        const double t = fa / (fa - fb);
        result.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.w + t * (b.w - a.w), a.before + t * (b.before - a.before)});
    }
    return result;
}

// Signed area of the triangle (centre, a, b) within the unit disc.
inline double in_disc(const Vec2& a, const Vec2& b)
{
    const Vec2 d = b - a;
    const double A = d.dot(d), B = a.dot(d), C = a.dot(a) - 1;
    const auto sector = [](const Vec2& p, const Vec2& q) { return std::atan2(p.cross(q), p.dot(q)) / 2; };
    const double square = B * B - A * C;
    if (A == 0) return 0;
    if (square <= 0) return sector(a, b);
    const double t0 = std::clamp((-B - std::sqrt(square)) / A, 0.0, 1.0), t1 = std::clamp((-B + std::sqrt(square)) / A, 0.0, 1.0);
    const Vec2 p = a + d * t0, q = a + d * t1;
    return (t0 > 0 ? sector(a, p) : 0) + p.cross(q) / 2 + (t1 < 1 ? sector(q, b) : 0);
}

// A frame whose z points from the light's centre to the receiver.
struct DiscFrame {
    Vec3 u, v, w;
    explicit DiscFrame(const Vec3& towards) : w(towards.normalized())
    {
        u = Vec3(0, 1, 0).cross(w).normalized();
        if (std::abs(w.y) > 0.9) u = w.cross(Vec3(1, 0, 0)).normalized();
        v = w.cross(u);
    }
};

inline Point projected(Shape shape, const Receiver& p, const Vec3& e)
{
    if (shape == Shape::square) {
        const Vec3 t = p.at / p.at.z;
        return {e.x - e.z * t.x, e.y - e.z * t.y, 1 - e.z / p.at.z, e.z};
    }
    const DiscFrame frame(p.at);
    const double along = e.dot(frame.w);
    return {e.dot(frame.u), e.dot(frame.v), 1 - along / p.at.length(), along};
}

// The share of the light that one triangle hides; negative where the receiver sees the side that the centre does not.
inline double share_of(Shape shape, const Receiver& p, const Triangle& triangle)
{
    std::vector<Point> polygon;
    for (const Vec3& corner : triangle) polygon.push_back(projected(shape, p, corner));
    polygon = clipped(polygon, [](const Point& q) { return q.before; });
    polygon = clipped(polygon, [](const Point& q) { return q.w - q.x; });
    polygon = clipped(polygon, [](const Point& q) { return q.w + q.x; });
    polygon = clipped(polygon, [](const Point& q) { return q.w - q.y; });
    polygon = clipped(polygon, [](const Point& q) { return q.w + q.y; });
    double area = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        if (!(a.w > 0) || !(b.w > 0)) continue; // the receiver itself: without extent
        const Vec2 pa(a.x / a.w, a.y / a.w), pb(b.x / b.w, b.y / b.w);
        area += shape == Shape::square ? pa.cross(pb) / 2 : in_disc(pa, pb);
    }
    return area / (shape == Shape::square ? 4 : std::numbers::pi);
}

// Green's theorem itself: the same from border edges alone, which must lie between light and receiver. The square's share of an edge is
// that of the triangle it makes with the centre.
inline double share_of_edge(Shape shape, const Receiver& p, const Vec3& from, const Vec3& to)
{
    const Point a = projected(shape, p, from), b = projected(shape, p, to);
    const Vec2 pa(a.x / a.w, a.y / a.w), pb(b.x / b.w, b.y / b.w);
    if (shape == Shape::disc) return in_disc(pa, pb) / std::numbers::pi;
    std::vector<Point> polygon{{0, 0, 1, 1}, {pa.x, pa.y, 1, 1}, {pb.x, pb.y, 1, 1}};
    polygon = clipped(polygon, [](const Point& q) { return 1 - q.x; });
    polygon = clipped(polygon, [](const Point& q) { return 1 + q.x; });
    polygon = clipped(polygon, [](const Point& q) { return 1 - q.y; });
    polygon = clipped(polygon, [](const Point& q) { return 1 + q.y; });
    double area = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Point &q = polygon[i], &r = polygon[(i + 1) % polygon.size()];
        area += (q.x * r.y - q.y * r.x) / 2;
    }
    return area / 4;
}

// The bound of above for the edges of one triangle; border edges are among them.
inline double bound_of(Shape shape, const Receiver& p, const Triangle& triangle)
{
    constexpr double e = 0x1p-24;
    double bound = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3 ends[2] = {triangle[i], triangle[(i + 1) % 3]};
        const Point a = projected(shape, p, ends[0]), b = projected(shape, p, ends[1]);
        std::vector<Point> line{a, b, b};
        line = clipped(line, [](const Point& q) { return q.before; });
        line = clipped(line, [](const Point& q) { return q.w - q.x; });
        line = clipped(line, [](const Point& q) { return q.w + q.x; });
        line = clipped(line, [](const Point& q) { return q.w - q.y; });
        line = clipped(line, [](const Point& q) { return q.w + q.y; });
        if (line.empty()) continue;
        double w = 1e300, most = 1;
        for (const Point& q : line) w = std::min(w, q.w);
        for (const Vec3& end : ends)
            most = std::max({most, std::abs(end.x) + std::abs(end.z * p.at.x / p.at.z), std::abs(end.y) + std::abs(end.z * p.at.y / p.at.z),
                             1 + std::abs(end.z / p.at.z)});
        bound += 17 * 2 * most * e / w + 17 * e;
    }
    return bound;
}

struct Bounded {
    double value = 0, bound = 0;
};

// Facing triangles that hang together; the surface they belong to, and which of its sides they are.
struct Sheet {
    std::vector<Triangle> triangles;
    std::uint32_t surface = 0;
    bool turned = false;
};

// Sheets one after the other, joined as overlap says (Paper IV, 5.1). The sum: of a surface that shows both its sides the one that hides
// more.
inline Bounded occlusion(Shape shape, const Receiver& p, const std::vector<Sheet>& sheets, Joined how)
{
    Bounded all;
    std::map<std::uint32_t, std::array<std::optional<double>, 2>> surfaces;
    for (const Sheet& sheet : sheets) {
        double one = 0;
        for (const Triangle& triangle : sheet.triangles) {
            one += share_of(shape, p, triangle);
            all.bound += bound_of(shape, p, triangle);
        }
        if (how == Joined::sum) {
            std::optional<double>& side = surfaces[sheet.surface][sheet.turned];
            side = side.value_or(0) + one;
            continue;
        }
        one = std::clamp(one, 0.0, 1.0);
        const double more = std::max(one, all.value), less = std::min(one, all.value);
        if (how == Joined::max) all.value = more;
        if (how == Joined::half_min) all.value = std::min(1.0, more + less / 2);
        if (how == Joined::product) all.value = 1 - (1 - all.value) * (1 - one);
    }
    for (const auto& [surface, sides] : surfaces)
        all.value += sides[0] && sides[1] ? std::max({0.0, *sides[0], *sides[1]}) : sides[0].value_or(0) + sides[1].value_or(0);
    all.value = std::clamp(all.value, 0.0, 1.0);
    return all;
}

} // namespace penumbra::oracle::wedge
