#include "technique/linear_wedges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "scene/stop.hpp"

namespace penumbra {
namespace {

constexpr double unbounded_reach = 0x1p60;

// Below this cosine of half the turn from one edge to the next a corner has no plane of its own. Planes come out of binary32 with 2^-24,
// and what divides by the corner's half angle (where the side plane cuts the edge, and how far that is) does so twice: 2^-24 * 2^12 is half
// a level of 8 bits.
constexpr double least_mitre = 0x1p-6;

// Lengths are counted in radii of the sphere around the part's centre, so that planes are measured as the paper does. Back: tangents and
// disparities of the part are `scale` and `scale_u` times less.
struct Space {
    const Topology& topology;
    const LightFrame& light;
    const LightPart& part;
    Vec2 scale;
    double scale_u;
    Vec3 radii; // of the part's units

    Space(const Topology& t, const LightFrame& l, const LightPart& p) : topology(t), light(l), part(p)
    {
        const double radius = l.shape == LightShape::disc ? p.half.x : std::hypot(p.half.x, p.half.y);
        scale = {p.half.x / p.half.z, p.half.y / p.half.z};
        scale_u = radius / p.half.z;
        radii = p.half / radius;
    }
    Vec3 in_part(std::uint32_t vertex) const { return point_in_part(light, part, Vec3(topology.vertices()[vertex])); }
    Vec3 operator()(std::uint32_t vertex) const { return in_part(vertex) * radii; }
};

// A side plane through a wedge's end, normal . x = offset; neighbours have the same numbers.
struct SidePlane {
    Vec3 normal{0, 0, 0};
    double offset = 0;
    double scale = 0;          // makes normal . x - offset the distance along the edge, not negative inside
    double front_weight = 0.5; // t_b's in s of this side
};

struct Wedge {
    std::uint32_t from = 0, to = 0, sheet = 0;
    Vec3 a, b;          // ends
    Vec3 normal;        // of the hard quad, to the lit side
    Vec3 middle;        // middle . t: disparity of the edge along the hard quad. Front and back plane: (middle -+ normal) . x = 1
    Vec3 along;         // unit, along the edge
    double noise = 0;   // of the normal's direction, by rounding of the vertices
    bool exists = true; // else it points at the light's centre
    std::array<SidePlane, 2> sides;
};

Wedge wedge_of(const Space& space, const SilhouetteEdge& edge)
{
    Wedge wedge{.from = edge.from,
                .to = edge.to,
                .sheet = edge.sheet,
                .a = space(edge.from),
                .b = space(edge.to),
                .normal = {},
                .middle = {},
                .along = {},
                .sides = {}};
    const Vec3 across = wedge.b.cross(wedge.a), step = wedge.b - wedge.a;
    const double twice_area = across.length();
    // Vertices are rounded by 2^-24 of their coordinates: the normal turns by no more than 2^-23 |a| |b| / twice the area (and as much
    // again where the part's units differ). 16 times that, and it is known to 1/16 of a radius.
    wedge.noise = 0x1p-22 * wedge.a.length() * wedge.b.length() / twice_area;
    wedge.exists = wedge.noise < 0x1p-4;
    if (!wedge.exists) return wedge;
    wedge.normal = across / twice_area;
    wedge.middle = wedge.normal.cross(step) / twice_area;
    wedge.along = step.normalized();
    return wedge;
}

// How far one turns from a normal to the next, 0 to pi.
double turn_between(const Vec3& a, const Vec3& b) { return 2 * std::atan2((a - b).length(), (a + b).length()); }

// The wedges at the corner between two, in order.
std::vector<Wedge> corner_wedges(const Wedge& before, const Wedge& after, int most)
{
    std::vector<Wedge> wedges;
    if (before.to != after.from) return wedges;
    const double turn = turn_between(before.normal, after.normal), right = std::numbers::pi / 2;
    if (!(turn > right)) return wedges;
    const int count = static_cast<int>(std::ceil(most * (turn - right) / right));
    const Vec3 vertex = before.b, ray = vertex.normalized(), forward = ray.cross(before.normal);
    // Around the tip of what casts, or of what does not; a needle has a tip.
    const double way = after.normal.dot(forward) >= -(before.noise + after.noise) ? 1 : -1;
    for (int i = 1; i <= count; ++i) {
        const double angle = turn * i / (count + 1);
        const Vec3 normal = before.normal * std::cos(angle) + forward * (way * std::sin(angle));
        wedges.push_back({.from = before.to,
                          .to = before.to,
                          .sheet = before.sheet,
                          .a = vertex,
                          .b = vertex,
                          .normal = normal,
                          .middle = vertex / vertex.dot(vertex),
                          .along = ray.cross(normal),
                          .sides = {}});
    }
    return wedges;
}

// Where the line of the wedge's front (-1) or back (1) plane and the side plane passes the light: in the plane through its centre that
// faces the vertex.
Vec3 foot(const Wedge& wedge, const Vec3& vertex, const Vec3& side, double plane)
{
    const Vec3 line = (wedge.middle + wedge.normal * plane).cross(side);
    return vertex - line * (vertex.dot(vertex) / line.dot(vertex));
}

// Whether a side plane bounds the wedge within `mitre` radii, on the right side, and cuts across it. False for what is not finite.
bool bounds(const Wedge& wedge, const Vec3& vertex, const Vec3& side, double mitre)
{
    const Vec3 across = vertex.cross(wedge.normal).normalized();
    const double cuts = side.dot(across) / side.length(), along = side.dot(wedge.along) / side.length();
    if (!(std::abs(cuts) >= least_mitre / 2) || !(along * cuts > 0)) return false;
    const Vec3 front = foot(wedge, vertex, side, -1), back = foot(wedge, vertex, side, 1);
    return front.length() <= mitre && back.length() <= mitre && front.dot(wedge.normal) < 0 && back.dot(wedge.normal) > 0;
}

// `side` as the wedge's side plane at its first end or the other.
SidePlane side_plane(const Wedge& wedge, const Vec3& vertex, const Vec3& side, bool through_centre, const Vec3& mean, bool first)
{
    const double cuts = side.dot(wedge.along);
    SidePlane plane{.normal = side, .offset = through_centre ? 0 : side.dot(vertex), .scale = (first ? 1 : -1) / cuts, .front_weight = 0.5};
    // The side direction: the mean normal in the side plane (4.1). It must cross the wedge from back to front.
    const Vec3 direction = mean - side * (mean.dot(side) / side.dot(side));
    const double front = (wedge.normal - wedge.middle).dot(direction), back = (wedge.normal + wedge.middle).dot(direction);
    if (front > 0 && back > 0) plane.front_weight = front / (front + back);
    return plane;
}

// Ends two neighbours. Returns whether they end alike.
bool join(Wedge& before, Wedge& after)
{
    const Vec3 &v = before.b, &w = after.a, mean = before.normal + after.normal;
    const double turn = turn_between(before.normal, after.normal), half_cosine = std::cos(turn / 2);
    const double mitre = 2 / std::max(half_cosine, least_mitre);
    const auto take = [&](const Vec3& at_v, const Vec3& at_w, bool through_centre, const Vec3& mean_v, const Vec3& mean_w) {
        before.sides[1] = side_plane(before, v, at_v, through_centre, mean_v, false);
        after.sides[0] = side_plane(after, w, at_w, through_centre, mean_w, true);
    };
    if (half_cosine >= least_mitre) {
        if (before.to == after.from && turn > 16 * (before.noise + after.noise)) {
            // f x b of the lines f = (m1 - n1) x (m2 - n2) and b = (m1 + n1) x (m2 + n2), without what cancels: both are nearly the ray
            // through the vertex.
            const Vec3 even = before.normal.cross(after.normal) + before.middle.cross(after.middle);
            const Vec3 odd = before.middle.cross(after.normal) + before.normal.cross(after.middle);
            const Vec3 side = even.cross(odd).normalizedNonNull();
            if (bounds(before, v, side, mitre) && bounds(after, w, side, mitre)) {
                take(side, side, false, mean, mean);
                return true;
            }
        }
        const Vec3 at_v = v.cross(mean).normalized(), at_w = w.cross(mean).normalized();
        if (bounds(before, v, at_v, mitre) && bounds(after, w, at_w, mitre)) {
            take(at_v, at_w, true, mean, mean);
            return turn <= 16 * (before.noise + after.noise);
        }
    }
    take(v.cross(before.normal).normalized(), w.cross(after.normal).normalized(), true, before.normal, after.normal);
    return false;
}

// How far the lines at one end go from it, in tangents, for each step of disparity. x, y.
Vec2 reach_of(const Wedge& wedge, std::size_t end)
{
    const Vec3& vertex = end == 0 ? wedge.a : wedge.b;
    Vec2 reach(0, 0);
    if (!(vertex.z > 0)) return reach; // its penumbra is looked for everywhere
    for (const double plane : {-1.0, 1.0}) {
        const Vec3 away = vertex - foot(wedge, vertex, wedge.sides[end].normal, plane);
        if (!(away.z > 0)) return {unbounded_reach, unbounded_reach};
        reach.x = std::max(reach.x, std::abs(vertex.z * (away.x / away.z) - vertex.x));
        reach.y = std::max(reach.y, std::abs(vertex.z * (away.y / away.z) - vertex.y));
    }
    return reach;
}

// The row of the kernel's contract, from the vertex of the lower number to the other.
std::array<float, WEDGE_PLANES> row_of(const Space& space, const Wedge& wedge, bool smooth)
{
    std::array<float, WEDGE_PLANES> row{};
    row[4] = -1; // a ray that meets no edge: disparity -1
    if (!wedge.exists) return row;
    const bool forward = wedge.from < wedge.to;
    const Vec3 a = space.in_part(forward ? wedge.from : wedge.to), b = space.in_part(forward ? wedge.to : wedge.from);
    // What plane . t is, from the tangents row[origin] on. All in the part's disparity.
    const auto origin = [&](std::size_t at, double x, double y) {
        // Far from the light's axis, and behind its plane, nothing is gained by it. (False for what is not finite.)
        const bool near = std::abs(x) < 0x1p20 && std::abs(y) < 0x1p20;
        row[at] = static_cast<float>(near ? x : 0);
        row[at + 1] = static_cast<float>(near ? y : 0);
    };
    const auto put = [&](std::size_t at, const Vec3& plane, std::size_t from) {
        const double x = plane.x * space.scale.x, y = plane.y * space.scale.y;
        row[at] = static_cast<float>(x / space.scale_u);
        row[at + 1] = static_cast<float>(y / space.scale_u);
        row[at + 2] =
            static_cast<float>((x * static_cast<double>(row[from]) + y * static_cast<double>(row[from + 1]) + plane.z) / space.scale_u);
    };
    origin(0, (a.x / a.z + b.x / b.z) / 2, (a.y / a.z + b.y / b.z) / 2);
    put(2, wedge.middle, 0);
    put(5, wedge.normal * (forward ? 1 : -1), 0);
    for (std::size_t end = 0; end < 2; ++end) {
        const SidePlane& side = wedge.sides[forward ? end : 1 - end];
        const std::size_t at = 8 + 7 * end;
        const Vec3& vertex = end == 0 ? a : b;
        origin(at, vertex.x / vertex.z, vertex.y / vertex.z);
        put(at + 2, side.normal, at);
        row[at + 5] = static_cast<float>(-side.offset);
        row[at + 6] = static_cast<float>(side.scale);
        row[22 + end] = static_cast<float>(forward ? side.front_weight : 1 - side.front_weight);
    }
    row[24] = smooth ? 1 : 0;
    row[25] = wedge.from == wedge.to ? 1 : 0;
    return row;
}

} // namespace

LinearWedges linear_wedges(const Topology& topology, Silhouette silhouette, const LightFrame& light, const LightPart& part, bool smooth,
                           int most_at_corners)
{
    const Space space(topology, light, part);
    LinearWedges result;
    std::vector<SilhouetteEdge> edges;
    std::vector<std::uint32_t> loop_begin;
    for (std::size_t loop = 0; loop < silhouette.loops(); ++loop) {
        loop_begin.push_back(static_cast<std::uint32_t>(edges.size()));
        std::vector<Wedge> ring, without;
        for (std::uint32_t i = silhouette.loop_begin[loop]; i < silhouette.loop_begin[loop + 1]; ++i) {
            if (i % 1024 == 0) check_stop();
            Wedge wedge = wedge_of(space, silhouette.edges[i]);
            (wedge.exists ? ring : without).push_back(std::move(wedge));
        }
        result.left_out += without.size();

        std::vector<Wedge> wedges;
        check_stop();
        for (std::size_t i = 0; i < ring.size(); ++i) {
            wedges.push_back(ring[i]);
            const std::vector<Wedge> corner = corner_wedges(ring[i], ring[(i + 1) % ring.size()], most_at_corners);
            result.corner_wedges += corner.size();
            wedges.insert(wedges.end(), corner.begin(), corner.end());
        }
        for (std::size_t i = 0; i < wedges.size(); ++i)
            if (!join(wedges[i], wedges[(i + 1) % wedges.size()])) ++result.unshared;
        wedges.insert(wedges.end(), without.begin(), without.end());

        for (const Wedge& wedge : wedges) {
            edges.push_back({.from = wedge.from, .to = wedge.to, .sheet = wedge.sheet});
            const auto row = row_of(space, wedge, smooth);
            result.planes.insert(result.planes.end(), row.begin(), row.end());
            if (!wedge.exists) continue;
            for (std::size_t end = 0; end < 2; ++end) {
                const Vec2 reach = reach_of(wedge, end);
                result.reach_x = std::max(result.reach_x, reach.x * space.scale_u / space.scale.x);
                result.reach_y = std::max(result.reach_y, reach.y * space.scale_u / space.scale.y);
            }
        }
    }
    loop_begin.push_back(static_cast<std::uint32_t>(edges.size()));
    result.reach_x = std::min(result.reach_x, unbounded_reach);
    result.reach_y = std::min(result.reach_y, unbounded_reach);
    silhouette.edges = std::move(edges);
    silhouette.loop_begin = std::move(loop_begin);
    result.silhouette = std::move(silhouette);
    return result;
}

std::vector<float> planes_in_order(const LinearWedges& wedges, const WedgeData& data)
{
    std::vector<float> planes(std::max<std::size_t>(data.edge_sources.size(), 1) * WEDGE_PLANES, 0.0F);
    for (std::size_t i = 0; i < data.edge_sources.size(); ++i) {
        if (data.edge_sources[i] == no_edge) {
            planes[i * WEDGE_PLANES + 4] = -1;
            continue;
        }
        const auto from = wedges.planes.begin() + static_cast<std::ptrdiff_t>(data.edge_sources[i]) * WEDGE_PLANES;
        std::copy(from, from + WEDGE_PLANES, planes.begin() + static_cast<std::ptrdiff_t>(i) * WEDGE_PLANES);
    }
    return planes;
}

} // namespace penumbra
