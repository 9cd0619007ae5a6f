#include "technique/wedge_data.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "scene/stop.hpp"

namespace penumbra {
namespace {

constexpr std::size_t group_size = WEDGE_GROUP;
constexpr double everywhere = 1e18; // beyond any tangent and disparity that a box is compared with

// Where a point is for culling: (x / z, y / z, 1 / z). At or behind the light's plane it has no place: near is negative.
struct Place {
    double x = 0, y = 0, near = -1;
};

Place place_of(const Vec3& point)
{
    if (!(point.z > 0)) return {};
    return {.x = std::clamp(point.x / point.z, -everywhere, everywhere),
            .y = std::clamp(point.y / point.z, -everywhere, everywhere),
            .near = std::min(1 / point.z, everywhere)};
}

// A box of places.
struct Box {
    std::array<double, 2> low{everywhere, everywhere}, high{-everywhere, -everywhere};
    double near = -1;

    void add(const Place& place)
    {
        // Without a place: its penumbra may be anywhere.
        if (place.near < 0) {
            low = {-everywhere, -everywhere};
            high = {everywhere, everywhere};
            near = everywhere;
            return;
        }
        low = {std::min(low[0], place.x), std::min(low[1], place.y)};
        high = {std::max(high[0], place.x), std::max(high[1], place.y)};
        near = std::max(near, place.near);
    }
    void add(const Box& other)
    {
        for (std::size_t i = 0; i < 2; ++i) {
            low[i] = std::min(low[i], other.low[i]);
            high[i] = std::max(high[i], other.high[i]);
        }
        near = std::max(near, other.near);
    }
};

void write_box(float* block, const Box& box)
{
    block[0] = static_cast<float>(box.low[0]);
    block[16] = static_cast<float>(box.high[0]);
    block[32] = static_cast<float>(box.low[1]);
    block[48] = static_cast<float>(box.high[1]);
    block[64] = static_cast<float>(box.near);
}

// Boxes as blocks of 16: low x, high x, low y, high y, near. What pads the last block meets nothing.
std::vector<float> blocks(const std::vector<Box>& boxes)
{
    const std::size_t count = (boxes.size() + 15) / 16;
    std::vector<float> floats(std::max<std::size_t>(count, 1) * 80, -1.0F);
    for (std::size_t i = 0; i < boxes.size(); ++i) write_box(floats.data() + i / 16 * 80 + i % 16, boxes[i]);
    return floats;
}

class Builder {
public:
    Builder(const Topology& topology, const LightFrame& light, const LightPart& part) : any_plane_(light.shape == LightShape::disc)
    {
        points_.reserve(topology.vertices().size());
        places_.reserve(topology.vertices().size());
        for (const Imath::V3f& vertex : topology.vertices()) {
            points_.push_back(point_in_part(light, part, Vec3(vertex)));
            places_.push_back(place_of(points_.back()));
        }
    }

    void begin_sheet(int side)
    {
        sheet_ = {.edges_begin = static_cast<int>(edge_groups_.size()),
                  .edges_end = 0,
                  .triangles_begin = static_cast<int>(triangle_groups_.size()),
                  .triangles_end = 0,
                  .side = side};
        sheet_box_ = {};
    }
    // Whether there is anything in it.
    bool end_sheet()
    {
        sheet_.edges_end = static_cast<int>(edge_groups_.size());
        sheet_.triangles_end = static_cast<int>(triangle_groups_.size());
        if (sheet_.edges_begin == sheet_.edges_end && sheet_.triangles_begin == sheet_.triangles_end) return false;
        data_.sheets.push_back(sheet_);
        sheet_boxes_.push_back(sheet_box_);
        return true;
    }

    void add_edges(std::span<const SilhouetteEdge> all, std::span<const std::uint32_t> numbers)
    {
        std::vector<std::uint32_t> counted;
        for (const std::uint32_t i : numbers)
            if (counts(all[i].from) || counts(all[i].to)) counted.push_back(i);
        data_.edge_count += counted.size();
        for (std::size_t first = 0; first < counted.size(); first += group_size)
            add_edge_group(all, std::span(counted).subspan(first, std::min(group_size, counted.size() - first)));
    }

