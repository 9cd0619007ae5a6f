// Meshes that the tests of this room share. All are counter-clockwise seen from outside.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "silhouette/silhouette.hpp"

namespace penumbra::test {

using Triangle = std::array<std::uint32_t, 3>;

inline std::uint32_t add(TriangleMesh& mesh, const Vec3& p)
{
    mesh.positions.emplace_back(p);
    return static_cast<std::uint32_t>(mesh.positions.size() - 1);
}

inline TriangleMesh tetrahedron(const Vec3& a = {0, 0, 0}, const Vec3& b = {1, 0, 0}, const Vec3& c = {0, 1, 0}, const Vec3& d = {0, 0, 1})
{
    TriangleMesh mesh;
    for (const Vec3& p : {a, b, c, d}) add(mesh, p);
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    return mesh;
}

inline TriangleMesh box(const Vec3& low, const Vec3& high)
{
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i)
        add(mesh, Vec3((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y, (i & 4) != 0 ? high.z : low.z));
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return mesh;
}
inline TriangleMesh cube() { return box({-1, -1, -1}, {1, 1, 1}); }

// A square in the plane z = 0, seen from above.
inline TriangleMesh square()
{
    TriangleMesh mesh;
    for (const Vec3& p : {Vec3(-1, -1, 0), Vec3(1, -1, 0), Vec3(1, 1, 0), Vec3(-1, 1, 0)}) add(mesh, p);
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

// A grid of n x m quads over [0, 1) x [0, 1) that closes upon itself in both directions, at `place`.
inline TriangleMesh closed_grid(std::uint32_t n, std::uint32_t m, const std::function<Vec3(double, double)>& place)
{
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < m; ++j) add(mesh, place(static_cast<double>(i) / n, static_cast<double>(j) / m));
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < m; ++j) {
            const std::uint32_t a = i * m + j, b = (i + 1) % n * m + j, c = (i + 1) % n * m + (j + 1) % m, d = i * m + (j + 1) % m;
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
        }
    return mesh;
}

inline TriangleMesh torus(std::uint32_t n, std::uint32_t m)
{
    return closed_grid(n, m, [](double s, double t) {
        const double u = 2 * std::numbers::pi * s, v = 2 * std::numbers::pi * t, r = 2 + std::cos(v);
        return Vec3(r * std::cos(u), r * std::sin(u), std::sin(v));
    });
}

// Rings of random sizes between two poles, `wobble` off the unit sphere.
inline TriangleMesh sphere(std::mt19937& random, int rings, double wobble)
{
    std::uniform_real_distribution<double> any(0, 1);
    TriangleMesh mesh;
    std::vector<std::vector<std::uint32_t>> ring{{add(mesh, {0, 0, 1})}};
    for (int i = 1; i < rings; ++i) {
        const double angle = std::numbers::pi * (i + 0.3 * any(random)) / rings;
        ring.emplace_back();
        const int count = 3 + static_cast<int>(12 * any(random));
        const double first = any(random);
        for (int k = 0; k < count; ++k) {
            const double around = 2 * std::numbers::pi * (k + first) / count, r = 1 + wobble * (any(random) - 0.5);
            ring.back().push_back(
                add(mesh, Vec3(std::sin(angle) * std::cos(around), std::sin(angle) * std::sin(around), std::cos(angle)) * r));
        }
    }
    ring.push_back({add(mesh, {0, 0, -1})});
    // Between rings, step on whichever lags behind.
    for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
        const auto &upper = ring[i], &lower = ring[i + 1];
        std::size_t u = 0, l = 0;
        const std::size_t nu = upper.size() > 1 ? upper.size() : 0, nl = lower.size() > 1 ? lower.size() : 0;
        while (u < nu || l < nl) {
            const std::uint32_t up = upper[u % upper.size()], low = lower[l % lower.size()];
            if (l < nl && (u == nu || l * nu <= u * nl))
                mesh.triangles.push_back({up, low, lower[++l % lower.size()]});
            else
                mesh.triangles.push_back({up, low, upper[++u % upper.size()]});
        }
    }
    return mesh;
}

