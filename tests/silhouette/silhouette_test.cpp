// Silhouettes of closed, open and broken meshes: loops, degrees, sheets, and how they tie to what rays cross.
#include <algorithm>
#include <limits>
#include <map>

#include <penumbra/error.hpp>

#include "silhouette/oracle.hpp"

namespace penumbra::test {
namespace {

Vec3 random_direction(std::mt19937& random)
{
    std::normal_distribution<double> normal;
    return Vec3(normal(random), normal(random), normal(random)).normalized();
}

int degree_at(const Topology& topology, const Silhouette& silhouette, const Vec3& place)
{
    int degree = 0;
    for (const auto& [vertex, count] : expect_even_degrees(silhouette))
        if (Vec3(topology.vertices()[vertex]) == place) degree += count;
    return degree;
}

TEST(Silhouette, CubeFromItsAxisAndFromACorner)
{
    const Topology topology = topology_of(cube());
    const Silhouette front = checked(topology, {0, 0, 5});
    EXPECT_EQ(front.facing.size(), 2u);
    EXPECT_EQ(front.sheets(), 1u);
    ASSERT_EQ(front.loops(), 1u);
    ASSERT_EQ(front.edges.size(), 4u);
    // Counter-clockwise seen from above.
    double area = 0;
    for (const SilhouetteEdge& e : front.edges) {
        const Imath::V3f a = topology.vertices()[e.from], b = topology.vertices()[e.to];
        EXPECT_EQ(a.z, 1);
        area += (a.x * b.y - a.y * b.x) / 2.0;
    }
    EXPECT_EQ(area, 4);

    const Silhouette corner = checked(topology, {5, 5, 5});
    EXPECT_EQ(corner.facing.size(), 6u);
    EXPECT_EQ(corner.edges.size(), 6u);
    EXPECT_EQ(corner.loops(), 1u);
}

TEST(Silhouette, PointsInPlanesOnEdgesAtVerticesAndInside)
{
    const Topology topology = topology_of(cube());
    EXPECT_EQ(checked(topology, {5, 0, 1}).facing.size(), 2u) << "edge-on to the top, before one side";
    EXPECT_EQ(checked(topology, {0.5, 0.25, 1}).facing.size(), 0u) << "on the top";
    EXPECT_EQ(checked(topology, {1, 1, 0}).facing.size(), 0u) << "on an edge";
    EXPECT_EQ(checked(topology, {1, 1, 1}).facing.size(), 0u) << "at a corner";
    EXPECT_EQ(checked(topology, {1, 1, 2}).facing.size(), 2u) << "above a corner";
    const Silhouette inside = checked(topology, {0.1, 0.2, 0.3});
    EXPECT_EQ(inside.facing.size(), 0u);
    EXPECT_EQ(inside.loops(), 0u);
    EXPECT_EQ(inside.sheets(), 0u);
}

TEST(Silhouette, ClosedMeshesFromEverywhere)
{
    std::mt19937 random(3);
    for (int round = 0; round < 12; ++round) {
        const Topology topology = topology_of(round % 4 == 0   ? sphere(random, 3 + round, 0.3)
                                              : round % 4 == 1 ? torus(5 + static_cast<std::uint32_t>(round), 4)
                                              : round % 4 == 2 ? blobs(random, 14, 6)
                                                               : tetrahedron(random_direction(random), random_direction(random),
                                                                             random_direction(random), random_direction(random)));
        ASSERT_GT(topology.triangles().size(), 0u);
        for (const double distance : {0.0, 0.9, 2.0, 3.5, 100.0}) {
            SCOPED_TRACE(testing::Message() << "round " << round << ", distance " << distance);
            checked(topology, random_direction(random) * distance);
            // From a vertex, where many triangles are seen edge-on.
            checked(topology, Vec3(topology.vertices()[random() % topology.vertices().size()]));
        }
    }
}

// Rays that leave a closed mesh pass as many triangles from outside as from inside; and those that are passed from outside are counted by
// the loops around the ray.
TEST(Silhouette, LoopsWindAsOftenAsRaysEnter)
{
    std::mt19937 random(4);
    int most = 0, rays = 0;
    for (int round = 0; round < 8; ++round) {
        const TriangleMesh several =
            joined_together({blobs(random, 16, 8), mapped(torus(16, 12), [](const Vec3& p) { return Vec3(p.x / 3, p.z / 3, p.y / 3); })});
        const Topology topology = topology_of(round % 2 == 0 ? blobs(random, 16, 8) : several);
        const Vec3 point = random_direction(random) * 6;
        const Silhouette silhouette = checked(topology, point);
        for (int i = 0; i < 200; ++i) {
            const Vec3 direction = random_direction(random) * 0.9 - point; // all lies within 2 of the origin: before the plane
            const int entered = crossings(topology, silhouette.facing, point, direction);
            EXPECT_EQ(crossings(topology, topology.triangles(), point, direction), 0);
            EXPECT_EQ(winding_number(topology, silhouette, point, direction), entered);
            most = std::max(most, entered);
            rays += entered > 0;
        }
    }
    EXPECT_GE(most, 3) << "the scenes have no layers";
    EXPECT_GE(rays, 200) << "hardly a ray hits";
}

TEST(Silhouette, FromInsideRaysOnlyLeave)
{
    std::mt19937 random(5);
    const Topology topology = topology_of(torus(24, 16));
    for (int i = 0; i < 100; ++i) EXPECT_EQ(crossings(topology, topology.triangles(), {2.1, 0.1, 0.2}, random_direction(random)), -1);
}

TEST(Silhouette, ATorusSeenThroughItsHoleHasTwoLoops)
{
    const Silhouette silhouette = checked(topology_of(torus(32, 16)), {0.01, 0.02, 30});
    EXPECT_EQ(silhouette.sheets(), 1u);
    EXPECT_EQ(silhouette.loops(), 2u);
}

// A height field z = r cos(m a) around the origin, on a regular polygon, closed downwards: a saddle of m legs.
TriangleMesh saddle(int m, std::uint32_t n)
{
    TriangleMesh mesh;
    const std::uint32_t top = add(mesh, {0, 0, 0}), bottom = add(mesh, {0, 0, -3});
    for (std::uint32_t i = 0; i < n; ++i) {
        const double a = 2 * std::numbers::pi * (i + 0.37) / n; // no triangle's plane through the point
        add(mesh, {std::cos(a), std::sin(a), std::cos(m * a)});
    }
    for (std::uint32_t i = 0; i < n; ++i) {
        mesh.triangles.push_back({top, 2 + i, 2 + (i + 1) % n});
        mesh.triangles.push_back({bottom, 2 + (i + 1) % n, 2 + i});
    }
    return mesh;
}

// Across the slopes of such a saddle, (1 + m) cos((m - 1) a) + (1 - m) cos((m + 1) a) of them, changes between facing and not 2 (m - 1)
// times: so many edges meet at its middle. (Paper V: "we have seen vertices with degrees 2, 4, 6, and 8".)
TEST(Silhouette, SaddlesHaveVerticesOfDegreeFourSixAndEight)
{
    for (const int m : {2, 3, 4, 5}) {
        const Topology topology = topology_of(saddle(m, 64 * static_cast<std::uint32_t>(m) + 1));
        const Silhouette silhouette = checked(topology, {40, 0, 0});
        EXPECT_EQ(degree_at(topology, silhouette, {0, 0, 0}), 2 * (m - 1));
        EXPECT_EQ(degree_at(topology, checked(topology, {0, 0, 40}), {0, 0, 0}), 0);
    }
}

// Pyramids that meet in one apex, beside each other as the point sees them: each has a loop of its own.
TEST(Silhouette, PyramidsAtOneApexKeepTheirLoops)
{
    for (const int n : {1, 2, 3, 4}) {
        std::vector<TriangleMesh> pyramids;
        for (int i = 0; i < n; ++i) {
            const double a = 2 * std::numbers::pi * i / n;
            const Vec3 out(std::cos(a), std::sin(a), 0), along(-std::sin(a), std::cos(a), 0);
            pyramids.push_back(tetrahedron({0, 0, 0}, out + along * 0.3, out - along * 0.3, out + Vec3(0, 0, 0.3)));
        }
        const Topology topology = topology_of(joined_together(pyramids));
        const Silhouette silhouette = checked(topology, {0.01, 0.02, 9});
        EXPECT_EQ(degree_at(topology, silhouette, {0, 0, 0}), 2 * n);
        EXPECT_EQ(silhouette.loops(), static_cast<std::size_t>(n));
        EXPECT_EQ(silhouette.sheets(), static_cast<std::size_t>(n));
        EXPECT_EQ(silhouette.edges.size(), static_cast<std::size_t>(4 * n));
    }
}

TEST(Silhouette, OpenSurfacesCastFromBothSides)
{
    for (const bool inside_out : {false, true}) {
        const Topology topology = topology_of(inside_out ? turned_inside_out(square()) : square());
        for (const double z : {5.0, -5.0}) {
            const Silhouette silhouette = checked(topology, {0.1, 0.2, z});
            EXPECT_EQ(silhouette.facing.size(), 2u);
            EXPECT_EQ(silhouette.edges.size(), 4u);
            EXPECT_EQ(silhouette.loops(), 1u);
        }
        EXPECT_EQ(checked(topology, {5, 3, 0}).facing.size(), 0u);
    }

    // A bowl: looking in, its rim alone is silhouette.
    TriangleMesh bowl;
    constexpr std::uint32_t n = 12;
    for (std::uint32_t i = 0; i <= n; ++i)
        for (std::uint32_t j = 0; j <= n; ++j) {
            const double x = 2.0 * i / n - 1, y = 2.0 * j / n - 1;
            add(bowl, {x, y, x * x + y * y});
        }
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < n; ++j) {
            const std::uint32_t a = i * (n + 1) + j, b = a + n + 1;
            bowl.triangles.push_back({a, b, b + 1});
            bowl.triangles.push_back({a, b + 1, a + 1});
        }
    const Topology topology = topology_of(bowl);
    EXPECT_EQ(topology.open_edges(), 4 * n);
    const Silhouette in = checked(topology, {0.01, 0.02, 20});
    EXPECT_EQ(in.loops(), 1u);
    EXPECT_EQ(in.edges.size(), 4 * n);
    EXPECT_EQ(in.facing.size(), topology.triangles().size());
    // From the side its outside and its inside face the point, on two sheets that end at the fold between them.
    const Silhouette side = checked(topology, {20, 0.1, 0.2});
    EXPECT_EQ(side.facing.size(), topology.triangles().size());
    EXPECT_EQ(side.sheets(), 2u);
    EXPECT_GT(side.edges.size(), 4 * n);
}

// Of surfaces that can be wound alike a sheet is one side: all its triangles as wound, or all turned; of closed ones never turned.
TEST(Silhouette, SheetsAreSides)
{
    std::mt19937 random(11);
    for (int round = 0; round < 20; ++round) {
        const TriangleMesh whole = sphere(random, 9, 0.4), torn = [&] {
            TriangleMesh mesh = mapped(whole, [](const Vec3& p) { return p + Vec3(3, 0, 0); });
            mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(random() % mesh.triangles.size()));
            return mesh;
        }();
        const TriangleMesh* const list[] = {&whole, &torn};
        const Topology topology(list);
        const Vec3 point = Vec3(1.5, 0, 0) + random_direction(random) * 6;
        const Silhouette silhouette = checked(topology, point);
        ASSERT_EQ(silhouette.sides.size(), silhouette.sheets());
        // Triangles as wound, from their first vertex on.
        std::map<Triangle, std::uint32_t> component_of;
        for (std::uint32_t t = 0; t < topology.triangles().size(); ++t) {
            Triangle v = topology.triangles()[t];
            std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
            component_of[v] = topology.component(t);
        }
        EXPECT_NE(topology.component(0), topology.component(static_cast<std::uint32_t>(whole.triangles.size())));
        int turned_sheets = 0;
        for (std::size_t s = 0; s < silhouette.sheets(); ++s) {
            turned_sheets += silhouette.sides[s].turned;
            for (std::uint32_t i = silhouette.facing_begin[s]; i < silhouette.facing_begin[s + 1]; ++i) {
                Triangle v = silhouette.facing[i];
                if (silhouette.sides[s].turned) std::swap(v[1], v[2]);
                std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
                const auto found = component_of.find(v);
                ASSERT_NE(found, component_of.end()) << "sheet " << s;
                EXPECT_EQ(found->second, silhouette.sides[s].component);
            }
            if (silhouette.sides[s].turned) {
                EXPECT_EQ(silhouette.sides[s].component, topology.component(static_cast<std::uint32_t>(whole.triangles.size())));
            }
        }
        EXPECT_GT(turned_sheets, 0);
    }
}

