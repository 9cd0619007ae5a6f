// The device's masks against double precision (oracle/soft_shadow_volume_oracle.hpp), from the same receiver points.
#include "technique/soft_shadow_volume_run.hpp"

#include "scene/camera.hpp"

namespace penumbra::test {
namespace {

constexpr double pi = std::numbers::pi;

// Compares every receiver. Returns how many are in penumbra with a bound below 2^-4, so that a test can tell that it saw some.
int compare_with_oracle(const WedgeRun& r, const WedgeExpectation& expectation, const std::string& what)
{
    int penumbra = 0, failures = 0;
    double worst = 0;
    for (std::size_t i = 0; i < r.points.size(); ++i) {
        if (r.points[i].d == NO_RECEIVER) {
            EXPECT_EQ(r.visibility[i], 1.0F) << what << ", nothing at " << i;
            continue;
        }
        const auto expected = expectation.at(r.points[i]);
        penumbra += expected.value > 0 && expected.value < 1 && expected.bound < 0x1p-4;
        worst = std::max(worst, std::abs(r.visibility[i] - expected.value));
        if (std::abs(r.visibility[i] - expected.value) <= expected.bound) continue;
        if (++failures <= 3)
            ADD_FAILURE() << what << ", receiver " << i << " (" << r.points[i].xi << ", " << r.points[i].eta << ", " << r.points[i].d
                          << "): " << r.visibility[i] << ", expected " << expected.value << " within " << expected.bound;
    }
    EXPECT_EQ(failures, 0) << what << ", worst " << worst;
    testing::Test::RecordProperty(("worst " + what).c_str(), std::to_string(worst));
    return penumbra;
}
int compare_with_oracle(const WedgeCase& c, const std::string& what)
{
    return compare_with_oracle(run(device_context(), c), WedgeExpectation(c), what);
}

// A camera beside the light that looks at the receivers at an angle.
Camera oblique_camera()
{
    const double c = std::cos(0.3), s = std::sin(0.3);
    return {.frame = {.origin = {1.5, 0.5, -1}, .x = {c, 0, -s}, .y = {0, 1, 0}, .z = {s, 0, c}},
            .orthographic = false,
            .half_extent = {0.7, 0.5}};
}

const std::vector<std::pair<std::string, Light>> lights = {
    {"square", rectangle_light(1, 1)}, {"rectangle", rectangle_light(0.7, 0.2)}, {"small", rectangle_light(0.01, 0.02)},
    {"sphere", sphere_light(0.8)},     {"small sphere", sphere_light(0.01)},
};

// The oracle by triangles and the oracle by border edges are one by Green's theorem; and both are the closed form for a half-plane.
TEST(WedgeOracle, TrianglesAreTheirBorder)
{
    using namespace oracle::wedge;
    std::mt19937 random(1);
    std::uniform_real_distribution<double> any(-1, 1);
    for (const Shape shape : {Shape::square, Shape::disc})
        for (int i = 0; i < 2000; ++i) {
            const Receiver p{{4 * any(random), 4 * any(random), 10}};
            const auto vertex = [&] { return Vec3(3 * any(random), 3 * any(random), 5 + 2 * any(random)); };
            const Triangle t{vertex(), vertex(), vertex()};
            double border = 0;
            for (std::size_t k = 0; k < 3; ++k) border += share_of_edge(shape, p, t[k], t[(k + 1) % 3]);
            // Coordinates below 100, some tens of roundings of 2^-53; square roots in the disc's halve the digits of what is 0 there.
            EXPECT_NEAR(share_of(shape, p, t), border, 1e-12) << i;
        }
    for (double x = -2; x <= 2; x += 0.125) {
        const Triangle half{Vec3(x, -1e3, 5), Vec3(1e3, 0, 5), Vec3(x, 1e3, 5)}; // from 5 the edge lies at 2 x on the light
        const double t = std::clamp(2 * x, -1.0, 1.0);
        EXPECT_NEAR(share_of(Shape::disc, {{0, 0, 10}}, half), (std::acos(t) - t * std::sqrt(1 - t * t)) / pi, 1e-12) << x;
        EXPECT_NEAR(share_of(Shape::square, {{0, 0, 10}}, half), (1 - t) / 2, 1e-12) << x;
    }
}

TEST(SoftShadowVolumeOracle, PlanarCasters)
{
    for (const auto& [name, light] : lights) {
        WedgeCase c{.light = light, .receivers = flat(61, 47, 8)};
        c.casters = {sheet(-1.1, 1.3, -0.9, 1.7, 4)};
        const int least = name.starts_with("small") ? 5 : 100;
        EXPECT_GT(compare_with_oracle(c, name + ", parallel"), least);
        c.casters = {sheet({Vec3(-2, -1.5, 3), Vec3(2, -1.5, 6), Vec3(2, 1.5, 6.5), Vec3(-2, 1.5, 3.5)})};
        EXPECT_GT(compare_with_oracle(c, name + ", tilted"), least);
        c.casters = {sheet(-3, -2, -2, 2, 4), sheet(-1, 0, -2, 2, 4), sheet(1, 2, -2, 2, 4), sheet(3, 4, -3, 3, 4)};
        EXPECT_GT(compare_with_oracle(c, name + ", several"), least);
        c.camera = oblique_camera();
        EXPECT_GT(compare_with_oracle(c, name + ", from beside"), least);
    }
}

// Anything goes through the same formula: triangles in front of receivers and behind, across their planes, large and small.
TEST(SoftShadowVolumeOracle, TrianglesAnywhere)
{
    for (const auto& [name, light] : lights)
        for (std::uint32_t seed = 0; seed < 4; ++seed) {
            WedgeCase c{
                .light = light, .casters = soup(12, {-6, -6, 1.5}, {6, 6, 12}, seed), .receivers = random_map(40, 24, 4, 9, 0.1, seed + 9)};
            compare_with_oracle(c, name + ", soup " + std::to_string(seed));
            c.camera = oblique_camera();
            compare_with_oracle(c, name + ", soup from beside " + std::to_string(seed));
        }
}

// Vertices at and behind the light's plane, but nothing that passes through the light itself.
TEST(SoftShadowVolumeOracle, AcrossTheLightsPlane)
{
    for (const auto& [name, light] : lights) {
        WedgeCase c{.light = light, .receivers = random_map(40, 24, 4, 9, 0, 5)};
        for (const double side : {-1.0, 1.0})
            for (TriangleMesh mesh : soup(4, {1.5, -2, -3}, {4, 2, 6}, 77)) {
                for (Imath::V3f& p : mesh.positions) p.x = static_cast<float>(side) * p.x;
                c.casters.push_back(mesh);
            }
        compare_with_oracle(c, name + ", across the plane");
    }
}

TEST(SoftShadowVolumeOracle, ClosedBoxesAndSplitLights)
{
    for (const auto& [name, light] : lights)
        for (const int splits : {1, 2, 3}) {
            if (splits > 1 && std::holds_alternative<SphereLight>(light)) continue;
            WedgeCase c{.light = light, .settings = {.light_splits = splits}, .receivers = flat(40, 24, 9)};
            c.casters = {closed_box({-1, -1, 3}, {1, 1, 5}), closed_box({1.5, -2, 5}, {2.5, 2, 5.5})};
            compare_with_oracle(c, name + ", boxes, " + std::to_string(splits) + " splits");
        }
}

// Surfaces that show both their sides, some all of the one and hardly any of the other; several that hide the same light; and three half
// planes at an edge, of which the silhouette joins two whatever their winding.
TEST(SoftShadowVolumeOracle, BothSidesOfASurface)
{
    for (const auto& [name, light] : lights)
        for (const int splits : {1, 3}) {
            if (splits > 1 && std::holds_alternative<SphereLight>(light)) continue;
            const auto compare_casters = [&](const std::vector<TriangleMesh>& casters, const std::string& what) {
                WedgeCase c{.light = light, .casters = casters, .settings = {.light_splits = splits}, .receivers = flat(40, 24, 9)};
                compare_with_oracle(c, name + ", " + what + ", " + std::to_string(splits) + " splits");
            };
            compare_casters({shell({0, 0, 5}, 2, {1, 0.3, 0.1}, 4, 8)}, "a bowl from beside");
            compare_casters({shell({0.2, 0, 5}, 2, {0.1, 0.3, -1}, 7, 8)}, "a ball with a hole");
            compare_casters({shell({-1, 0, 3}, 1, {1, 0, 0}, 4, 8), shell({1, 0, 5}, 1.5, {0, 1, 0}, 5, 8), sheet(-1, 1, -1, 1, 6)},
                            "several");
            compare_casters({shell({2, 0, 0.3}, 1, {1, 1, 0}, 4, 8)}, "across the light's plane");
            for (int turned = 0; turned < 8; ++turned) {
                TriangleMesh fan =
                    mesh_of({{0, -2, 4}, {0, 2, 5}, {2, 0, 4.5}, {-2, 0, 4.5}, {1, 1, 6}}, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}});
                for (std::size_t t = 0; t < 3; ++t)
                    if ((turned >> t & 1) != 0) std::swap(fan.triangles[t][0], fan.triangles[t][1]);
                compare_casters({fan}, "a fan wound as " + std::to_string(turned));
            }
        }
}