    void add_triangles(std::span<const std::array<std::uint32_t, 3>> triangles)
    {
        std::vector<std::array<std::uint32_t, 3>> counted;
        for (const auto& triangle : triangles)
            if (counts(triangle[0]) || counts(triangle[1]) || counts(triangle[2])) counted.push_back(triangle);
        data_.triangle_count += counted.size();
        sort_by_place(counted);
        const std::size_t groups = (counted.size() + group_size - 1) / group_size;
        data_.triangles.reserve(data_.triangles.size() + 16 * group_size * groups);
        data_.triangle_extents.reserve(data_.triangle_extents.size() + 5 * group_size * groups);
        for (std::size_t first = 0; first < counted.size(); first += group_size)
            add_triangle_group(std::span(counted).subspan(first, std::min(group_size, counted.size() - first)));
    }

    WedgeData take()
    {
        data_.sheet_boxes = blocks(sheet_boxes_);
        data_.edge_boxes = blocks(edge_groups_);
        data_.triangle_boxes = blocks(triangle_groups_);
        return std::move(data_);
    }

private:
    bool counts(std::uint32_t vertex) const { return any_plane_ || points_[vertex].z > 0; }

    // Along a Z curve over the light's view, so that a group's box is small.
    void sort_by_place(std::vector<std::array<std::uint32_t, 3>>& triangles) const
    {
        Box all;
        for (const auto& triangle : triangles)
            if (places_[triangle[0]].near > 0) all.add(places_[triangle[0]]);
        const auto cell = [](double value, double low, double high) {
            const double place = high > low ? (value - low) / (high - low) : 0;
            std::uint32_t v = static_cast<std::uint32_t>(std::clamp(place, 0.0, 1.0) * 65535);
            v = (v | v << 8) & 0x00ff00ffU;
            v = (v | v << 4) & 0x0f0f0f0fU;
            v = (v | v << 2) & 0x33333333U;
            return (v | v << 1) & 0x55555555U;
        };
        std::vector<std::uint64_t> order; // code, then the triangle's number
        order.reserve(triangles.size());
        for (std::uint32_t i = 0; i < triangles.size(); ++i) {
            const Place& place = places_[triangles[i][0]];
            const std::uint32_t code = cell(place.x, all.low[0], all.high[0]) | cell(place.y, all.low[1], all.high[1]) << 1;
            order.push_back(std::uint64_t{place.near > 0 ? code : 0} << 32 | i);
        }
        std::sort(order.begin(), order.end());
        std::vector<std::array<std::uint32_t, 3>> sorted;
        sorted.reserve(triangles.size());
        for (const std::uint64_t entry : order) sorted.push_back(triangles[entry & 0xffffffffU]);
        triangles = std::move(sorted);
    }

    void add_edge_group(std::span<const SilhouetteEdge> all, std::span<const std::uint32_t> numbers)
    {
        const std::size_t ends = data_.edge_ends.size(), rows = data_.edges.size();
        data_.edge_ends.resize(ends + 6 * group_size, -1.0F); // 1 / z of -1 meets nothing
        data_.edges.resize(rows + 8 * group_size, 0.0F);
        data_.edge_sources.insert(data_.edge_sources.end(), numbers.begin(), numbers.end());
        data_.edge_sources.resize(data_.edges.size() / 8, no_edge);
        Box box;
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            const SilhouetteEdge& edge = all[numbers[i]];
            const bool forward = edge.from < edge.to;
            const std::uint32_t first = forward ? edge.from : edge.to, second = forward ? edge.to : edge.from;
            const Vec3 &a = points_[first], &b = points_[second];
            float* const row = data_.edges.data() + rows + 8 * i;
            const std::array<double, 7> values{a.x, a.y, a.z, b.x, b.y, b.z, forward ? 1.0 : -1.0};
            std::transform(values.begin(), values.end(), row, [](double value) { return static_cast<float>(value); });

            Box own;
            own.add(places_[first]);
            own.add(places_[second]);
            box.add(own);
            float* const end = data_.edge_ends.data() + ends + i;
            const bool unbounded = own.near >= everywhere;
            const auto write_end = [&](const Place& place, std::size_t at) {
                end[(at + 0) * 16] = unbounded ? 0.0F : static_cast<float>(place.x);
                end[(at + 1) * 16] = unbounded ? 0.0F : static_cast<float>(place.y);
                end[(at + 2) * 16] = static_cast<float>(unbounded ? everywhere : place.near);
            };
            write_end(places_[first], 0);
            write_end(places_[second], 3);
        }
        edge_groups_.push_back(box);
        sheet_box_.add(box);
    }

