#include "io/polygon.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <penumbra/error.hpp>

#include "scene/orientation.hpp"

namespace penumbra {

namespace {

// Newell's normal: right for any simple polygon, flat or nearly.
Vec3 mean_normal(std::span<const Vec3> corners)
{
    Vec3 normal(0, 0, 0);
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) normal += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
    return normal;
}

// The corners seen along the axis that the normal follows most, so that the polygon turns counter-clockwise. Nothing is rounded.
std::vector<Vec2> flattened(std::span<const Vec3> corners)
{
    const Vec3 normal = mean_normal(corners);
    int axis = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(normal[i]) > std::abs(normal[axis])) axis = i;
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u, v);
    std::vector<Vec2> flat;
    flat.reserve(corners.size());
    for (const Vec3& corner : corners) flat.emplace_back(corner[u], corner[v]);
    return flat;
}

// Some corners by where they lie: a grid of about as many cells as corners.
class Grid {
public:
    explicit Grid(const std::vector<Vec2>& points)
        : side_(static_cast<std::size_t>(std::sqrt(static_cast<double>(points.size()))) + 1), cells_(side_ * side_)
    {
        for (const Vec2& p : points) box_.extendBy(p);
    }
    void add(std::uint32_t corner, const Vec2& p) { cells_[place(p.y, 1) * side_ + place(p.x, 0)].push_back(corner); }

    // Calls visit(corner) for those in the box and some around it until it returns true; whether it did.
    template <class Visit> bool any(const Imath::Box2d& box, std::uint64_t& work, const Visit& visit) const
    {
        for (std::size_t y = place(box.min.y, 1); y <= place(box.max.y, 1); ++y)
            for (std::size_t x = place(box.min.x, 0); x <= place(box.max.x, 0); ++x) {
                const std::vector<std::uint32_t>& cell = cells_[y * side_ + x];
                work += 1 + cell.size();
                if (std::ranges::any_of(cell, visit)) return true;
            }
        return false;
    }

private:
    std::size_t place(double at, int axis) const
    {
        const double size = box_.max[axis] - box_.min[axis];
        if (!(size > 0)) return 0;
        return std::min(static_cast<std::size_t>((at - box_.min[axis]) / size * static_cast<double>(side_)), side_ - 1);
    }

    std::size_t side_;
    Imath::Box2d box_;
    std::vector<std::vector<std::uint32_t>> cells_;
};

// A ring of corners that loses its ears one after the other.
class Clipper {
public:
    using Triangles = std::vector<std::array<std::uint32_t, 3>>;

    Clipper(std::vector<Vec2> points, Triangles& triangles)
        : p_(std::move(points)), grid_(p_), next_(p_.size()), before_(p_.size()), out_(triangles)
    {
        const auto count = static_cast<std::uint32_t>(p_.size());
        for (std::uint32_t i = 0; i < count; ++i) next_[i] = (i + 1) % count, before_[i] = (i + count - 1) % count;
        // Only corners that are not convex can stand in an ear's way: where any corner lies in a triangle, one of those does.
        for (std::uint32_t i = 0; i < count; ++i)
            if (!(at(i) > 0)) grid_.add(i, p_[i]);
        gone_.resize(count);
    }

    void clip()
    {
        std::size_t left = p_.size();
        std::uint32_t corner = 1;
        while (left > 3) {
            // Once around by the strict rule. Where edges lie on each other it may find nothing: then what only touches an ear is let be,
            // and at last corners without area go.
            const auto found = find(corner, left, [&](std::uint32_t i) { return is_ear(i, true); });
            const auto ear = found != none ? found : find(corner, left, [&](std::uint32_t i) { return is_ear(i, false); });
            const auto flat = ear != none ? ear : find(corner, left, [&](std::uint32_t i) { return at(i) == 0; });
            if (flat == none) break; // it crosses itself
            cut(flat);
            --left;
            // Not the neighbour at once: slivers around one corner would be the result.
            corner = next_[next_[flat]];
        }
        for (std::uint32_t a = next_[corner], b = next_[a]; b != corner; a = b, b = next_[b]) out_.push_back({corner, a, b});
    }

private:
    static constexpr std::uint32_t none = ~0u;

    double at(std::uint32_t i) const { return turn(p_[before_[i]], p_[i], p_[next_[i]]); }

    template <class Test> std::uint32_t find(std::uint32_t first, std::size_t left, const Test& test) const
    {
        for (std::uint32_t i = first; left > 0; i = next_[i], --left)
            if (test(i)) return i;
        return none;
    }

    // Whether corner i can be cut off: it is convex, its triangle's third edge starts and ends inside of the polygon, and no other corner
    // lies in the triangle or, when `strict`, on its border. Corners at its own corners' places are copies, as keyholes have them: they lie
    // beyond the wedges that the third edge was found to be in.
    bool is_ear(std::uint32_t i, bool strict) const
    {
        const std::uint32_t before = before_[i], after = next_[i];
        const Vec2 &a = p_[before], &b = p_[i], &c = p_[after];
        if (!(turn(a, b, c) > 0)) return false;
        if (at(before) >= 0 && turn(p_[before_[before]], a, c) < 0) return false;
        if (at(after) >= 0 && turn(a, c, p_[next_[after]]) < 0) return false;

        Imath::Box2d box(a);
        box.extendBy(b);
        box.extendBy(c);
        if (work_ > most_work_) throw Error(ErrorCode::too_large, "a polygon of " + std::to_string(p_.size()) + " corners is too winding");
        return !grid_.any(box, work_, [&](std::uint32_t other) {
            if (gone_[other]) return false;
            const Vec2& p = p_[other];
            if (p == a || p == b || p == c) return false;
            const double ab = turn(a, b, p), bc = turn(b, c, p), ca = turn(c, a, p);
            return strict ? ab >= 0 && bc >= 0 && ca >= 0 : ab > 0 && bc > 0 && ca > 0;
        });
    }

    void cut(std::uint32_t i)
    {
        out_.push_back({before_[i], i, next_[i]});
        next_[before_[i]] = next_[i];
        before_[next_[i]] = before_[i];
        gone_[i] = true;
    }

    std::vector<Vec2> p_;
    Grid grid_;
    std::vector<std::uint32_t> next_, before_;
    std::vector<bool> gone_;
    Triangles& out_;
    static constexpr std::uint64_t most_work_ = std::uint64_t{1} << 34; // about a minute
    mutable std::uint64_t work_ = 0;
};

} // namespace

void triangulate(std::span<const Vec3> corners, std::vector<std::array<std::uint32_t, 3>>& triangles)
{
    if (corners.size() == 3)
        triangles.push_back({0, 1, 2});
    else
        Clipper(flattened(corners), triangles).clip();
}

} // namespace penumbra
