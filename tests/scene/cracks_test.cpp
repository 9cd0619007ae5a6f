#include <random>

#include <gtest/gtest.h>

#include "scene/cracks.hpp"

using namespace penumbra;

namespace {

// A grid of squares as loose triangles, each corner up to `apart` off along each axis.
TriangleMesh soup(int side, double apart)
{
    std::mt19937 random(3);
    std::uniform_real_distribution<double> off(-apart, apart);
    TriangleMesh mesh;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            for (const auto& corners : {std::array{0, 1, 3}, std::array{0, 3, 2}}) {
                const auto first = static_cast<std::uint32_t>(mesh.positions.size());
                for (const int c : corners)
                    mesh.positions.emplace_back(static_cast<float>(x + c % 2 + off(random)), static_cast<float>(y + c / 2 + off(random)),
                                                0.0f);
                mesh.triangles.push_back({first, first + 1, first + 2});
            }
    return mesh;
}

} // namespace

TEST(Cracks, FoundAndJoined)
{
    const TriangleMesh mesh = soup(8, 1e-5);
    const Cracks cracks = find_cracks(mesh, 1e-3);
    EXPECT_EQ(cracks.vertices, mesh.positions.size() - 2) << "all but two corners of the sheet, which have one triangle each";
    EXPECT_GT(cracks.widest, 1e-6);
    EXPECT_LT(cracks.widest, 4e-5);
    std::vector<std::uint32_t> joined = joined_within(mesh.positions, 1e-4);
    for (std::size_t i = 0; i < joined.size(); ++i) {
        EXPECT_LE(joined[i], i);
        EXPECT_EQ(joined[joined[i]], joined[i]) << "what others are joined to stays";
        EXPECT_LE((mesh.positions[i] - mesh.positions[joined[i]]).length(), 1e-4f);
    }
    std::sort(joined.begin(), joined.end());
    joined.erase(std::unique(joined.begin(), joined.end()), joined.end());
    EXPECT_EQ(joined.size(), 81u);
}

TEST(Cracks, BordersThatLieApartAreNone)
{
    EXPECT_EQ(find_cracks(soup(8, 1e-5), 1e-7).vertices, 0u);
    EXPECT_EQ(find_cracks({}, 1).vertices, 0u);
    EXPECT_EQ(find_cracks(soup(1, 0), 0).vertices, 0u);
}