    void add_triangle_group(std::span<const std::array<std::uint32_t, 3>> triangles)
    {
        const std::size_t rows = data_.triangles.size();
        data_.triangles.resize(rows + 16 * group_size, 0.0F); // a plane of disparity 0 is before nothing
        const std::size_t extents = data_.triangle_extents.size();
        data_.triangle_extents.resize(extents + 5 * group_size, -1.0F);
        Box box;
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            if (i % 1024 == 0) check_stop();
            std::array<std::uint32_t, 3> order = triangles[i];
            // Seen from the light they turn counter-clockwise; sorting turns them round with each exchange.
            bool turned = false;
            const auto exchange = [&](std::size_t j, std::size_t k) {
                if (order[j] > order[k]) {
                    std::swap(order[j], order[k]);
                    turned = !turned;
                }
            };
            exchange(0, 1);
            exchange(1, 2);
            exchange(0, 1);
            const Vec3 &a = points_[order[0]], &b = points_[order[1]], &c = points_[order[2]];
            const Vec3 normal = (b - a).cross(c - a), plane = normal / normal.dot(a);
            Box own;
            for (const std::uint32_t vertex : order) own.add(places_[vertex]);
            write_box(data_.triangle_extents.data() + extents + i, own);
            box.add(own);
            // Edge-on to the light's centre it covers nothing.
            const bool flat = !(std::abs(plane.x) < everywhere && std::abs(plane.y) < everywhere && std::abs(plane.z) < everywhere);
            const std::array<double, 13> values{a.x,
                                                a.y,
                                                a.z,
                                                b.x,
                                                b.y,
                                                b.z,
                                                c.x,
                                                c.y,
                                                c.z,
                                                flat ? 0 : plane.x,
                                                flat ? 0 : plane.y,
                                                flat ? 0 : plane.z,
                                                turned ? -1.0 : 1.0};
            std::transform(values.begin(), values.end(), data_.triangles.data() + rows + 16 * i,
                           [](double value) { return static_cast<float>(value); });
        }
        triangle_groups_.push_back(box);
        sheet_box_.add(box);
    }

    const bool any_plane_;
    std::vector<Vec3> points_;
    std::vector<Place> places_;
    WedgeData data_;
    std::vector<Box> sheet_boxes_, edge_groups_, triangle_groups_;
    Sheet sheet_{};
    Box sheet_box_;
};

// Which of the silhouette's sheets make one for the kernel.
struct Together {
    std::vector<std::uint32_t> sheets;
    int side; // Sheet::side
};

std::vector<Together> each_apart(const Silhouette& silhouette)
{
    std::vector<Together> groups;
    for (std::uint32_t s = 0; s < silhouette.sheets(); ++s) groups.push_back({.sheets = {s}, .side = 0});
    return groups;
}

