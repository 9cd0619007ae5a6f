// Surfaces from depth maps: what is joined, where it ends, and that planes come out plane.
#include <limits>

#include "scene/camera.hpp"
#include "silhouette/oracle.hpp"
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

constexpr double single = 0x1p-24;

// Turned and moved, so that nothing is 0 by chance.
Camera camera_of(bool orthographic)
{
    const double c = std::cos(1), s = std::sin(1);
    return {.frame = {.origin = {1, 2, 3}, .x = {c, 0, -s}, .y = {0, 1, 0}, .z = {s, 0, c}},
            .orthographic = orthographic,
            .half_extent = {0.5, 0.25}};
}

// What is linear across the image, middle + slope . (-1 to 1), as depth.
DepthMap plane(int width, int height, bool orthographic, double slope_x, double slope_y, double middle)
{
    return map_of(width, height, [=](int x, int y) {
        const double value = middle + slope_x * ((2 * x + 1.0) / width - 1) + slope_y * (1 - (2 * y + 1.0) / height);
        return static_cast<float>(orthographic ? value : 1 / value);
    });
}

std::size_t pieces(const TriangleMesh& mesh, const Camera& camera)
{
    // An orthographic camera looks from far behind its plane.
    return silhouette_of(topology_of(mesh), camera.frame.origin + camera.frame.z * (camera.orthographic ? 1e6 : 0)).sheets();
}

void expect_faces(const TriangleMesh& mesh, const Camera& camera)
{
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
        const Vec3 back = camera.orthographic ? camera.frame.z : camera.frame.origin - a;
        ASSERT_GT((b - a).cross(c - a).dot(back), 0);
    }
}

TEST(Joined, FourInARow)
{
    const double k = 1 + std::numbers::sqrt2;
    EXPECT_TRUE(joined(0, 1, 1, 0, single));                // level
    EXPECT_TRUE(joined(0.9, 1, 1.1, 0, single));            // the slope before explains it
    EXPECT_TRUE(joined(0, 1, 1.1, 1.2, single));            // or the one after
    EXPECT_TRUE(joined(1.2, 1.1, 1, 0, single));            // downwards too
    EXPECT_TRUE(joined(0.9, 1, 1 + 0.0999 * k, 0, single)); // up to k times as steep
    EXPECT_FALSE(joined(0.9, 1, 1 + 0.1001 * k, 0, single));
    EXPECT_TRUE(joined(0.9, 1, 1, 1, single));    // or less steep
    EXPECT_FALSE(joined(1.1, 1, 1.1, 0, single)); // not the other way
    EXPECT_FALSE(joined(0, 1, 1.1, 0, single));   // nobody to explain it
    EXPECT_FALSE(joined(1, 1, 2, 2, single));     // a step between two planes
    EXPECT_FALSE(joined(1, 0, 1, 1, single));     // nothing there
    EXPECT_FALSE(joined(1, 1, 0, 1, single));
    // A limb, the first texel's centre f inside it.
    for (const double f : {0.0, 0.001, 0.03, 0.5, 0.999}) {
        const auto limb = [f](int i) { return 0.7 + 0.1 * std::sqrt(i + f); };
        EXPECT_TRUE(joined(0, limb(0), limb(1), limb(2), single)) << f;
        EXPECT_TRUE(joined(limb(2), limb(1), limb(0), 0, single)) << f;
    }
    // The rounding of the two, 2^-11 of each.
    EXPECT_TRUE(joined(0, 1, 1 + 2 * 0x1p-11, 0, 0x1p-11));
    EXPECT_FALSE(joined(0, 1, 1 + 3 * 0x1p-11, 0, 0x1p-11));
}

