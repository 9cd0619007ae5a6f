#include "technique/receiver_silhouettes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/stop.hpp"
#include "technique/spatial_order.hpp"

namespace penumbra {
namespace {

constexpr std::size_t group_size = WEDGE_GROUP;
constexpr double everywhere = 1e18; // beyond any tangent and disparity that a box is compared with
constexpr float any_plane = 1e12F;  // beyond any plane's coordinates: no side is certain

// A triangle before the light's plane, its vertices as the surface winds them.
struct Face {
    std::array<std::uint32_t, 3> corners;
    bool closed; // of a closed component
};

struct Faces {
    std::vector<Vec3> points; // in the corner's light space, as binary32 has them
    std::vector<Face> faces;
};

// Cuts off what lies behind the light's plane. Both triangles at an edge meet it at one new vertex.
class Cut {
public:
    explicit Cut(Faces& all) : all_(all) {}

    void add(const Face& face)
    {
        std::vector<std::uint32_t> kept;
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t from = face.corners[i], to = face.corners[(i + 1) % 3];
            if (before(from)) kept.push_back(from);
            if (before(from) != before(to)) kept.push_back(crossing(std::min(from, to), std::max(from, to)));
        }
        for (std::size_t i = 2; i < kept.size(); ++i) all_.faces.push_back({{kept[0], kept[i - 1], kept[i]}, face.closed});
    }

private:
    bool before(std::uint32_t vertex) const { return all_.points[vertex].z > 0; }

    std::uint32_t crossing(std::uint32_t low, std::uint32_t high)
    {
        const std::uint64_t key = std::uint64_t{low} << 32 | high;
        const auto at = std::lower_bound(cuts_.begin(), cuts_.end(), key, [](const auto& cut, std::uint64_t k) { return cut.first < k; });
        if (at != cuts_.end() && at->first == key) return at->second;
        const Vec3 a = all_.points[low], b = all_.points[high];
        const Vec3 p = a + (b - a) * (a.z / (a.z - b.z));
        const auto number = static_cast<std::uint32_t>(all_.points.size());
        all_.points.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y), 0.0);
        cuts_.insert(at, {key, number});
        return number;
    }

    Faces& all_;
    std::vector<std::pair<std::uint64_t, std::uint32_t>> cuts_; // edge, its new vertex; few
};

Faces faces_of(const Topology& topology, const LightFrame& light, const LightPart& corner)
{
    Faces all;
    all.points.reserve(topology.vertices().size());
    for (const Imath::V3f& vertex : topology.vertices()) all.points.push_back(point_in_part(light, corner, Vec3(vertex)));
    const auto triangles = topology.triangles();
    all.faces.reserve(triangles.size());
    Cut cut(all);
    for (std::uint32_t i = 0; i < triangles.size(); ++i) cut.add({triangles[i], topology.closed(i)});
    return all;
}

// A face's plane N . p = D, N of length about 1, and how the kernel reads it.
struct Plane {
    std::array<float, 4> values{0, 0, 0, 0}; // N, D
    std::array<std::uint32_t, 3> corners;    // in order of their numbers
    float turn = 0;                          // `count_triangle`'s s; 0: without area
    bool corner_inside = false;
};

// Which way N points: into a closed surface, whose own points lie outside; away from the light's middle, which sees the points of another.
Plane plane_of(const Faces& all, const Face& face, bool mirrored)
{
    Plane plane{.values = {}, .corners = face.corners};
    std::sort(plane.corners.begin(), plane.corners.end());
    const auto cross_of = [&](const std::array<std::uint32_t, 3>& c) {
        return (all.points[c[1]] - all.points[c[0]]).cross(all.points[c[2]] - all.points[c[0]]);
    };
    Vec3 normal = cross_of(plane.corners);
    const double length = normal.length();
    if (!(length > 0) || !std::isfinite(length)) return plane;
    normal /= length;
    double offset = normal.dot(all.points[plane.corners[0]]);
    // Light space is mirrored, so that this points into what winds counter-clockwise seen from outside.
    const Vec3 own = cross_of(face.corners) * (mirrored ? 1.0 : -1.0);
    const bool flip = face.closed ? normal.dot(own) < 0 : 0.5 * (normal.x + normal.y) - offset > 0;
    plane.turn = flip ? -1.0F : 1.0F;
    if (flip) {
        normal = -normal;
        offset = -offset;
    }
    plane.values = {static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z), static_cast<float>(offset)};
    // On the plane the corner is moved as left_of moves it.
    const auto& [x, y, z, d] = plane.values;
    plane.corner_inside = d < 0 || (d == 0 && (x > 0 || (x == 0 && y > 0)));
    return plane;
}

