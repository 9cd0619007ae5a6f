#include "io/polygon.hpp"

#include <algorithm>

namespace penumbra {

namespace {

using Vec2 = Imath::V2d;
using Vec3 = Imath::V3d;

double turn(const Vec2& a, const Vec2& b, const Vec2& c) { return (b - a).cross(c - a); }

// Newell's normal: right for any simple polygon, flat or nearly.
Vec3 mean_normal(std::span<const std::uint32_t> corners, std::span<const Imath::V3f> positions)
{
    const Vec3 origin(positions[corners[0]]);
    Vec3 normal(0, 0, 0);
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        normal += (Vec3(positions[corners[i]]) - origin).cross(Vec3(positions[corners[i + 1]]) - origin);
    return normal;
}

// The corners seen along the axis that the normal follows most, so that the polygon turns counter-clockwise.
std::vector<Vec2> flattened(std::span<const std::uint32_t> corners, std::span<const Imath::V3f> positions, const Vec3& normal)
{
    int axis = 0;
    for (int i = 1; i < 3; ++i)
        if (std::abs(normal[i]) > std::abs(normal[axis])) axis = i;
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u, v);
    std::vector<Vec2> flat;
    flat.reserve(corners.size());
    for (const std::uint32_t corner : corners) flat.emplace_back(positions[corner][u], positions[corner][v]);
    return flat;
}

// Whether corner `at` of the `left` ones can be cut off: it is convex and no other corner lies in its triangle.
bool is_ear(const std::vector<Vec2>& flat, const std::vector<std::uint32_t>& left, std::size_t at)
{
    const std::size_t count = left.size();
    const Vec2 &a = flat[left[(at + count - 1) % count]], &b = flat[left[at]], &c = flat[left[(at + 1) % count]];
    if (!(turn(a, b, c) > 0)) return false;
    return std::ranges::none_of(left, [&](std::uint32_t other) {
        const Vec2& p = flat[other];
        return p != a && p != b && p != c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
    });
}

} // namespace

void triangulate(std::span<const std::uint32_t> corners, std::span<const Imath::V3f> positions,
                 std::vector<std::array<std::uint32_t, 3>>& triangles)
{
    // Ear clipping looks at every corner for every ear; beyond this many a polygon is a broken file or a convex cap, and a fan does.
    constexpr std::size_t most_clipped = 512;
    std::vector<std::uint32_t> left(corners.size());
    for (std::size_t i = 0; i < left.size(); ++i) left[i] = static_cast<std::uint32_t>(i);
    const auto cut = [&](std::size_t at) {
        const std::size_t count = left.size();
        triangles.push_back({corners[left[(at + count - 1) % count]], corners[left[at]], corners[left[(at + 1) % count]]});
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
    };

    if (corners.size() > 3 && corners.size() <= most_clipped) {
        const std::vector<Vec2> flat = flattened(corners, positions, mean_normal(corners, positions));
        while (left.size() > 3) {
            std::size_t at = 1;
            while (at <= left.size() && !is_ear(flat, left, at % left.size())) ++at;
            if (at > left.size()) break; // crossing edges or no area
            cut(at % left.size());
        }
    }
    for (std::size_t i = 1; i + 1 < left.size(); ++i) triangles.push_back({corners[left[0]], corners[left[i]], corners[left[i + 1]]});
}

} // namespace penumbra