TEST(MeshOfTexels, PlanesAreWholeAndPlaneAtEveryTilt)
{
    for (const bool orthographic : {false, true})
        for (const auto& [sx, sy] :
             {std::pair{0.0, 0.0}, {0.1, 0.0}, {0.0, -0.3}, {0.49, 0.49}, {-0.499, 0.499}, {1e-5, 1e-6}, {0.97, 0.0}})
            for (const double middle : {0.01, 1.0, 100.0}) {
                SCOPED_TRACE(testing::Message() << orthographic << ": " << sx << ", " << sy << " of " << middle);
                const int w = 33, h = 17;
                const Camera camera = camera_of(orthographic);
                const TriangleMesh mesh = mesh_of_texels(plane(w, h, orthographic, sx * middle, sy * middle, middle), camera);
                EXPECT_EQ(mesh.triangles.size(), 2u * w * h);
                ASSERT_EQ(mesh.positions.size(), (w + 1u) * (h + 1u)) << "torn";
                expect_faces(mesh, camera);
                const Topology topology = topology_of(mesh);
                EXPECT_EQ(topology.open_edges(), 2u * (w + h));
                EXPECT_EQ(topology.nonmanifold_edges(), 0u);

                // Every vertex where the plane meets the corner's ray. Off by three times the rounding of a texel's value (itself, and a
                // slope of two, halved, each way), and by float32 places as seen: 2^-24 of the coordinates, over depth.
                for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
                    const int x = static_cast<int>(i) % (w + 1), y = static_cast<int>(i) / (w + 1);
                    const double value = middle * (1 + sx * (2.0 * x / w - 1) + sy * (1 - 2.0 * y / h));
                    const Vec3 p(mesh.positions[i]);
                    const Projected at = project(camera, w, h, p);
                    const double place = p.length() * 2 * single, found = orthographic ? at.depth : 1 / at.depth;
                    const double steepest = middle * (1 + std::abs(sx) + std::abs(sy));
                    EXPECT_NEAR(found, value, 3 * single * steepest + (orthographic ? place : place * value * value) * 1.01);
                }
            }
}

TEST(MeshOfTexels, StepsAreCut)
{
    for (const bool orthographic : {false, true}) {
        const Camera camera = camera_of(orthographic);
        for (const double step : {1e-4, 0.1, 10.0}) {
            const DepthMap map = map_of(20, 10, [step](int x, int) { return static_cast<float>(x < 8 ? 2 : 2 + step); });
            const TriangleMesh mesh = mesh_of_texels(map, camera);
            EXPECT_EQ(mesh.positions.size(), 11u * (9u + 13u)) << step;
            EXPECT_EQ(pieces(mesh, camera), 2u) << step;
        }
        // Along a slope: k = 1 + sqrt(2) times the slope and more is cut.
        for (const double times : {1.0, 2.0, 2.4, 2.43, 3.0, -0.1, 10.0}) {
            const DepthMap map = map_of(20, 10, [=](int x, int) {
                const double value = 1 + 0.01 * x + (x < 8 ? 0 : 0.01 * (times - 1));
                return static_cast<float>(orthographic ? value : 1 / value);
            });
            EXPECT_EQ(pieces(mesh_of_texels(map, camera), camera), times < 0 || times > 1 + std::numbers::sqrt2 ? 2u : 1u) << times;
        }
    }
}

TEST(MeshOfTexels, ASquareBeforeATiltedPlane)
{
    const Camera camera = camera_of(false);
    DepthMap map = plane(32, 32, false, 0.02, 0.01, 0.1);
    for (int y = 8; y < 16; ++y)
        for (int x = 8; x < 16; ++x) map.at(x, y) = 3;
    const TriangleMesh mesh = mesh_of_texels(map, camera);
    EXPECT_EQ(mesh.positions.size(), 33u * 33u + 4 * 8u) << "corners on the square's border are there twice";
    const Silhouette silhouette = silhouette_of(topology_of(mesh), camera.frame.origin);
    EXPECT_EQ(silhouette.sheets(), 2u);
    EXPECT_EQ(silhouette.loops(), 3u);
    EXPECT_EQ(silhouette.edges.size(), 4 * 32u + 2 * 4 * 8u);
    expect_faces(mesh, camera);
}

// The nearest point of a sphere on each pixel's ray, before a wall.
DepthMap sphere_before_wall(int n, bool orthographic, double radius, double depth, double wall, double shift)
{
    return map_of(n, n, [=](int x, int y) {
        const double sx = (2 * x + 1.0) / n - 1 + shift, sy = 1 - (2 * y + 1.0) / n + shift / 3;
        // (o + t d - c)^2 = r^2 with d = (sx, sy, 1), or straight on from (sx, sy, 0).
        const Vec3 o = orthographic ? Vec3(sx, sy, -depth) : Vec3(0, 0, -depth), d = orthographic ? Vec3(0, 0, 1) : Vec3(sx, sy, 1);
        const double b = o.dot(d), root = b * b - d.length2() * (o.length2() - radius * radius);
        return static_cast<float>(root > 0 ? (-b - std::sqrt(root)) / d.length2() : wall);
    });
}

