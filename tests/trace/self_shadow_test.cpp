// What casts and receives at once shadows itself only where it hides the light, at any scale: no acne, no leaks.
#include <gtest/gtest.h>

#include "meshes.hpp"

namespace penumbra {
namespace {

// Where a scene may stand: its scale, how far the world's origin is, where the tracer's origin is.
struct Placement {
    double scale;
    Vec3 shift; // in units of the scene
    bool light_is_origin;
};

const Placement placements[] = {{1e-6, {0, 0, 0}, true},    {1, {0, 0, 0}, true},        {1e6, {0, 0, 0}, true},
                                {1, {500, -300, 40}, true}, {1e6, {50, 80, -70}, false}, {1e-6, {5, 3, 9}, false}};

TriangleMesh placed(TriangleMesh mesh, const Placement& at)
{
    for (Imath::V3f& p : mesh.positions) p = Imath::V3f((Vec3(p) + at.shift) * at.scale);
    return mesh;
}

Vec3 placed(const Vec3& p, const Placement& at) { return (p + at.shift) * at.scale; }

TEST(SelfShadow, LoneQuadIsLit)
{
    for (const Placement& at : placements)
        for (const double tilt_deg : {0., 1., 30., 60., 80., 88.}) {
            const double tilt = tilt_deg * std::numbers::pi / 180;
            const Vec3 along(std::cos(tilt), std::sin(tilt), 0), normal(-along.y, along.x, 0);
            const TriangleMesh mesh = placed(quad({0, 0, 0}, along * 4, {0, 0, -4}), at);

            // The light is all on the lit side, seen at an angle of 10 degrees from its nearest corner: far above what rounding can tilt.
            const double size = 0.3 * at.scale;
            const Vec3 middle = normal * 2 + along * -1.5;
            const Light light = SphereLight{.center = placed(middle, at), .radius = size, .direction = -normal, .up = {}};
            const Tracer tracer = tracer_of({mesh}, at.light_is_origin ? placed(middle, at) : Vec3(0, 0, 0));

            // Cameras at all heights above the quad, down to one that grazes it at less than a degree.
            for (const double height : {4., 0.5, 0.02}) {
                const Vec3 eye = normal * height + (along * 0.3 + Vec3(0, 0, 6)) * (height < 1 ? 1 : 0.1);
                const Camera camera = camera_at(placed(eye, at), placed(Vec3(0, 0, 0), at), 0.6);
                const DepthMap depth = tracer.front(camera, 61, 47);
                const Image mask = trace_visibility(tracer, light, depth, camera, {.samples = 16}).visibility;
                int seen = 0, acne = 0;
                for (std::size_t i = 0; i < depth.depth.size(); ++i) {
                    seen += depth.depth[i] != nothing_there;
                    acne += mask.pixels[i] != 1.f;
                }
                EXPECT_GT(seen, 10);
                EXPECT_EQ(acne, 0) << "of " << seen << ", tilt " << tilt_deg << ", scale " << at.scale << ", shift " << at.shift
                                   << ", height " << height;
            }

            // Seen from the other side it is all in shadow: the quad is between.
            const Camera below = camera_at(placed(normal * -4 + Vec3(0, 0, 0.1), at), placed(Vec3(0, 0, 0), at), 0.6);
            const DepthMap depth = tracer.front(below, 61, 47);
            const Image mask = trace_visibility(tracer, light, depth, below, {.samples = 16}).visibility;
            for (std::size_t i = 0; i < depth.depth.size(); ++i)
                if (depth.depth[i] != nothing_there) {
                    ASSERT_EQ(mask.pixels[i], 0.f) << "tilt " << tilt_deg << ", scale " << at.scale << ", shift " << at.shift;
                }
        }
}

// The facet of a convex mesh that holds a point best.
Vec3 facet_normal(const TriangleMesh& mesh, const Vec3& p, const Vec3& center, double& height_of_center)
{
    double best = -1e300;
    Vec3 found;
    for (const auto& t : mesh.triangles) {
        const Vec3 a(mesh.positions[t[0]]), n = (Vec3(mesh.positions[t[1]]) - a).cross(Vec3(mesh.positions[t[2]]) - a).normalized();
        const double height = n.dot(p - a);
        if (height > best) best = height, found = n, height_of_center = n.dot(center - a);
    }
    return found;
}

TEST(SelfShadow, ConvexMeshShadowsItselfByItsFacets)
{
    // On a convex mesh a facet sees exactly what is above its plane: a light all above is free, a light all below is blocked, with no
    // noise.
    for (const Placement& at : placements) {
        const TriangleMesh mesh = placed(sphere({0, 0, 0}, 1, 3), at);
        const Vec3 light_center = placed(Vec3(3, 4, 2), at);
        const Vec3 target = placed(Vec3(0, 0, 0), at);
        const double radius = 0.5 * at.scale;
        const Light light = SphereLight{.center = light_center, .radius = radius, .direction = target - light_center, .up = {}};
        const Tracer tracer = tracer_of({mesh}, at.light_is_origin ? light_center : Vec3(0, 0, 0));
        const Camera camera = camera_at(placed(Vec3(4, 2, -1), at), target, 0.3);
        const DepthMap depth = tracer.front(camera, 61, 61);
        const Image mask = trace_visibility(tracer, light, depth, camera, {.samples = 64}).visibility;
        int lit = 0, dark = 0;
        for (int y = 0; y < 61; ++y)
            for (int x = 0; x < 61; ++x) {
                if (depth.at(x, y) == nothing_there) continue;
                const Vec3 p = world_point(camera, 61, 61, x + 0.5, y + 0.5, depth.at(x, y));
                double height = 0;
                facet_normal(mesh, p, light_center, height);
                if (height > radius) {
                    EXPECT_EQ(mask.at(x, y), 1.f) << "scale " << at.scale << ", shift " << at.shift << " at " << x << ", " << y;
                    ++lit;
                }
                // Below by more than the neighbouring facets' tilt: at an edge, a receiver may lie on the next one, which sees more.
                if (height < -radius - 1.5 * at.scale) {
                    EXPECT_EQ(mask.at(x, y), 0.f) << "scale " << at.scale << ", shift " << at.shift;
                    ++dark;
                }
            }
        EXPECT_GT(lit, 300);
        EXPECT_GT(dark, 30);
    }
}

TEST(SelfShadow, NearOccludersDoNotLeak)
{
    // A plate just above a floor, both cast and receive: umbra right up to the contact.
    for (const Placement& at : placements)
        for (const double gap : {1e-2, 1e-3}) {
            const std::vector<TriangleMesh> meshes = {placed(parallel_quad(-3, 3, -3, 3, 5), at),
                                                      placed(parallel_quad(-1, 1, -1, 1, 5 - gap), at)};
            const Vec3 center = placed(Vec3(0, 0, 0), at);
            const Light light = RectangleLight{
                .center = center, .half_u = Vec3(0.5, 0, 0) * at.scale, .half_v = Vec3(0, 0, -0.5) * at.scale, .emission = {}};
            const Tracer tracer = tracer_of(meshes, at.light_is_origin ? center : Vec3(0, 0, 0));
            const Tracer floor = tracer_of({meshes[0]}, center);
            const Camera camera = camera_of(light, 0.5, center);
            const DepthMap depth = floor.front(camera, 60, 60);
            const Image mask = trace_visibility(tracer, light, depth, camera, {.samples = 16}).visibility;
            for (int y = 0; y < 60; ++y)
                for (int x = 0; x < 60; ++x) {
                    const Vec3 p = camera_point(camera, 60, 60, x + 0.5, y + 0.5, 5);
                    const double inside = 1 - std::max(std::abs(p.x), std::abs(p.y));
                    // The light's half width and the view's slant reach gap (0.5 + 2.5) / 5 around the plate's edge.
                    if (inside > gap) {
                        EXPECT_EQ(mask.at(x, y), 0.f) << "gap " << gap << ", scale " << at.scale << ", shift " << at.shift;
                    }
                    if (inside < -gap) {
                        EXPECT_EQ(mask.at(x, y), 1.f) << "gap " << gap << ", scale " << at.scale << ", shift " << at.shift;
                    }
                }
        }
}

TEST(SelfShadow, FinelyTiledFloorBesideACoarseOne)
{
    // Two coplanar meshes of very different triangle sizes: the coarse triangles' rounding must not shadow the fine ones' receivers.
    std::vector<TriangleMesh> meshes = {quad({-50, 0, 0}, {50, 0, 0}, {0, 0, -50})};
    for (int i = 0; i < 20; ++i)
        for (int j = -10; j < 10; ++j) meshes.push_back(quad({i * 0.02 + 0.01, 0, j * 0.02 + 0.01}, {0.01, 0, 0}, {0, 0, -0.01}));
    const Light light = SphereLight{.center = {1, 1, 1}, .radius = 0.3, .direction = {-1, -1, -1}, .up = {}};
    const Tracer tracer = tracer_of(meshes, {1, 1, 1});
    // The middle column lies just beside the coarse floor's edge, by less and more than its rounding.
    for (const double x : {0., 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4}) {
        const Camera camera = camera_at({x, 0.3, 0.02}, {x, 0, 0}, 0.3);
        const DepthMap depth = tracer.front(camera, 93, 93);
        const Image mask = trace_visibility(tracer, light, depth, camera, {.samples = 16}).visibility;
        for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
            ASSERT_NE(depth.depth[i], nothing_there) << i;
            ASSERT_EQ(mask.pixels[i], 1.f) << i << ", edge at " << x;
        }
    }
}

TEST(SelfShadow, DepthFromElsewhere)
{
    // The same quad, its depth in double from the plane itself or from a tracer with another origin: corners round differently each time.
    const Placement at{1, {500, -300, 40}, true};
    const Vec3 along(0.8, 0.6, 0), normal(-0.6, 0.8, 0);
    const TriangleMesh mesh = placed(quad({0, 0, 0}, along * 4, {0, 0, -4}), at);
    const Vec3 light_center = placed(normal * 2, at);
    const Light light = SphereLight{.center = light_center, .radius = 0.3, .direction = -normal, .up = {}};
    const Tracer tracer = tracer_of({mesh}, light_center), elsewhere = tracer_of({mesh}, {-70, 20, 10});
    for (const double height : {4., 1., 0.1}) {
        const Camera camera = camera_at(placed(normal * height + Vec3(0, 0, 3), at), placed(Vec3(0, 0, 0), at), 0.4);
        DepthMap exact = elsewhere.front(camera, 61, 61);
        int far = 0;
        for (int y = 0; y < 61; ++y)
            for (int x = 0; x < 61; ++x) {
                const Vec3 ray = world_point(camera, 61, 61, x + 0.5, y + 0.5, 1) - camera.frame.origin;
                const double depth = normal.dot(placed(Vec3(0, 0, 0), at) - camera.frame.origin) / normal.dot(ray);
                if (exact.at(x, y) != nothing_there) exact.at(x, y) = static_cast<float>(depth), ++far;
            }
        EXPECT_GT(far, 500);
        for (const DepthMap& depth : {exact, elsewhere.front(camera, 61, 61)}) {
            const Image mask = trace_visibility(tracer, light, depth, camera, {.samples = 16}).visibility;
            for (const float v : mask.pixels) ASSERT_EQ(v, 1.f) << "height " << height;
        }
    }
}

TEST(SelfShadow, MasksDoNotDependOnScale)
{
    const auto mask_at = [](double scale) {
        const std::vector<TriangleMesh> meshes = {scaled(sphere({0.2, -3, 0.1}, 0.7, 3), scale),
                                                  scaled(parallel_quad(-3, 3, -3, 3, 6), scale)};
        const Light light = rectangle_light(scale, 0.5 * scale);
        const Camera camera = camera_of(light, 0.5);
        const Tracer tracer = tracer_of(meshes);
        return trace_visibility(tracer, light, tracer.front(camera, 61, 61), camera, {.samples = 64}).visibility;
    };
    const Image one = mask_at(1);
    for (const double scale : {0x1p-20, 0x1p20}) EXPECT_EQ(mask_at(scale).pixels, one.pixels);
    for (const double scale : {1e-6, 1e6}) {
        // Corners round anew, so that a ray that grazes an edge may change its mind: rarely, and by one sample of 64.
        const Image other = mask_at(scale);
        int differ = 0;
        for (std::size_t i = 0; i < one.pixels.size(); ++i) differ += other.pixels[i] != one.pixels[i];
        EXPECT_LT(differ, 10);
    }
}

} // namespace
} // namespace penumbra