// One edge and up to two of its triangles.
struct Edge {
    std::uint32_t low, high;
    std::array<std::uint32_t, 2> faces{no_edge, no_edge};
    std::array<float, 2> turns{0, 0};

    bool whole() const { return faces[1] != no_edge; }
    // It counts for receivers that are inside of the one and outside of the other, and for no others.
    bool smooth() const { return whole() && turns[0] == -turns[1]; }
};

std::vector<Edge> edges_of(std::span<const Plane> planes)
{
    struct Use {
        std::uint64_t ends; // low, high
        std::uint32_t face;
        float turn;
    };
    std::vector<Use> uses;
    uses.reserve(3 * planes.size());
    for (std::uint32_t f = 0; f < planes.size(); ++f) {
        const auto& [a, b, c] = planes[f].corners;
        const float turn = planes[f].turn;
        if (turn == 0) continue;
        const auto ends = [](std::uint64_t low, std::uint32_t high) { return low << 32 | high; };
        uses.insert(uses.end(), {{ends(a, b), f, turn}, {ends(b, c), f, turn}, {ends(a, c), f, -turn}});
    }
    check_stop();
    std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) { return a.ends != b.ends ? a.ends < b.ends : a.face < b.face; });
    check_stop();
    std::vector<Edge> edges;
    edges.reserve(uses.size() / 2);
    for (std::size_t i = 0; i < uses.size(); ++i) {
        Edge edge{.low = static_cast<std::uint32_t>(uses[i].ends >> 32), .high = static_cast<std::uint32_t>(uses[i].ends & 0xffffffffU)};
        edge.faces[0] = uses[i].face;
        edge.turns[0] = uses[i].turn;
        if (i + 1 < uses.size() && uses[i + 1].ends == uses[i].ends) {
            ++i;
            edge.faces[1] = uses[i].face;
            edge.turns[1] = uses[i].turn;
        }
        // Within a plane: every receiver is on one side of both.
        if (edge.smooth() && planes[edge.faces[0]].values == planes[edge.faces[1]].values) continue;
        edges.push_back(edge);
    }
    return edges;
}

// --- Groups -----------------

// Where a point is for culling: (x / z, y / z, 1 / z).
std::array<double, 3> place_of(const Vec3& p)
{
    const double near = p.z > 0 ? std::min(1 / p.z, everywhere) : everywhere;
    return {std::clamp(p.x * near, -everywhere, everywhere), std::clamp(p.y * near, -everywhere, everywhere), near};
}

// A box of places, and what range planes have there.
struct Box {
    std::array<double, 2> low{everywhere, everywhere}, high{-everywhere, -everywhere};
    double near = -1;
    std::array<float, 4> plane_low{any_plane, any_plane, any_plane, any_plane}, plane_high{-any_plane, -any_plane, -any_plane, -any_plane};

    void add(const std::array<double, 3>& place)
    {
        const bool unbounded = place[2] >= everywhere;
        for (std::size_t i = 0; i < 2; ++i) {
            low[i] = unbounded ? -everywhere : std::min(low[i], place[i]);
            high[i] = unbounded ? everywhere : std::max(high[i], place[i]);
        }
        near = std::max(near, place[2]);
    }
    void add_plane(const std::array<float, 4>& plane)
    {
        for (std::size_t i = 0; i < 4; ++i) {
            plane_low[i] = std::min(plane_low[i], plane[i]);
            plane_high[i] = std::max(plane_high[i], plane[i]);
        }
    }
    void add(const Box& other)
    {
        for (std::size_t i = 0; i < 2; ++i) {
            low[i] = std::min(low[i], other.low[i]);
            high[i] = std::max(high[i], other.high[i]);
        }
        near = std::max(near, other.near);
        for (std::size_t i = 0; i < 4; ++i) {
            plane_low[i] = std::min(plane_low[i], other.plane_low[i]);
            plane_high[i] = std::max(plane_high[i], other.plane_high[i]);
        }
    }
};

