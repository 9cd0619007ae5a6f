// Depth images of meshes: front, back, layers.
#include <limits>

#include <gtest/gtest.h>

#include <penumbra/error.hpp>

#include "io/mesh_io.hpp"
#include "meshes.hpp"

namespace penumbra {
namespace {

// The map is rounded once (2^-24), and the mesh's float32 corners, at most `size` from the camera, twice (world, relative to the origin).
// At the slopes of these cases (45 degrees at most) that moves depth by no more than itself a coordinate.
double depth_tolerance(double size) { return 0x1p-24 * size * 5; }

TEST(DepthLayers, BoxFromAbove)
{
    const Light light = rectangle_light(1, 1);
    const Tracer tracer = tracer_of({box({-1, -5, -1}, {1, -4, 1})});
    const Camera camera = camera_of(light, 0.5);
    const DepthMap front = tracer.front(camera, 61, 61), back = tracer.back(camera, 61, 61);
    const auto layers = tracer.layers(camera, 61, 61, 3);
    ASSERT_EQ(layers.size(), 3u);
    EXPECT_EQ(layers[0].depth, front.depth);
    for (int y = 0; y < 61; ++y)
        for (int x = 0; x < 61; ++x) {
            const Vec3 top = camera_point(camera, 61, 61, x + 0.5, y + 0.5, 4), bottom = camera_point(camera, 61, 61, x + 0.5, y + 0.5, 5);
            const double reach = std::max(std::abs(top.x), std::abs(top.y)), far = std::max(std::abs(bottom.x), std::abs(bottom.y));
            if (reach > 1) {
                EXPECT_EQ(front.at(x, y), nothing_there);
                EXPECT_EQ(back.at(x, y), nothing_there);
                continue;
            }
            EXPECT_NEAR(front.at(x, y), 4, depth_tolerance(5));
            // Out through the bottom or through a side.
            const double out = far <= 1 ? 5 : 4 / reach;
            EXPECT_NEAR(back.at(x, y), out, depth_tolerance(5));
            EXPECT_EQ(layers[1].at(x, y), back.at(x, y));
            EXPECT_EQ(layers[2].at(x, y), nothing_there);
        }
}

TEST(DepthLayers, StackedQuads)
{
    // Both face the light; the upper is smaller. The diagonals run through pixel centres: a crossing counts once all the same.
    const Light light = rectangle_light(1, 1);
    const Tracer tracer = tracer_of({parallel_quad(-4, 4, -4, 4, 6), parallel_quad(-1, 1, -1, 1, 3)});
    const Camera camera = camera_of(light, 0.5);
    const auto layers = tracer.layers(camera, 64, 64, 4);
    const DepthMap back = tracer.back(camera, 64, 64);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            const Vec3 p = camera_point(camera, 64, 64, x + 0.5, y + 0.5, 3);
            const bool stacked = std::abs(p.x) < 1 && std::abs(p.y) < 1;
            EXPECT_NEAR(layers[0].at(x, y), stacked ? 3 : 6, depth_tolerance(6));
            if (stacked) {
                EXPECT_NEAR(layers[1].at(x, y), 6, depth_tolerance(6));
            } else {
                EXPECT_EQ(layers[1].at(x, y), nothing_there);
            }
            EXPECT_EQ(layers[2].at(x, y), nothing_there);
            EXPECT_EQ(back.at(x, y), nothing_there) << "no normal points along the ray";
        }
}

TEST(DepthLayers, FacingFollowsTheWinding)
{
    TriangleMesh away = parallel_quad(-1, 1, -1, 1, 3);
    for (auto& t : away.triangles) std::swap(t[1], t[2]);
    const Camera camera = camera_of(rectangle_light(1, 1), 0.25);
    const Tracer tracer = tracer_of({away});
    EXPECT_EQ(tracer.back(camera, 4, 4).depth, tracer.front(camera, 4, 4).depth);
    EXPECT_NEAR(tracer.back(camera, 4, 4).at(0, 0), 3, depth_tolerance(3));
}

TEST(DepthLayers, SlantedQuadHasPlanarDepth)
{
    // Depth along the view axis of the plane x + y = 4 from a camera that looks along +x, wide field of view.
    const Camera camera = camera_at({0, 0, 0}, {1, 0, 0}, 0.7);
    const Tracer tracer = tracer_of({quad({4, 0, 0}, {-20, 20, 0}, {0, 0, 20})});
    const DepthMap map = tracer.front(camera, 61, 61);
    for (int y = 0; y < 61; ++y)
        for (int x = 0; x < 61; ++x) {
            const double up = camera_point(camera, 61, 61, x + 0.5, y + 0.5, 1).y;
            // Corners are 28 away; where the plane is grazed, depth changes by 1 / (1 + up) times as much as the plane moves.
            const double depth = 4 / (1 + up);
            EXPECT_NEAR(map.at(x, y), depth, depth_tolerance(28) / (1 + up));
        }
}

TEST(DepthLayers, OrthographicCamera)
{
    const DirectionalLight sun{.direction = {0, -1, 0}, .angular_diameter_deg = 1, .up = {}};
    const Camera camera = camera_of(sun, 3, {0, 10, 0});
    ASSERT_TRUE(camera.orthographic);
    const Tracer tracer = tracer_of({box({-1, 0, -2}, {1, 4, 2})});
    const DepthMap front = tracer.front(camera, 60, 60), back = tracer.back(camera, 60, 60);
    for (int y = 0; y < 60; ++y)
        for (int x = 0; x < 60; ++x) {
            const Vec3 p = world_point(camera, 60, 60, x + 0.5, y + 0.5, 5);
            const bool inside = std::abs(p.x) < 1 && std::abs(p.z) < 2;
            EXPECT_EQ(front.at(x, y), inside ? 6.f : nothing_there) << p;
            EXPECT_EQ(back.at(x, y), inside ? 10.f : nothing_there) << p;
        }
}

TEST(DepthLayers, NothingBehindTheCamera)
{
    const Camera camera = camera_at({0, 0, 0}, {0, 0, -1}, 0.5);
    EXPECT_EQ(tracer_of({sphere({0, 0, 5}, 1, 2)}).front(camera, 3, 3).at(1, 1), nothing_there);

    // From inside of a sphere only the far side, which faces away.
    const Tracer around = tracer_of({sphere({0, 0, 0}, 1, 4)});
    EXPECT_EQ(around.front(camera, 61, 61).depth, around.back(camera, 61, 61).depth);
    EXPECT_EQ(around.layers(camera, 61, 61, 2)[1].at(30, 30), nothing_there);
}

TEST(DepthLayers, FarCameraKeepsItsDigits)
{
    // A telescope a million units away: rays from a float32 origin would be off by up to 0.06 sideways, a third of the quad.
    const Vec3 eye(600000.3, 500000.1, 624499.7);
    const Camera camera = camera_at(eye, {0, 0, 0}, 0.3e-6);
    const Tracer tracer = tracer_of({quad({0, 0, 0}, {0.2, 0, 0}, {0, 0.1, 0})});
    const DepthMap map = tracer.front(camera, 40, 40);
    int hits = 0;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) {
            const Vec3 ray = world_point(camera, 40, 40, x + 0.5, y + 0.5, 1e6) - eye;
            const double t = -eye.z / ray.z;
            const Vec3 p = eye + ray * t;
            const bool hit = std::abs(p.x) < 0.2 && std::abs(p.y) < 0.1;
            hits += hit;
            // The direction's float32 is off by 2^-24 over the two units that are left: nobody is that near to an edge.
            EXPECT_EQ(map.at(x, y), hit ? static_cast<float>(1e6 * t) : nothing_there) << p;
        }
    EXPECT_GT(hits, 50);
}