TEST(MeshOfTexels, ASphereSplitsFromTheWallBehindAndStaysWhole)
{
    for (const bool orthographic : {false, true})
        for (const int n : {31, 64, 200})
            for (const double shift : {0.0, 0.0013, 0.0071, 0.02}) {
                SCOPED_TRACE(testing::Message() << orthographic << ", " << n << ", " << shift);
                const Camera camera{.frame = {}, .orthographic = orthographic, .half_extent = {1, 1}};
                const double radius = orthographic ? 0.5 : 1.5;
                const TriangleMesh mesh = mesh_of_texels(sphere_before_wall(n, orthographic, radius, 5, 12, shift), camera);
                EXPECT_EQ(mesh.triangles.size(), 2u * static_cast<std::size_t>(n * n));
                const Topology topology = topology_of(mesh);
                const Silhouette s = silhouette_of(topology, camera.frame.origin + camera.frame.z * (orthographic ? 1e6 : 0));
                EXPECT_EQ(s.facing.size(), mesh.triangles.size());
                EXPECT_EQ(s.sheets(), 2u);
                EXPECT_EQ(s.loops(), 3u) << "the sphere's border, the wall's hole, the image's border";
            }
}

TEST(MeshOfTexels, ABandBeforeItselfIsCutThoughItHangsTogether)
{
    // A ramp that winds half around and comes back below its start, two texels away: joined around the end, cut along the middle.
    const DepthMap map = map_of(30, 9, [](int x, int y) {
        if (x >= 20) return static_cast<float>(1 / (1.2 - 0.02 * (y - 4)));
        return static_cast<float>(1 / (1.2 - 0.02 * (y - 4) + (y < 4 ? 0.02 * (20 - x) : -0.02 * (20 - x))));
    });
    const Camera camera = camera_of(false);
    const TriangleMesh mesh = mesh_of_texels(map, camera);
    EXPECT_EQ(pieces(mesh, camera), 1u);
    EXPECT_GT(mesh.positions.size(), 31u * 10u + 10u) << "the cut has two sides";
    expect_faces(mesh, camera);
}

TEST(MeshOfTexels, NoiseHolesAndSmallMaps)
{
    const Camera camera = camera_of(false);
    std::mt19937 random(1);
    std::lognormal_distribution<float> depth(0, 3);
    for (const auto& [w, h] : {std::pair{1, 1}, {1, 61}, {61, 1}, {7, 93}}) {
        std::size_t texels = 0;
        const DepthMap map = map_of(w, h, [&](int, int) {
            switch (random() % 8) {
            case 0:
                return nothing_there;
            case 1:
                return std::numeric_limits<float>::quiet_NaN();
            case 2:
                return -1.0f;
            case 3:
                return 0.0f;
            default:
                ++texels;
                return depth(random);
            }
        });
        const TriangleMesh mesh = mesh_of_texels(map, camera);
        EXPECT_EQ(mesh.triangles.size(), 2 * texels);
        expect_faces(mesh, camera);
        const Topology topology = topology_of(mesh);
        EXPECT_EQ(topology.left_out(), 0u);
        checked(topology, camera.frame.origin);
        checked(topology, {3, -2, 1});
    }
    EXPECT_TRUE(mesh_of_texels(flat(9, 9, nothing_there), camera).positions.empty());
    EXPECT_TRUE(mesh_of_texels({}, camera).triangles.empty());
    EXPECT_EQ(mesh_of_texels(flat(1, 1, 2), camera).positions.size(), 4u);
}

// Near the horizon a plane's disparity goes to 0 within a texel: its last corner would lie behind the camera.
TEST(MeshOfTexels, PlanesUpToTheHorizon)
{
    const Camera camera = camera_of(false);
    for (const double last : {1e-3, 0.1, 0.4, 0.6}) {
        const DepthMap map = map_of(12, 5, [last](int x, int) { return static_cast<float>(1 / (last + x)); });
        const TriangleMesh mesh = mesh_of_texels(map, camera);
        EXPECT_EQ(mesh.positions.size(), 13u * 6u);
        for (const Imath::V3f& p : mesh.positions) EXPECT_GT(project(camera, 12, 5, Vec3(p)).depth, 0);
        expect_faces(mesh, camera);
    }
}

} // namespace
} // namespace penumbra::test