// Blocks of 16: low and high x, low and high y, near; with planes their ranges. What pads the last block meets nothing.
std::vector<float> blocks(const std::vector<Box>& boxes, bool planes)
{
    const std::size_t rows = planes ? 13 : 5;
    std::vector<float> floats(std::max<std::size_t>((boxes.size() + 15) / 16, 1) * rows * 16, -1.0F);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        float* const block = floats.data() + i / 16 * rows * 16 + i % 16;
        const Box& box = boxes[i];
        block[0] = static_cast<float>(box.low[0]);
        block[16] = static_cast<float>(box.high[0]);
        block[32] = static_cast<float>(box.low[1]);
        block[48] = static_cast<float>(box.high[1]);
        block[64] = static_cast<float>(box.near);
        for (std::size_t k = 0; planes && k < 4; ++k) {
            block[(5 + 2 * k) * 16] = box.plane_low[k];
            block[(6 + 2 * k) * 16] = box.plane_high[k];
        }
    }
    return floats;
}

std::vector<Box> boxes_of_groups(const std::vector<Box>& groups)
{
    std::vector<Box> supers((groups.size() + group_size - 1) / group_size);
    for (std::size_t i = 0; i < groups.size(); ++i) supers[i / group_size].add(groups[i]);
    return supers;
}

// How far a turned plane keeps edges apart in a group, beside the whole view's width.
constexpr float normal_weight = 0.25F;

class Builder {
public:
    Builder(const Faces& all, std::span<const Plane> planes) : all_(all), planes_(planes)
    {
        Box view;
        for (const Face& face : all.faces)
            for (const std::uint32_t corner : face.corners)
                if (all.points[corner].z > 0) view.add(place_of(all.points[corner]));
        low_ = {view.low[0], view.low[1], 0};
        const double width = std::max({view.high[0] - view.low[0], view.high[1] - view.low[1], 1e-30});
        scale_ = {1 / width, 1 / width, 1 / std::max(view.near, 1e-30)};
    }

    void add_edges(std::span<const Edge> edges)
    {
        // Those that may count for anyone come in groups of their own.
        std::vector<std::uint32_t> smooth, always;
        for (std::uint32_t i = 0; i < edges.size(); ++i) (edges[i].smooth() ? smooth : always).push_back(i);
        std::vector<std::array<float, 6>> keys;
        for (const std::uint32_t i : smooth) {
            const auto place = key_of(all_.points[edges[i].low], all_.points[edges[i].high]);
            const auto &a = planes_[edges[i].faces[0]].values, &b = planes_[edges[i].faces[1]].values;
            keys.push_back({place[0], place[1], place[2], (a[0] + b[0]) * normal_weight, (a[1] + b[1]) * normal_weight, (a[2] + b[2]) * normal_weight});
        }
        add_groups(edges, smooth, SpatialOrder<6>(std::move(keys)).get());
        std::vector<std::array<float, 3>> places;
        places.reserve(always.size());
        for (const std::uint32_t i : always) places.push_back(key_of(all_.points[edges[i].low], all_.points[edges[i].high]));
        add_groups(edges, always, SpatialOrder<3>(std::move(places)).get());
        data_.edge_count = edges.size();
    }

    void add_triangles()
    {
        std::vector<std::uint32_t> counted;
        std::vector<std::array<float, 2>> keys;
        for (std::uint32_t i = 0; i < planes_.size(); ++i) {
            if (planes_[i].turn == 0) continue;
            counted.push_back(i);
            const auto key = key_of(all_.points[planes_[i].corners[0]], all_.points[planes_[i].corners[1]]);
            keys.push_back({key[0], key[1]});
        }
        data_.triangle_count = counted.size();
        const SpatialOrder<2> order(std::move(keys));
        const std::size_t groups = (counted.size() + group_size - 1) / group_size;
        data_.triangle_sets.assign(std::max<std::size_t>(groups, 1) * 256, 0.0F);
        triangle_groups_.resize(groups);
        for (std::size_t i = 0; i < counted.size(); ++i) {
            const Plane& plane = planes_[counted[order.get()[i]]];
            float* const set = data_.triangle_sets.data() + i / 16 * 256 + i % 16;
            for (std::size_t c = 0; c < 3; ++c) {
                write_point(set + 48 * c, plane.corners[c]);
                triangle_groups_[i / 16].add(place_of(all_.points[plane.corners[c]]));
            }
            for (std::size_t k = 0; k < 4; ++k) set[(9 + k) * 16] = plane.values[k];
            set[13 * 16] = plane.turn;
            set[14 * 16] = plane.corner_inside ? 1.0F : 0.0F;
        }
    }

