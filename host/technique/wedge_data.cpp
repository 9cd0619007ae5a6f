#include "technique/wedge_data.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include <penumbra/error.hpp>

#include "scene/stop.hpp"
#include "technique/spatial_order.hpp"

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
    Builder(const Topology& topology, const WedgeTriangles& triangles, const LightFrame& light, const LightPart& part)
        : any_plane_(light.shape == LightShape::disc), part_(part), triangles_(triangles), faces_(triangles.boxes.size(), 0)
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

    // Facing triangles, wound counter-clockwise as the part's centre sees them, and their numbers.
    void add_triangles(std::span<const std::array<std::uint32_t, 3>> triangles, std::span<const std::uint32_t> numbers)
    {
        for (std::size_t i = 0; i < triangles.size(); ++i) {
            const auto& [a, b, c] = triangles[i];
            if (!counts(a) && !counts(b) && !counts(c)) continue;
            const std::uint32_t row = triangles_.rows_of[numbers[i]];
            if (row == no_edge) throw Error(ErrorCode::internal, "a triangle faces a part of the light and no corner of it", "please report this");
            // Sorting turns it round with each exchange: an odd permutation.
            const bool turned = (a > b) != ((b > c) != (a > c));
            const std::uint32_t bit = row % group_size;
            std::uint32_t& faces = faces_[row / group_size];
            if (faces == 0) touched_.push_back(row / group_size);
            faces |= (1U | (turned ? 0x10000U : 0U)) << bit;
            ++data_.triangle_count;
        }
        std::sort(touched_.begin(), touched_.end());
        for (const std::uint32_t group : touched_) {
            const Box box = box_of_part(triangles_.boxes[group]);
            triangle_groups_.push_back(box);
            sheet_box_.add(box);
            data_.triangle_groups.insert(data_.triangle_groups.end(), {static_cast<int>(group), static_cast<int>(faces_[group])});
            faces_[group] = 0;
        }
        touched_.clear();
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

    // Where a box lies as the part's centre sees it.
    Box box_of_part(const WedgeTriangles::Box& box) const
    {
        const auto move = [&box](double centre) { return std::minmax({centre * box.far, centre * box.near}); };
        const auto [x0, x1] = move(part_.centre_x);
        const auto [y0, y1] = move(part_.centre_y);
        Box moved;
        moved.low = {box.low_x - x1, box.low_y - y1};
        moved.high = {box.high_x - x0, box.high_y - y0};
        moved.near = box.near;
        return moved;
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

    const bool any_plane_;
    const LightPart& part_;
    const WedgeTriangles& triangles_;
    std::vector<std::uint32_t> faces_, touched_; // of groups of triangles: WedgeData's second of a pair; which are not 0
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
    const Vec3 from = point - light.origin;
    // Rounded once, here: triangles and edges then meet to the bit. The kernel moves triangles to the part's centre by the same subtraction.
    const auto rounded = [](double value) { return static_cast<double>(static_cast<float>(value)); };
    return {rounded(rounded(from.dot(light.u) / part.half.x) - rounded(part.centre_x)),
            rounded(rounded(from.dot(light.v) / part.half.y) - rounded(part.centre_y)), rounded(from.dot(light.direction) / part.half.z)};
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

namespace {

// How many corners of the grid of parts see the triangle's front, or either side where both cast; of a part between them no other does.
int corners_faced(const Topology& topology, std::uint32_t triangle, const std::array<Vec3, 4>& corners)
{
    const auto& t = topology.triangles()[triangle];
    const Vec3 a(topology.vertices()[t[0]]), b(topology.vertices()[t[1]]), c(topology.vertices()[t[2]]);
    const Vec3 normal = (b - a).cross(c - a);
    int faced = 0;
    for (const Vec3& corner : corners) {
        // Beyond what the silhouette's rounding may take for facing.
        const double before = normal.dot(corner - a), rounding = 1e-9 * normal.length() * ((corner - a).length() + (b - a).length() + (c - a).length());
        faced += before > -rounding || (!topology.closed(triangle) && before < rounding);
    }
    return faced;
}

// A triangle's row: its vertices in order of their numbers; its plane N . p = D, so that |D| is 1 where that can be.
void write_triangle(float* row, const std::array<Vec3, 3>& points)
{
    const Vec3 normal = (points[1] - points[0]).cross(points[2] - points[0]);
    const double offset = normal.dot(points[0]);
    double scale = std::abs(offset);
    const auto flat = [&](double value) { return !(std::abs(value / scale) < everywhere); };
    if (flat(normal.x) || flat(normal.y) || flat(normal.z)) scale = std::max(normal.length(), 1e-300);
    const std::array<double, 13> values{points[0].x, points[0].y, points[0].z, points[1].x,      points[1].y,      points[1].z,   points[2].x,
                                        points[2].y, points[2].z, normal.x / scale, normal.y / scale, normal.z / scale, offset / scale};
    std::transform(values.begin(), values.end(), row, [](double value) { return static_cast<float>(value); });
}

WedgeTriangles::Box extent_of(const std::array<Vec3, 3>& points)
{
    WedgeTriangles::Box box{everywhere, -everywhere, everywhere, -everywhere, everywhere, -1};
    for (const Vec3& point : points) {
        const Place place = place_of(point);
        if (place.near < 0) return {-everywhere, everywhere, -everywhere, everywhere, 0, everywhere};
        box = {std::min(box.low_x, place.x), std::max(box.high_x, place.x), std::min(box.low_y, place.y),
               std::max(box.high_y, place.y), std::min(box.far, place.near), std::max(box.near, place.near)};
    }
    return box;
}

void join(WedgeTriangles::Box& box, const WedgeTriangles::Box& other)
{
    box = {std::min(box.low_x, other.low_x), std::max(box.high_x, other.high_x), std::min(box.low_y, other.low_y),
           std::max(box.high_y, other.high_y), std::min(box.far, other.far), std::max(box.near, other.near)};
}

} // namespace

WedgeTriangles wedge_triangles(const Topology& topology, const LightFrame& light, const std::vector<LightPart>& parts)
{
    LightPart whole = parts.front();
    whole.centre_x = whole.centre_y = 0;
    const std::size_t side = static_cast<std::size_t>(std::lround(std::sqrt(parts.size())));
    const std::array<Vec3, 4> corners{parts[0].centre, parts[side - 1].centre, parts[parts.size() - side].centre, parts.back().centre};
    std::vector<Vec3> points;
    points.reserve(topology.vertices().size());
    for (const Imath::V3f& vertex : topology.vertices()) points.push_back(point_in_part(light, whole, Vec3(vertex)));

    // Those that face the light, beside what lies beside them in its view; by and by those that not all parts see.
    std::vector<std::uint32_t> used;
    std::vector<std::array<float, 3>> keys;
    Box view;
    for (const Vec3& point : points)
        if (point.z > 0) view.add(place_of(point));
    const double width = std::max({view.high[0] - view.low[0], view.high[1] - view.low[1], 1e-30});
    for (std::uint32_t i = 0; i < topology.triangles().size(); ++i) {
        if (i % 4096 == 0) check_stop();
        const int faced = corners_faced(topology, i, corners);
        if (faced == 0) continue;
        used.push_back(i);
        const Place place = place_of(points[topology.triangles()[i][0]]);
        const auto key = [&](double value, std::size_t axis) { return static_cast<float>(place.near < 0 ? 0 : (value - view.low[axis]) / width); };
        keys.push_back({key(place.x, 0), key(place.y, 1), 0.0625F * static_cast<float>(faced)});
    }
    const SpatialOrder<3> order(std::move(keys));

    WedgeTriangles triangles;
    const std::size_t groups = (used.size() + group_size - 1) / group_size;
    triangles.rows_of.assign(topology.triangles().size(), no_edge);
    triangles.rows.assign(std::max<std::size_t>(groups, 1) * group_size * 16, 0.0F); // a plane of disparity 0 is before nothing
    triangles.extents.assign(std::max<std::size_t>(groups, 1) * group_size * 6, -1.0F);
    triangles.boxes.assign(groups, {everywhere, -everywhere, everywhere, -everywhere, everywhere, -1});
    for (std::uint32_t row = 0; row < used.size(); ++row) {
        const std::uint32_t number = used[order.get()[row]];
        triangles.rows_of[number] = row;
        std::array<std::uint32_t, 3> corner = topology.triangles()[number];
        std::sort(corner.begin(), corner.end());
        const std::array<Vec3, 3> at{points[corner[0]], points[corner[1]], points[corner[2]]};
        write_triangle(triangles.rows.data() + 16 * row, at);
        const WedgeTriangles::Box box = extent_of(at);
        float* const extent = triangles.extents.data() + row / group_size * 96 + row % group_size;
        const std::array<double, 6> values{box.low_x, box.high_x, box.low_y, box.high_y, box.near, box.far};
        for (std::size_t k = 0; k < values.size(); ++k) extent[16 * k] = static_cast<float>(values[k]);
        join(triangles.boxes[row / group_size], box);
    }
    return triangles;
}

WedgeData wedge_data(const Topology& topology, const WedgeTriangles& triangles, const Silhouette& silhouette, const LightFrame& light,
                     const LightPart& part, bool apart, bool edges_too)
{
    const std::vector<Together> groups = apart ? each_apart(silhouette) : sides_apart(silhouette);
    std::vector<std::size_t> group_of(silhouette.sheets());
    for (std::size_t g = 0; g < groups.size(); ++g)
        for (const std::uint32_t sheet : groups[g].sheets) group_of[sheet] = g;
    // Edges of each group, loop after loop.
    std::vector<std::vector<std::uint32_t>> edges(groups.size());
    if (edges_too)
        for (std::uint32_t i = 0; i < silhouette.edges.size(); ++i) edges[group_of[silhouette.edges[i].sheet]].push_back(i);

    Builder builder(topology, triangles, light, part);
    std::vector<std::array<std::uint32_t, 3>> facing;
    std::vector<std::uint32_t> numbers;
    bool before = false;
    for (std::size_t g = 0; g < groups.size(); ++g) {
        facing.clear();
        numbers.clear();
        for (const std::uint32_t sheet : groups[g].sheets) {
            const auto begin = static_cast<std::ptrdiff_t>(silhouette.facing_begin[sheet]), end = static_cast<std::ptrdiff_t>(silhouette.facing_begin[sheet + 1]);
            facing.insert(facing.end(), silhouette.facing.begin() + begin, silhouette.facing.begin() + end);
            numbers.insert(numbers.end(), silhouette.facing_numbers.begin() + begin, silhouette.facing_numbers.begin() + end);
        }
        // Where all of the first side lies behind the light's plane, the other is the first.
        builder.begin_sheet(groups[g].side == 2 && !before ? 1 : groups[g].side);
        builder.add_triangles(facing, numbers);
        builder.add_edges(silhouette.edges, edges[g]);
        before = builder.end_sheet();
    }
    return builder.take();
}

} // namespace penumbra