// Three half-planes at an edge: two that face each other across it are one sheet, whatever their winding, so that no seam of the winding is
// a silhouette. It counts as the side that most of its triangles show.
TEST(Silhouette, ASheetAcrossASeamOfTheWindingStaysWhole)
{
    for (const bool turn : {false, true}) {
        TriangleMesh fan;
        for (const Vec3& p : {Vec3(0, -1, 0), Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(-0.1, 0, 1)}) add(fan, p);
        fan.triangles = {{1, 0, 2}, turn ? Triangle{1, 0, 3} : Triangle{0, 1, 3}, {0, 1, 4}};
        const Topology topology = topology_of(fan);
        const Silhouette silhouette = checked(topology, {0.1, 0.05, 9});
        EXPECT_EQ(silhouette.sheets(), 2u);
        for (const SheetSide& side : silhouette.sides) EXPECT_EQ(side.component, topology.component(0));
    }
}

TEST(Silhouette, AFoldStandsThereOnceForEachTriangle)
{
    // A sheet folded along the y axis, open to the right: from above both halves pass the fold the same way.
    TriangleMesh mesh;
    for (const Vec3& p : {Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(1, 0.5, 0.1), Vec3(1, 0.5, -0.1)}) add(mesh, p);
    mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
    const Silhouette silhouette = checked(topology_of(mesh), {0.5, 0.5, 9});
    EXPECT_EQ(silhouette.sheets(), 2u);
    EXPECT_EQ(silhouette.loops(), 2u);
    EXPECT_EQ(silhouette.edges.size(), 6u);
}

