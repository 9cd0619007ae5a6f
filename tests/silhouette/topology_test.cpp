// What belongs together: welding, winding, closedness, and what is left out.
#include <limits>

#include <penumbra/error.hpp>

#include "silhouette/oracle.hpp"

namespace penumbra::test {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();

double volume(const Topology& topology)
{
    double sum = 0;
    for (const auto& [a, b, c] : topology.triangles()) {
        const auto v = topology.vertices();
        sum += Vec3(v[a]).dot(Vec3(v[b]).cross(Vec3(v[c])));
    }
    return sum / 6;
}

std::size_t closed_triangles(const Topology& topology)
{
    std::size_t count = 0;
    for (std::uint32_t t = 0; t < topology.triangles().size(); ++t) count += topology.closed(t);
    return count;
}

// Every side of every triangle once, in order.
void expect_edge_uses(const Topology& topology)
{
    const auto uses = topology.edge_uses();
    EXPECT_EQ(uses.size(), 3 * topology.triangles().size());
    std::set<std::pair<std::uint32_t, int>> sides;
    for (std::size_t i = 0; i < uses.size(); ++i) {
        const Topology::EdgeUse& use = uses[i];
        const Triangle& t = topology.triangles()[use.triangle];
        EXPECT_LT(use.low, use.high);
        EXPECT_EQ(t[use.corner], use.forward ? use.low : use.high);
        EXPECT_EQ(t[(use.corner + 1u) % 3], use.forward ? use.high : use.low);
        EXPECT_TRUE(sides.emplace(use.triangle, use.corner).second);
        if (i > 0) {
            EXPECT_LE(std::tie(uses[i - 1].low, uses[i - 1].high, uses[i - 1].triangle), std::tie(use.low, use.high, use.triangle));
        }
    }
}

// A corner of its own for each triangle.
TriangleMesh loose(const TriangleMesh& mesh)
{
    TriangleMesh soup;
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t v : t) soup.positions.push_back(mesh.positions[v]);
        const auto first = static_cast<std::uint32_t>(soup.positions.size() - 3);
        soup.triangles.push_back({first, first + 1, first + 2});
    }
    return soup;
}

TEST(Topology, LooseTrianglesAreWelded)
{
    const Topology topology = topology_of(loose(cube()));
    EXPECT_EQ(topology.vertices().size(), 8u);
    EXPECT_EQ(topology.triangles().size(), 12u);
    EXPECT_EQ(topology.open_edges(), 0u);
    EXPECT_EQ(topology.nonmanifold_edges(), 0u);
    EXPECT_EQ(topology.left_out(), 0u);
    EXPECT_EQ(closed_triangles(topology), 12u);
    EXPECT_DOUBLE_EQ(volume(topology), 8);
    expect_edge_uses(topology);
    EXPECT_GE(topology.bytes(), 8 * 12u + 12 * 12u + 12u + 36 * sizeof(Topology::EdgeUse));
}

TEST(Topology, MinusZeroIsZeroAndNothingElseIsNear)
{
    TriangleMesh mesh = loose(tetrahedron());
    for (std::size_t i = 0; i < mesh.positions.size(); i += 2)
        for (int c = 0; c < 3; ++c)
            if (mesh.positions[i][c] == 0) mesh.positions[i][c] = -0.0f;
    EXPECT_EQ(topology_of(mesh).vertices().size(), 4u);
    EXPECT_EQ(topology_of(mesh).open_edges(), 0u);
    mesh.positions[0].x = std::numeric_limits<float>::denorm_min();
    EXPECT_EQ(topology_of(mesh).vertices().size(), 5u);
    EXPECT_EQ(topology_of(mesh).open_edges(), 4u) << "two sides of one triangle, and what lay beside them";
}

TEST(Topology, MeshesStayApart)
{
    const TriangleMesh a = box({0, 0, 0}, {1, 1, 1}), b = box({1, 0, 0}, {2, 1, 1});
    const TriangleMesh* const list[] = {&a, &b};
    const Topology apart(list);
    EXPECT_EQ(apart.vertices().size(), 16u);
    EXPECT_EQ(apart.nonmanifold_edges(), 0u);
    EXPECT_EQ(closed_triangles(apart), 24u);

    // In one mesh the four corners between them are one, and the face's five edges have four triangles.
    const Topology together = topology_of(joined_together({a, b}));
    EXPECT_EQ(together.vertices().size(), 12u);
    EXPECT_EQ(together.open_edges(), 0u);
    EXPECT_GE(together.nonmanifold_edges(), 4u);
    EXPECT_EQ(closed_triangles(together), 24u);
}