TEST(SoftShadowVolumeOracle, EveryOverlap)
{
    for (const Overlap overlap : {Overlap::sum, Overlap::max, Overlap::half_min, Overlap::product})
        for (const auto& [name, light] : lights) {
            WedgeCase c{.light = light, .settings = {.overlap = overlap}, .receivers = flat(40, 24, 9)};
            c.casters = {sheet(-1, 1, -1, 1, 3), sheet(-0.5, 2, -2, 1.5, 5), closed_box({0, 0, 6}, {2, 2, 7})};
            compare_with_oracle(c, name + ", overlap " + std::to_string(static_cast<int>(overlap)));
        }
}

// Lights from far below the scene's size to far beyond, slivers too. Long edges over a small light must not lose what lies between.
TEST(SoftShadowVolumeOracle, LightsOfEveryExtent)
{
    for (const double half : {1e-6, 1e-4, 1e-3, 1e-2, 1.0, 30.0, 1000.0})
        for (const Light& light :
             {Light(rectangle_light(half, half)), Light(rectangle_light(half, half / 16)), Light(sphere_light(half))}) {
            // A sphere that holds the caster would be cut by it: not what this technique can tell.
            if (std::holds_alternative<SphereLight>(light) && half > 2) continue;
            WedgeCase c{.light = light, .casters = {sheet(-3, 0.013, -3, 0.027, 4)}, .receivers = flat(48, 48, 8)};
            // Receivers across the penumbra of the corner, however narrow.
            const double wide = std::min(1.0, 2 * half / 8);
            c.camera = Camera{.frame = {.origin = {0.026, 0.054, 0}}, .orthographic = false, .half_extent = {wide, wide}};
            const int seen = compare_with_oracle(c, (std::holds_alternative<SphereLight>(light) ? "sphere of " : "rectangle of ") +
                                                        std::to_string(half));
            if (half >= 1e-2 && half <= 1) {
                EXPECT_GT(seen, 500) << half;
            }
        }
}