TEST(Silhouette, EdgesOfThreeAndMoreTriangles)
{
    std::mt19937 random(7);
    for (int pages = 3; pages < 9; ++pages) {
        TriangleMesh book;
        add(book, {0, 0, -1});
        add(book, {0, 0, 1});
        for (int i = 0; i < pages; ++i) {
            const double a = 2 * std::numbers::pi * i / pages;
            const std::uint32_t v = add(book, {std::cos(a), std::sin(a), 0});
            book.triangles.push_back(random() % 2 == 0 ? Triangle{0, 1, v} : Triangle{1, 0, v});
        }
        const Topology topology = topology_of(book);
        EXPECT_EQ(topology.nonmanifold_edges(), 1u);
        for (int i = 0; i < 20; ++i) EXPECT_EQ(checked(topology, random_direction(random) * 3).facing.size(), book.triangles.size());
    }
}

// Triangles between random vertices of a few: edges of many, vertices of any fan.
TEST(Silhouette, AnySoupOfTriangles)
{
    std::mt19937 random(8);
    for (int round = 0; round < 60; ++round) {
        TriangleMesh soup;
        const auto n = 4 + static_cast<std::uint32_t>(random() % 8);
        const auto any = [&random, n] { return static_cast<std::uint32_t>(random() % n); };
        for (std::uint32_t i = 0; i < n; ++i) add(soup, random_direction(random));
        for (int i = 0; i < 40; ++i) {
            const std::uint32_t a = any(), b = any(), c = any();
            soup.triangles.push_back({a, b, c});
        }
        const Topology topology = topology_of(soup);
        SCOPED_TRACE(round);
        for (int i = 0; i < 4; ++i) checked(topology, random_direction(random) * (0.5 * i));
        checked(topology, Vec3(topology.vertices()[0]));
    }
}