// First all that hide by themselves, then the two sides of each component that shows both.
std::vector<Together> sides_apart(const Silhouette& silhouette)
{
    std::unordered_map<std::uint32_t, std::array<bool, 2>> shown;
    for (const SheetSide& side : silhouette.sides) shown[side.component][side.turned] = true;

    std::vector<Together> groups{{.sheets = {}, .side = 0}};
    std::unordered_map<std::uint32_t, std::size_t> first_group;
    for (std::uint32_t s = 0; s < silhouette.sheets(); ++s) {
        const SheetSide& side = silhouette.sides[s];
        const std::array<bool, 2>& both = shown[side.component];
        if (!both[0] || !both[1]) {
            groups[0].sheets.push_back(s);
            continue;
        }
        const auto [at, fresh] = first_group.try_emplace(side.component, groups.size());
        if (fresh) groups.insert(groups.end(), {{.sheets = {}, .side = 1}, {.sheets = {}, .side = 2}});
        groups[at->second + (side.turned ? 1 : 0)].sheets.push_back(s);
    }
    return groups;
}

} // namespace

Vec3 point_in_part(const LightFrame& light, const LightPart& part, const Vec3& point)
{
    const Vec3 from = point - part.centre;
    // Rounded once, here: triangles and edges then meet to the bit.
    const auto rounded = [](double value) { return static_cast<double>(static_cast<float>(value)); };
    return {rounded(from.dot(light.u) / part.half.x), rounded(from.dot(light.v) / part.half.y),
            rounded(from.dot(light.direction) / part.half.z)};
}

std::vector<LightPart> light_parts(const LightFrame& light, int splits)
{
    const double longer = std::max(light.half_u, light.half_v);
    const auto extent = [&](double half) { return longer == 0 ? 1.0 : std::max(half, longer * 0x1p-12); };
    if (light.shape == LightShape::disc || longer == 0)
        return {{.centre = light.origin,
                 .half = Vec3(extent(light.half_u), extent(light.half_v), longer == 0 ? 1.0 : longer),
                 .centre_x = 0,
                 .centre_y = 0,
                 .share = 1}};

    std::vector<LightPart> parts;
    const Vec3 half(extent(light.half_u) / splits, extent(light.half_v) / splits, 1);
    for (int j = 0; j < splits; ++j)
        for (int i = 0; i < splits; ++i) {
            const double x = 2 * i + 1 - splits, y = 2 * j + 1 - splits;
            parts.push_back({.centre = light.origin + light.u * (x * half.x) + light.v * (y * half.y),
                             .half = half,
                             .centre_x = x,
                             .centre_y = y,
                             .share = 1.0 / (splits * splits)});
        }
    return parts;
}

WedgeData wedge_data(const Topology& topology, const Silhouette& silhouette, const LightFrame& light, const LightPart& part, bool apart,
                     bool edges_too)
{
    const std::vector<Together> groups = apart ? each_apart(silhouette) : sides_apart(silhouette);
    std::vector<std::size_t> group_of(silhouette.sheets());
    for (std::size_t g = 0; g < groups.size(); ++g)
        for (const std::uint32_t sheet : groups[g].sheets) group_of[sheet] = g;
    // Edges of each group, loop after loop.
    std::vector<std::vector<std::uint32_t>> edges(groups.size());
    if (edges_too)
        for (std::uint32_t i = 0; i < silhouette.edges.size(); ++i) edges[group_of[silhouette.edges[i].sheet]].push_back(i);

    Builder builder(topology, light, part);
    std::vector<std::array<std::uint32_t, 3>> triangles;
    bool before = false;
    for (std::size_t g = 0; g < groups.size(); ++g) {
        triangles.clear();
        for (const std::uint32_t sheet : groups[g].sheets)
            triangles.insert(triangles.end(), silhouette.facing.begin() + silhouette.facing_begin[sheet],
                             silhouette.facing.begin() + silhouette.facing_begin[sheet + 1]);
        // Where all of the first side lies behind the light's plane, the other is the first.
        builder.begin_sheet(groups[g].side == 2 && !before ? 1 : groups[g].side);
        builder.add_triangles(triangles);
        builder.add_edges(silhouette.edges, edges[g]);
        before = builder.end_sheet();
    }
    return builder.take();
}

} // namespace penumbra