// Receivers whose line to the light's centre passes a vertex at a distance of many magnitudes: edges that meet there see it in the same
// direction. Long edges, so that what is lost between their ends would show.
TEST(SoftShadowVolumeOracle, LinesCloseToAVertex)
{
    for (const Light& light : {Light(rectangle_light(1, 1)), Light(sphere_light(1))})
        for (const double away : {0.0, 1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2}) {
            WedgeCase c{.light = light, .receivers = flat(16, 16, 8)};
            c.casters = {mesh_of({{0, 0, 4}, {90, 37, 5}, {41, 93, 6}}, {{0, 1, 2}}),
                         mesh_of({{-9, 1, 4}, {0, 0, 4}, {-3, -80, 3}}, {{0, 1, 2}})};
            const double wide = std::max(away, 1e-30) / 8;
            c.camera = Camera{.frame = {}, .orthographic = false, .half_extent = {wide, wide}};
            compare_with_oracle(c, "away by " + std::to_string(std::log10(away)));
        }
}

// Pixel centres, vertices and the light's centre in line to the bit, over a mesh of many triangles: moved by a part of a pixel the mask
// changes by no more than that part.
TEST(SoftShadowVolumeOracle, VerticesOnLinesOfSight)
{
    TriangleMesh grid;
    for (int y = -4; y <= 4; ++y)
        for (int x = -4; x <= 4; ++x) grid.positions.emplace_back(world_of(0.25 * x, 0.25 * y, 4));
    for (std::uint32_t y = 0; y < 8; ++y)
        for (std::uint32_t x = 0; x < 8; ++x) {
            const std::uint32_t a = 9 * y + x;
            grid.triangles.push_back({a, a + 1, a + 10});
            grid.triangles.push_back({a, a + 10, a + 9});
        }
    for (const Light& light : {Light(rectangle_light(1, 1)), Light(rectangle_light(0.125, 0.125)), Light(sphere_light(0.5))}) {
        WedgeCase c{.light = light, .casters = {grid}, .receivers = flat(33, 33, 8)};
        c.camera = Camera{.frame = {}, .orthographic = false, .half_extent = {33.0 / 64, 33.0 / 64}}; // centres at multiples of 1 / 32
        EXPECT_GT(compare_with_oracle(c, "aligned"), 50);
        for (const double by : {0x1p-30, 0x1p-20, 0x1p-10}) {
            c.camera->frame.origin = {by, -by, 0};
            compare_with_oracle(c, "moved by " + std::to_string(by));
        }
    }
}