TEST(Topology, BoxesThatShareAnEdgeAreClosedEachForItself)
{
    const TriangleMesh a = box({0, 0, 0}, {1, 1, 1}), b = box({1, 1, 0}, {2, 2, 1});
    for (const TriangleMesh& mesh :
         {joined_together({a, b}), joined_together({turned_inside_out(a), b}), joined_together({a, turned_inside_out(b)})}) {
        const Topology topology = topology_of(mesh);
        EXPECT_EQ(topology.nonmanifold_edges(), 1u);
        EXPECT_EQ(closed_triangles(topology), 24u);
        EXPECT_DOUBLE_EQ(volume(topology), 2);
    }
    // A sheet that hangs on a box's edge does not open it.
    TriangleMesh sheet = square(); // its edge from (1, -1, 0) to (1, 1, 0)
    const Topology topology = topology_of(joined_together({box({1, -1, 0}, {2, 1, 1}), sheet}));
    EXPECT_EQ(topology.nonmanifold_edges(), 1u);
    EXPECT_EQ(closed_triangles(topology), 12u);
    EXPECT_FALSE(topology.closed(12));
    EXPECT_FALSE(topology.closed(13));
}

TEST(Topology, OutwardWhateverTheFileSaid)
{
    std::mt19937 random(1);
    for (const TriangleMesh& sound : {tetrahedron(), cube(), torus(9, 7), sphere(random, 6, 0.1), blobs(random, 12, 3)}) {
        const double expected = volume(topology_of(sound));
        EXPECT_GT(expected, 0);
        EXPECT_DOUBLE_EQ(volume(topology_of(turned_inside_out(sound))), expected);
        TriangleMesh mixed = sound;
        for (Triangle& t : mixed.triangles)
            if (random() % 2 == 0) std::swap(t[0], t[1]);
        std::shuffle(mixed.triangles.begin(), mixed.triangles.end(), random);
        const Topology topology = topology_of(mixed);
        // Sums of thousands of volumes in another order: each addition rounds by 2^-53 of at most the sum of their sizes, below 100.
        EXPECT_NEAR(volume(topology), expected, static_cast<double>(mixed.triangles.size()) * 100 * 0x1p-53);
        EXPECT_EQ(closed_triangles(topology), topology.triangles().size());
        expect_edge_uses(topology);
        EXPECT_TRUE(boundary(topology.triangles()).empty());
    }
    // Far from the origin, where volumes from there would cancel (float32 places are 8 apart): nothing faces a point inside.
    std::uniform_real_distribution<double> anywhere(-1e8, 1e8);
    for (int i = 0; i < 50; ++i) {
        const Vec3 away(anywhere(random), anywhere(random), anywhere(random));
        const TriangleMesh far = mapped(tetrahedron(), [&away](const Vec3& p) { return p * 128 + away; });
        for (const TriangleMesh& mesh : {far, turned_inside_out(far)})
            EXPECT_TRUE(silhouette_of(topology_of(mesh), away + Vec3(32, 32, 32)).facing.empty());
    }
}

TEST(Topology, EachShellIsTurnedForItself)
{
    const TriangleMesh inner = mapped(cube(), [](const Vec3& p) { return p * 0.5; });
    for (const TriangleMesh& mesh : {joined_together({cube(), inner}), joined_together({cube(), turned_inside_out(inner)})})
        EXPECT_DOUBLE_EQ(volume(topology_of(mesh)), 9);
}

// A strip of n quads that comes back mirrored.
TriangleMesh moebius_strip(std::uint32_t n)
{
    TriangleMesh mesh;
    for (std::uint32_t i = 0; i < n; ++i) {
        const double u = 2 * std::numbers::pi * i / n;
        for (const double w : {-0.5, 0.5}) {
            const double r = 2 + w * std::cos(u / 2);
            add(mesh, {r * std::cos(u), r * std::sin(u), w * std::sin(u / 2)});
        }
    }
    for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = 2 * i, b = a + 1, c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({a, d, c});
    }
    return mesh;
}