// The surface where `field` is 0 on an n x n x n grid over [-1, 1]^3, each cell cut into six tetrahedra; positive is inside. Closed if the
// field is negative on the border.
inline TriangleMesh marching_tetrahedra(int n, const std::function<double(const Vec3&)>& field)
{
    TriangleMesh mesh;
    const auto number = [n](int x, int y, int z) { return (z * (n + 1) + y) * (n + 1) + x; };
    const auto place = [n](int v) { return Vec3(v % (n + 1), v / (n + 1) % (n + 1), v / (n + 1) / (n + 1)) * (2.0 / n) - Vec3(1, 1, 1); };
    std::vector<double> value;
    for (int v = 0; v < (n + 1) * (n + 1) * (n + 1); ++v) value.push_back(field(place(v)));
    std::map<std::pair<int, int>, std::uint32_t> cuts;
    const auto cut = [&](int a, int b) {
        const auto [at, fresh] = cuts.try_emplace({std::min(a, b), std::max(a, b)}, 0u);
        const double va = value[static_cast<std::size_t>(a)], vb = value[static_cast<std::size_t>(b)];
        if (fresh) at->second = add(mesh, place(a) + (place(b) - place(a)) * (va / (va - vb)));
        return at->second;
    };
    // Counter-clockwise as the outside sees it: the field falls along the normal.
    const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, const Vec3& inside) {
        const Vec3 pa(mesh.positions[a]), pb(mesh.positions[b]), pc(mesh.positions[c]);
        if ((pb - pa).cross(pc - pa).dot(inside - pa) > 0) std::swap(b, c);
        mesh.triangles.push_back({a, b, c});
    };
    constexpr int order[6][2] = {{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}}; // around the diagonal from corner 0 to corner 7
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x)
                for (const auto& [i, j] : order) {
                    const auto corner = [&](int k) { return number(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)); };
                    std::vector<int> in, out;
                    for (const int v : {corner(0), corner(i), corner(j), corner(7)})
                        (value[static_cast<std::size_t>(v)] > 0 ? in : out).push_back(v);
                    if (in.size() == 1) face(cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2]), place(in[0]));
                    if (in.size() == 3) face(cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0]), place(in[0]));
                    if (in.size() != 2) continue;
                    const std::uint32_t a = cut(in[0], out[0]), b = cut(in[0], out[1]), c = cut(in[1], out[1]), d = cut(in[1], out[0]);
                    face(a, b, c, place(in[0]));
                    face(a, c, d, place(in[1]));
                }
    return mesh;
}

// Random balls run together; some apart, some with holes.
inline TriangleMesh blobs(std::mt19937& random, int n, int balls)
{
    std::uniform_real_distribution<double> any(0, 1);
    std::vector<std::pair<Vec3, double>> list;
    for (int i = 0; i < balls; ++i)
        list.emplace_back(Vec3(any(random), any(random), any(random)) * 1.2 - Vec3(0.6, 0.6, 0.6), 0.1 + 0.15 * any(random));
    return marching_tetrahedra(n, [&list](const Vec3& p) {
        double sum = -0.5;
        for (const auto& [center, radius] : list) sum += std::exp(-(p - center).length2() / (radius * radius));
        return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > 0.999 ? -1.0 : sum;
    });
}

inline TriangleMesh turned_inside_out(TriangleMesh mesh)
{
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

inline TriangleMesh mapped(TriangleMesh mesh, const std::function<Vec3(const Vec3&)>& map)
{
    for (Imath::V3f& p : mesh.positions) p = Imath::V3f(map(Vec3(p)));
    return mesh;
}

inline TriangleMesh joined_together(const std::vector<TriangleMesh>& meshes)
{
    TriangleMesh all;
    for (const TriangleMesh& mesh : meshes) {
        const auto first = static_cast<std::uint32_t>(all.positions.size());
        all.positions.insert(all.positions.end(), mesh.positions.begin(), mesh.positions.end());
        for (const Triangle& t : mesh.triangles) all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    }
    return all;
}

inline Topology topology_of(const TriangleMesh& mesh)
{
    const TriangleMesh* const list[] = {&mesh};
    return Topology(list);
}

} // namespace penumbra::test