// An edge that points at the light's centre, a sheet seen edge-on, and triangles without area.
TEST(SoftShadowVolumeOracle, DegenerateCasters)
{
    for (const auto& [name, light] : lights) {
        WedgeCase c{.light = light, .receivers = flat(33, 33, 8)};
        c.casters = {sheet({Vec3(1, 0.5, 2), Vec3(2, 1, 4), Vec3(2, -1, 4), Vec3(1, -0.5, 2)}), // two edges point at the centre
                     sheet({Vec3(0, -1, 2), Vec3(0, -1, 5), Vec3(0, 1, 5), Vec3(0, 1, 2)}),     // its plane holds the centre
                     mesh_of({{-1, -1, 3}, {-1, -1, 3}, {-2, 0, 4}}, {{0, 1, 2}}),
                     mesh_of({{-1, 1, 3}, {-2, 2, 6}, {-1.5, 1.5, 4.5}}, {{0, 1, 2}})};
        compare_with_oracle(c, name + ", degenerate");
    }
}

// Far from the world's origin, and turned: what casts comes close to the light in double precision before it is rounded.
TEST(SoftShadowVolumeOracle, LightFarFromTheOrigin)
{
    const Vec3 far(4096, -8192, 2048); // float32 keeps 2^-11 of a unit there, which the casters are multiples of
    RectangleLight light = rectangle_light(1, 1);
    light.center = far;
    WedgeCase c{.light = light, .casters = {sheet(-1.125, 1.25, -0.875, 1.75, 4)}, .receivers = flat(40, 24, 8)};
    for (Imath::V3f& p : c.casters[0].positions) p = Imath::V3f(Vec3(p) + far);
    EXPECT_GT(compare_with_oracle(c, "far"), 50);
    WedgeCase near{.light = rectangle_light(1, 1), .casters = {sheet(-1.125, 1.25, -0.875, 1.75, 4)}, .receivers = flat(40, 24, 8)};
    EXPECT_EQ(run(device_context(), c).visibility, run(device_context(), near).visibility);
}

// The bound is worth something: an oracle with a triangle missing is noticed at every receiver that it shadows.
TEST(SoftShadowVolumeOracle, BoundIsSharpEnoughToMissATriangle)
{
    WedgeCase c{.casters = {sheet(-1.1, 1.3, -0.9, 1.7, 4)}, .receivers = flat(33, 33, 8)};
    const WedgeRun r = run(device_context(), c);
    WedgeExpectation whole(c), less(c);
    less.forget_a_triangle();
    int noticed = 0, shadowed = 0;
    for (std::size_t i = 0; i < r.points.size(); ++i) {
        const auto a = whole.at(r.points[i]), b = less.at(r.points[i]);
        shadowed += b.value > a.value + 0x1p-10;
        noticed += std::abs(r.visibility[i] - b.value) > b.bound;
    }
    EXPECT_GT(shadowed, 50);
    EXPECT_GE(noticed, shadowed);
}

} // namespace
} // namespace penumbra::test