TEST(Silhouette, HugeTinyAndFarAway)
{
    std::mt19937 random(9);
    const TriangleMesh shape = sphere(random, 7, 0.2);
    const Vec3 point = Vec3(2, 3, 4);
    const Silhouette near = checked(topology_of(shape), point);
    // Scaled by powers of two nothing changes but exponents.
    for (const int exponent : {-100, -66, -20, 20, 66, 120}) {
        const double scale = std::ldexp(1, exponent);
        const Silhouette scaled = checked(topology_of(mapped(shape, [scale](const Vec3& p) { return p * scale; })), point * scale);
        EXPECT_EQ(scaled.facing, near.facing) << exponent;
        EXPECT_EQ(scaled.loop_begin, near.loop_begin) << exponent;
    }
    for (const double scale : {1e-20, 1e20})
        checked(topology_of(mapped(shape, [scale](const Vec3& p) { return p * scale; })), point * scale);
    // At 2^20 from the origin float32 places are 1/8 apart: coarse, but no less closed.
    const Vec3 away(0x1p20, -0x1p20, 0x1p20);
    const Topology far = topology_of(mapped(shape, [&away](const Vec3& p) { return p * 4 + away; }));
    EXPECT_EQ(far.open_edges(), 0u);
    EXPECT_GT(checked(far, point * 4 + away).sheets(), 0u);
    checked(far, {0, 0, 0});
}

TEST(Silhouette, NothingAndNoPoint)
{
    const Silhouette none = checked(topology_of({}), {1, 2, 3});
    EXPECT_EQ(none.sheets(), 0u);
    EXPECT_EQ(none.loops(), 0u);
    EXPECT_EQ(Silhouette().sheets(), 0u);
    EXPECT_EQ(Silhouette().loops(), 0u);
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        try {
            silhouette_of(topology_of(cube()), {0, bad, 0});
            FAIL() << "took a point at " << bad;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        }
    }
}

TEST(Silhouette, TouchingObjectsKeepTheirOwn)
{
    const TriangleMesh a = box({0, 0, 0}, {1, 1, 1}), b = box({1, 0, 0}, {2, 1, 1});
    const TriangleMesh* const list[] = {&a, &b};
    const Silhouette apart = checked(Topology(list), {1, 0.5, 9});
    EXPECT_EQ(apart.sheets(), 2u);
    EXPECT_EQ(apart.edges.size(), 8u);
    // Welded the tops are one sheet, and the edge between them is no silhouette.
    const Silhouette together = checked(topology_of(joined_together({a, b})), {1, 0.5, 9});
    EXPECT_EQ(together.sheets(), 1u);
    EXPECT_EQ(together.edges.size(), 6u);
}

} // namespace
} // namespace penumbra::test