TEST(DepthLayers, ClosedMeshHasAnEvenNumber)
{
    const TriangleMesh bunny = read_mesh(PENUMBRA_BUNNY, "bunny");
    const Tracer tracer = tracer_of({bunny});
    EXPECT_EQ(tracer.triangle_count() + tracer.degenerate_count(), bunny.triangles.size());
    EXPECT_GT(tracer.triangle_count(), 69000u);
    EXPECT_GT(tracer.bytes(), tracer.triangle_count() * 16);

    const Imath::Box3d bounds = penumbra::bounds(bunny);
    const Vec3 center = bounds.center();
    const Camera camera = camera_at(center + Vec3(0, 0.3, 1) * (bounds.size().length() * 1.5), center, 0.4);
    constexpr int size = 200, count = 24;
    const DepthMap front = tracer.front(camera, size, size), back = tracer.back(camera, size, size);
    const auto layers = tracer.layers(camera, size, size, count);
    int hits = 0, odd = 0;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            int n = 0;
            while (n < count && layers[static_cast<std::size_t>(n)].at(x, y) != nothing_there) ++n;
            ASSERT_LT(n, count);
            for (int i = 1; i < n; ++i)
                EXPECT_GE(layers[static_cast<std::size_t>(i)].at(x, y), layers[static_cast<std::size_t>(i - 1)].at(x, y));
            EXPECT_EQ(layers[0].at(x, y), front.at(x, y));
            if (n == 0) continue;
            ++hits;
            odd += n % 2;
            if (n % 2 == 0) {
                EXPECT_GE(back.at(x, y), front.at(x, y));
            }
        }
    EXPECT_GT(hits, size * size / 10);
    EXPECT_LE(odd, hits / 1000) << "of " << hits;
}