    ReceiverSilhouettes take()
    {
        const std::vector<Box> edge_supers = boxes_of_groups(edge_groups_), triangle_supers = boxes_of_groups(triangle_groups_);
        data_.edge_supers = static_cast<int>(edge_supers.size());
        data_.edge_groups = static_cast<int>(edge_groups_.size());
        data_.triangle_supers = static_cast<int>(triangle_supers.size());
        data_.triangle_groups = static_cast<int>(triangle_groups_.size());
        data_.edge_super_boxes = blocks(edge_supers, true);
        data_.edge_group_boxes = blocks(edge_groups_, true);
        data_.triangle_super_boxes = blocks(triangle_supers, false);
        data_.triangle_group_boxes = blocks(triangle_groups_, false);
        return std::move(data_);
    }

private:
    std::array<float, 3> key_of(const Vec3& a, const Vec3& b) const
    {
        const auto pa = place_of(a), pb = place_of(b);
        std::array<float, 3> key{};
        for (std::size_t i = 0; i < 3; ++i) key[i] = static_cast<float>(std::clamp((0.5 * (pa[i] + pb[i]) - low_[i]) * scale_[i], -2.0, 2.0));
        return key;
    }

    void write_point(float* set, std::uint32_t point) const
    {
        const Vec3& p = all_.points[point];
        set[0] = static_cast<float>(p.x);
        set[16] = static_cast<float>(p.y);
        set[32] = static_cast<float>(p.z);
    }

    void add_groups(std::span<const Edge> edges, std::span<const std::uint32_t> numbers, const std::vector<std::uint32_t>& order)
    {
        const std::size_t first = edge_groups_.size(), groups = (numbers.size() + group_size - 1) / group_size;
        edge_groups_.resize(first + groups);
        data_.edge_sets.resize(std::max<std::size_t>(first + groups, 1) * 256, 0.0F);
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            const Edge& edge = edges[numbers[order[i]]];
            Box& box = edge_groups_[first + i / 16];
            float* const set = data_.edge_sets.data() + (first + i / 16) * 256 + i % 16;
            write_point(set, edge.low);
            write_point(set + 48, edge.high);
            box.add(place_of(all_.points[edge.low]));
            box.add(place_of(all_.points[edge.high]));
            for (std::size_t f = 0; f < 2; ++f) {
                if (edge.faces[f] == no_edge) continue;
                for (std::size_t k = 0; k < 4; ++k) set[(6 + 4 * f + k) * 16] = planes_[edge.faces[f]].values[k];
                set[(14 + f) * 16] = edge.turns[f];
                box.add_plane(planes_[edge.faces[f]].values);
            }
            if (edge.smooth()) continue;
            box.add_plane({-any_plane, -any_plane, -any_plane, -any_plane});
            box.add_plane({any_plane, any_plane, any_plane, any_plane});
        }
    }

    const Faces& all_;
    std::span<const Plane> planes_;
    std::array<double, 3> low_{}, scale_{};
    ReceiverSilhouettes data_;
    std::vector<Box> edge_groups_, triangle_groups_;
};

} // namespace

LightPart corner_part(const LightFrame& light)
{
    const double longer = std::max(light.half_u, light.half_v);
    const auto extent = [&](double half) { return 2 * std::max(half, longer * 0x1p-12); };
    return {.centre = light.origin - light.u * (0.5 * extent(light.half_u)) - light.v * (0.5 * extent(light.half_v)),
            .half = Vec3(extent(light.half_u), extent(light.half_v), 1),
            .centre_x = -0.5,
            .centre_y = -0.5,
            .share = 1};
}

ReceiverSilhouettes receiver_silhouettes(const Topology& topology, const LightFrame& light, const LightPart& corner)
{
    const Faces all = faces_of(topology, light, corner);
    check_stop();
    const bool mirrored = light.u.cross(light.v).dot(light.direction) < 0;
    std::vector<Plane> planes;
    planes.reserve(all.faces.size());
    for (const Face& face : all.faces) planes.push_back(plane_of(all, face, mirrored));
    const std::vector<Edge> edges = edges_of(planes);
    Builder builder(all, planes);
    builder.add_edges(edges);
    check_stop();
    builder.add_triangles();
    return builder.take();
}

} // namespace penumbra
