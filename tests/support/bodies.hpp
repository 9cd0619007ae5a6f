// Closed bodies that cast and receive.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <penumbra/scene.hpp>

namespace penumbra::test {

inline Object object_of(std::vector<Vec3> positions, std::vector<std::array<std::uint32_t, 3>> triangles)
{
    Object object;
    object.name = "body";
    for (const Vec3& p : positions) object.mesh.positions.emplace_back(p);
    for (const auto& t : triangles) object.mesh.triangles.push_back({t[0], t[1], t[2]});
    object.casts = object.receives = true;
    return object;
}

// A ball of 20 * 4^divisions facets.
inline Object ball(int divisions, const Vec3& center)
{
    const double t = (1 + std::sqrt(5.)) / 2;
    std::vector<Vec3> corners{{-1, t, 0}, {1, t, 0}, {-1, -t, 0}, {1, -t, 0}, {0, -1, t}, {0, 1, t}, {0, -1, -t}, {0, 1, -t}, {t, 0, -1}, {t, 0, 1}, {-t, 0, -1}, {-t, 0, 1}};
    std::vector<std::array<std::uint32_t, 3>> facets{{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                                    {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8}, {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}};
    for (Vec3& corner : corners) corner = corner.normalized();
    for (int i = 0; i < divisions; ++i) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [place, made] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(corners.size()));
            if (made) corners.push_back((corners[a] + corners[b]).normalized());
            return place->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : facets) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        facets = std::move(finer);
    }
    for (Vec3& corner : corners) corner = corner + center;
    return object_of(std::move(corners), std::move(facets));
}

inline Object box(const Vec3& center, double half)
{
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i) corners.push_back(center + Vec3((i & 4) ? half : -half, (i & 2) ? half : -half, (i & 1) ? half : -half));
    return object_of(std::move(corners), {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1}, {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}});
}

} // namespace penumbra::test
