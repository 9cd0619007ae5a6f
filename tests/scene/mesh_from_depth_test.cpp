// Surfaces made from a camera's depth: what is joined, what is cut, which way triangles face.
#include "support/maps.hpp"

#include "scene/camera.hpp"
#include "scene/depth.hpp"

namespace penumbra::test {
namespace {

const Camera camera{.frame = {}, .orthographic = false, .half_extent = {1, 1}};

std::size_t whole(int width, int height) { return 2u * static_cast<std::size_t>(width - 1) * static_cast<std::size_t>(height - 1); }

// A plane n . p = 1 through the camera's view: disparity is linear across the image, n . (tx, ty, -1).
DepthMap plane(int width, int height, double slope_x, double slope_y, double middle)
{
    return map_of(width, height, [&](int x, int y) {
        const double disparity = middle + slope_x * ((2 * x + 1.0) / width - 1) + slope_y * (1 - (2 * y + 1.0) / height);
        return static_cast<float>(1 / disparity);
    });
}

float rounded_to_half(float value)
{
    int exponent = 0;
    const float mantissa = std::frexp(value, &exponent); // [1/2, 1), of which a half keeps 11 bits
    return std::ldexp(std::nearbyint(std::ldexp(mantissa, 11)), exponent - 11);
}

TEST(Connected, FourInARow)
{
    const double p = 0x1p-24;
    EXPECT_TRUE(connected(0, 1, 1, 0, p));       // level
    EXPECT_TRUE(connected(0.9, 1, 1.1, 0, p));   // the slope before explains it
    EXPECT_TRUE(connected(0, 1, 1.1, 1.2, p));   // or the one after
    EXPECT_TRUE(connected(0.95, 1, 1.1, 0, p));  // up to twice as steep
    EXPECT_FALSE(connected(0.96, 1, 1.1, 0, p)); // not more
    EXPECT_FALSE(connected(1.1, 1, 1.1, 0, p));  // nor the other way
    EXPECT_FALSE(connected(0, 1, 1.1, 0, p));    // nobody to explain it
    EXPECT_FALSE(connected(1, 1, 2, 2, p));      // a step between two planes
    EXPECT_FALSE(connected(1, 0, 1, 1, p));      // nothing there
    EXPECT_FALSE(connected(1, 1, 0, 1, p));
    EXPECT_TRUE(connected(0, 1, 1 + 5 * 0x1p-11, 0, 0x1p-11)); // within the rounding of half-floats
    EXPECT_FALSE(connected(0, 1, 1 + 7 * 0x1p-11, 0, 0x1p-11));
}

TEST(MeshFromDepth, PlanesAreWholeAtEveryTilt)
{
    for (const auto& [sx, sy] : {std::pair{0.0, 0.0}, {0.1, 0.0}, {0.0, -0.3}, {0.49, 0.49}, {-0.499, 0.499}, {1e-5, 1e-6}})
        for (const double middle : {1e-4, 1.0, 1e4}) {
            const DepthMap map = plane(33, 17, sx * middle, sy * middle, middle);
            const TriangleMesh mesh = mesh_from_depth(map, camera);
            EXPECT_EQ(mesh.triangles.size(), whole(33, 17)) << sx << ", " << sy << ", " << middle;
            EXPECT_EQ(mesh.positions.size(), 33u * 17u);
        }
}

TEST(MeshFromDepth, VerticesArePixelCentresInTheWorld)
{
    const double c = std::cos(1), s = std::sin(1);
    const Camera turned{
        .frame = {.origin = {1, 2, 3}, .x = {c, 0, -s}, .y = {0, 1, 0}, .z = {s, 0, c}}, .orthographic = false, .half_extent = {0.5, 0.25}};
    const DepthMap map = plane(4, 3, 0.1, 0.05, 0.5);
    const TriangleMesh mesh = mesh_from_depth(map, turned);
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 4; ++x) {
            const Vec3 p(mesh.positions[static_cast<std::size_t>(y * 4 + x)]);
            const Projected back = project(turned, 4, 3, p);
            // Positions are float32: half a unit in the last place of coordinates below 8, over a pixel's width of at least 0.25.
            EXPECT_NEAR(back.x_px, x + 0.5, 16 * 8 * 0x1p-24);
            EXPECT_NEAR(back.y_px, y + 0.5, 16 * 8 * 0x1p-24);
            EXPECT_NEAR(back.depth, map.at(x, y), 4 * 8 * 0x1p-24);
        }
    for (const auto& t : mesh.triangles) {
        const Vec3 a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), d(mesh.positions[t[2]]);
        EXPECT_GT((b - a).cross(d - a).dot(turned.frame.origin - a), 0) << "faces away from the camera";
    }
}

// Two planes: joined within, cut between.
TEST(MeshFromDepth, StepsAreCut)
{
    for (const float far : {2.001f, 2.1f, 5.0f, 1e6f}) {
        const DepthMap map = map_of(20, 10, [far](int x, int) { return x < 8 ? 2.0f : far; });
        EXPECT_EQ(mesh_from_depth(map, camera).triangles.size(), whole(8, 10) + whole(12, 10)) << far;
    }
    // A square before a tilted plane.
    DepthMap map = plane(32, 32, 0.02, 0.01, 0.1);
    for (int y = 8; y < 16; ++y)
        for (int x = 8; x < 16; ++x) map.at(x, y) = 3;
    // The plane lacks 8 x 8 vertices: 9 x 9 cells, of whose border cells those at the four corners keep a triangle at most.
    const std::size_t rest = whole(32, 32) - 2 * 9 * 9;
    const std::size_t found = mesh_from_depth(map, camera).triangles.size();
    EXPECT_GE(found, rest + whole(8, 8));
    EXPECT_LE(found, rest + whole(8, 8) + 4);
}

TEST(MeshFromDepth, HalfFloatPlanesStayWhole)
{
    for (const auto& [sx, sy] : {std::pair{0.0, 0.0}, {0.1, 0.05}, {0.002, 0.001}, {0.4, -0.4}}) {
        DepthMap map = plane(65, 65, sx, sy, 1);
        for (float& depth : map.depth) depth = rounded_to_half(depth);
        map.precision = 0x1p-11;
        EXPECT_EQ(mesh_from_depth(map, camera).triangles.size(), whole(65, 65)) << sx << ", " << sy;
    }
}

// Bars of one texel before a plane belong neither to it nor to each other.
TEST(MeshFromDepth, SingleTexelBarsAreCut)
{
    const DepthMap map = map_of(21, 10, [](int x, int) { return x % 4 == 0 ? 2.0f : 4.0f; });
    // Between bars the plane is three texels wide, five times; a bar is one texel wide, no cell.
    EXPECT_EQ(mesh_from_depth(map, camera).triangles.size(), 5 * whole(3, 10));
}

TEST(MeshFromDepth, HolesAndSmallMaps)
{
    EXPECT_TRUE(mesh_from_depth(flat(1, 1, 2), camera).triangles.empty());
    EXPECT_TRUE(mesh_from_depth(flat(1, 61, 2), camera).triangles.empty());
    EXPECT_TRUE(mesh_from_depth(flat(9, 9, nothing_there), camera).positions.empty());
    DepthMap map = flat(3, 3, 2);
    map.at(0, 0) = std::numeric_limits<float>::quiet_NaN();
    map.at(2, 2) = -1;
    const TriangleMesh mesh = mesh_from_depth(map, camera);
    EXPECT_EQ(mesh.positions.size(), 7u);
    EXPECT_EQ(mesh.triangles.size(), 6u); // two cells whole, two with one corner missing
}

} // namespace
} // namespace penumbra::test