TEST(DepthLayers, RaysThroughEdgesAndVerticesCountOnce)
{
    // An octahedron's upper vertex and edges lie exactly on the middle column and row of an odd map: one front, one back, for any origin.
    for (const Vec3& origin : {Vec3(0, 0, 0), Vec3(0.1, 0.7, -0.3), Vec3(100, 3, 7)}) {
        const Tracer tracer = tracer_of({sphere({0, 0, 0}, 1, 0)}, origin);
        const Camera camera = camera_of(DirectionalLight{}, 1, {0, 3, 0});
        const auto layers = tracer.layers(camera, 61, 61, 4);
        for (int i = 1; i < 60; ++i)
            for (const auto& [x, y] : {std::pair(i, 30), std::pair(30, i)}) {
                const double reach = std::abs(2 * (i + 0.5) / 61 - 1);
                // Corners near an origin 100 away have been rounded by 2^-24 of that.
                EXPECT_NEAR(layers[0].at(x, y), 3 - (1 - reach), depth_tolerance(origin.length() + 4));
                EXPECT_NEAR(layers[1].at(x, y), 3 + (1 - reach), depth_tolerance(origin.length() + 4));
                EXPECT_EQ(layers[2].at(x, y), nothing_there) << i << " origin " << origin;
            }
    }
}

TEST(DepthLayers, ScaleDoesNotMatter)
{
    const TriangleMesh mesh = sphere({0.2, -4, 0.1}, 1, 4);
    const Camera camera = camera_of(rectangle_light(1, 1), 0.5);
    const DepthMap one = tracer_of({mesh}).front(camera, 61, 61), back = tracer_of({mesh}).back(camera, 61, 61);
    for (const double scale : {0x1p-20, 0x1p20, 0x1p-60, 0x1p60}) {
        const Tracer tracer = tracer_of({scaled(mesh, scale)});
        const DepthMap map = tracer.front(camera, 61, 61), far = tracer.back(camera, 61, 61);
        for (std::size_t i = 0; i < one.depth.size(); ++i) {
            EXPECT_EQ(map.depth[i], one.depth[i] * static_cast<float>(scale));
            EXPECT_EQ(far.depth[i], back.depth[i] * static_cast<float>(scale));
        }
    }
    for (const double scale : {1e-6, 1e6}) {
        const DepthMap map = tracer_of({scaled(mesh, scale)}).front(camera, 61, 61);
        int differ = 0;
        // Corners round anew: where the facets are no steeper than 60 degrees, by twice as much in depth.
        for (std::size_t i = 0; i < one.depth.size(); ++i)
            differ += !(std::abs(map.depth[i] / scale - one.depth[i]) <= 2 * depth_tolerance(5) || map.depth[i] == one.depth[i]);
        EXPECT_LT(differ, 61) << "at the silhouette only";
    }
}

TEST(DepthLayers, DegenerateTrianglesAreCountedAndLeftOut)
{
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    TriangleMesh mesh = parallel_quad(-1, 1, -1, 1, 3);
    mesh.positions.insert(mesh.positions.end(), {{nan, 0, 0}, {0, inf, 0}, {0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {1e38f, 1e38f, 1e38f}});
    mesh.triangles.insert(mesh.triangles.end(), {{0, 1, 4}, {0, 5, 1}, {0, 0, 1}, {6, 7, 8}, {2, 2, 2}});
    const Tracer tracer = tracer_of({mesh});
    EXPECT_EQ(tracer.triangle_count(), 2u);
    EXPECT_EQ(tracer.degenerate_count(), 5u);
    EXPECT_NEAR(tracer.front(camera_of(rectangle_light(1, 1), 0.2), 1, 1).at(0, 0), 3, depth_tolerance(3));

    TriangleMesh wrong = mesh;
    wrong.triangles.push_back({0, 1, 10});
    try {
        tracer_of({mesh, wrong});
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_NE(error.message().find("vertex 10"), std::string::npos) << error.message();
    }
}

TEST(DepthLayers, NoMeshes)
{
    const Tracer tracer = tracer_of({});
    EXPECT_EQ(tracer.triangle_count(), 0u);
    const Camera camera = camera_of(rectangle_light(1, 1), 0.5);
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(1, 61), std::pair(7, 1)}) {
        EXPECT_EQ(tracer.front(camera, width, height).depth, flat_map(width, height, nothing_there).depth);
        EXPECT_EQ(tracer.back(camera, width, height).depth, flat_map(width, height, nothing_there).depth);
        EXPECT_EQ(tracer.layers(camera, width, height, 2)[1].depth, flat_map(width, height, nothing_there).depth);
    }
    EXPECT_THROW(tracer.front(camera, 0, 5), Error);
    EXPECT_THROW(tracer.layers(camera, 5, 5, -1), Error);
    EXPECT_TRUE(tracer.layers(camera, 5, 5, 0).empty());
}

} // namespace
} // namespace penumbra