TEST(Topology, OpenAndOneSidedSurfacesAreOpen)
{
    const Topology flat = topology_of(square());
    EXPECT_EQ(flat.open_edges(), 4u);
    EXPECT_EQ(closed_triangles(flat), 0u);

    const Topology strip = topology_of(moebius_strip(12));
    EXPECT_EQ(strip.triangles().size(), 24u);
    EXPECT_EQ(strip.open_edges(), 24u);
    EXPECT_EQ(closed_triangles(strip), 0u);

    // A Klein bottle has two triangles at every edge, but no inside.
    TriangleMesh bottle;
    constexpr std::uint32_t n = 8;
    std::mt19937 random(2);
    std::normal_distribution<double> any;
    for (std::uint32_t i = 0; i < n * n; ++i) add(bottle, Vec3(any(random), any(random), any(random)));
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < n; ++j) {
            const auto at = [](std::uint32_t x, std::uint32_t y) { return x < n ? x * n + y % n : (2 * n - y) % n; };
            bottle.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            bottle.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    const Topology klein = topology_of(bottle);
    EXPECT_EQ(klein.open_edges(), 0u);
    EXPECT_EQ(klein.nonmanifold_edges(), 0u);
    EXPECT_EQ(closed_triangles(klein), 0u);
    checked(klein, {0.3, -0.2, 0.1});
    checked(klein, {3, -2, 1});

    TriangleMesh fan = square();
    add(fan, {0, 0, 1});
    fan.triangles.push_back({0, 2, 4}); // a third triangle at the diagonal
    const Topology three = topology_of(fan);
    EXPECT_EQ(three.nonmanifold_edges(), 1u);
    EXPECT_EQ(three.open_edges(), 6u);
    EXPECT_EQ(closed_triangles(three), 0u);
}

TEST(Topology, TrianglesOfNoAreaAreLeftOut)
{
    TriangleMesh mesh = tetrahedron();
    const std::uint32_t again = add(mesh, {1, 0, 0}), middle = add(mesh, {0.5, 0, 0}), bad = add(mesh, {0, 0, 0}),
                        worse = add(mesh, {0, 0, 0});
    mesh.positions[bad].y = nan;
    mesh.positions[worse].z = -infinite;
    mesh.triangles.insert(mesh.triangles.begin(), {{0, 0, 1}, {1, 2, again}, {0, 1, middle}, {0, 1, bad}, {worse, 1, 2}});
    const Topology topology = topology_of(mesh);
    EXPECT_EQ(topology.left_out(), 5u);
    EXPECT_EQ(topology.triangles().size(), 4u);
    EXPECT_EQ(topology.vertices().size(), 4u) << "what only they used is gone";
    EXPECT_EQ(closed_triangles(topology), 4u);
    EXPECT_DOUBLE_EQ(volume(topology), 1.0 / 6);

    // Small is not none.
    for (const double size : {1e-45, 1e-38, 1e-20, 1e20, 1e38}) {
        const Topology scaled = topology_of(mapped(tetrahedron(), [size](const Vec3& p) { return p * size; }));
        EXPECT_EQ(scaled.left_out(), 0u) << size;
        EXPECT_EQ(closed_triangles(scaled), 4u) << size;
    }
}

TEST(Topology, NothingAndBadIndices)
{
    const Topology none(std::span<const TriangleMesh* const>{});
    EXPECT_TRUE(none.triangles().empty());
    EXPECT_TRUE(none.edge_uses().empty());
    EXPECT_EQ(topology_of({}).vertices().size(), 0u);

    TriangleMesh mesh = cube();
    mesh.triangles[7][1] = 8;
    try {
        topology_of(mesh);
        FAIL() << "took an index beyond the positions";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_EQ(error.message(), "mesh 0, triangle 7: vertex 8 of 8");
    }
}

TEST(Topology, TheSameTriangleTwice)
{
    // Once each way it has an inside, of no volume; twice the same way it is wound to have one.
    TriangleMesh mesh = square();
    mesh.triangles = {{0, 1, 2}, {0, 2, 1}};
    EXPECT_EQ(closed_triangles(topology_of(mesh)), 2u);
    mesh.triangles = {{0, 1, 2}, {1, 2, 0}};
    EXPECT_EQ(closed_triangles(topology_of(mesh)), 2u);
    mesh.triangles = {{0, 1, 2}, {1, 2, 0}, {0, 2, 1}};
    EXPECT_EQ(closed_triangles(topology_of(mesh)), 0u);
}

} // namespace
} // namespace penumbra::test
