// The light clipped at a receiver's own plane, against shares that are counted.
#include <numbers>

#include "depth_image/images.hpp"

#include "depth_image/light.hpp"
#include "technique/receiver_points.hpp"

namespace penumbra::test {
namespace {

// A surface of receivers at random places with random normals, before a camera at the origin.
DepthSurface surface_of_random(int count, const Camera& camera)
{
    std::mt19937 random(17);
    std::uniform_real_distribution<double> unit(-1, 1);
    DepthSurface surface{.width = count, .height = 1, .camera = camera, .points = {}, .normals = {}, .depth = {}, .quality = {}};
    for (int i = 0; i < count; ++i) {
        Vec3 normal(unit(random), unit(random), unit(random));
        normal.normalize();
        surface.points.push_back(
            {static_cast<float>(unit(random)), static_cast<float>(unit(random)), static_cast<float>(3 + unit(random))});
        surface.normals.push_back({static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z)});
    }
    return surface;
}

std::vector<float> clipped(const Light& light, const DepthSurface& surface, const std::vector<float>& visibility, int channels)
{
    opencl::Work work(device_context(true));
    const auto on_device = work.upload(std::span<const float>(visibility), "visibility");
    const auto points = work.upload(std::span<const DepthVector>(surface.points), "points");
    const auto normals = work.upload(std::span<const DepthVector>(surface.normals), "normals");
    clip_at_horizon(work, receivers_program(), {light, surface.camera, surface.width, surface.height, points.memory(), {}, normals.memory()}, channels, on_device.memory());
    auto result = work.read(on_device);
    work.finish();
    return result;
}

constexpr int side = 400; // points of the light along each axis

// The share of points (x, y) of the square or the disc whose way from the receiver goes above its plane.
double counted_share(const Vec3& to_centre, const Vec3& half_u, const Vec3& half_v, const Vec3& normal, bool disc)
{
    int above = 0, all = 0;
    for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i) {
            const double x = (2 * i + 1.) / side - 1, y = (2 * j + 1.) / side - 1;
            if (disc && x * x + y * y > 1) continue;
            ++all;
            above += normal.dot(to_centre + half_u * x + half_v * y) > 0;
        }
    return static_cast<double>(above) / all;
}

// An edge runs through at most 2 side cells of side^2, each counted wholly: less than 2 / side wrong; a disc's border as much again, over
// pi / 4.
constexpr double square_margin = 2. / side, disc_margin = 2 * 2. / side * 4 / std::numbers::pi;

template <class Share> void expect_shares(const Light& light, const Camera& camera, double margin, const Share& share)
{
    const DepthSurface surface = surface_of_random(300, camera);
    const auto found = clipped(light, surface, std::vector<float>(300, 1.f), 1);
    int between = 0;
    for (std::size_t i = 0; i < 300; ++i) {
        const Vec3 point(surface.points[i].x, surface.points[i].y, surface.points[i].z),
            normal(surface.normals[i].x, surface.normals[i].y, surface.normals[i].z);
        EXPECT_NEAR(found[i], share(point, normal), margin) << i;
        between += found[i] > 0 && found[i] < 1;
    }
    EXPECT_GT(between, 20) << "horizons that cut the light";
}

Camera turned_camera()
{
    const double c = std::cos(.6), s = std::sin(.6);
    return {
        .frame = {.origin = {3, -1, 2}, .x = {c, 0, -s}, .y = {0, 1, 0}, .z = {s, 0, c}}, .orthographic = false, .half_extent = {.6, .4}};
}

// From the world to the camera's x right, y up, z along the view.
Vec3 seen(const Camera& camera, const Vec3& d) { return {d.dot(camera.frame.x), d.dot(camera.frame.y), -d.dot(camera.frame.z)}; }

TEST(DepthHorizon, OfARectangle)
{
    const Camera camera = turned_camera();
    const Vec3 centre(2, 2, -1), u(1.2, 0, .3), v(-.1, .8, .4);
    const RectangleLight light{.center = centre, .half_u = u, .half_v = v, .emission = {}};
    expect_shares(light, camera, square_margin, [&](const Vec3& point, const Vec3& normal) {
        return counted_share(seen(camera, centre - camera.frame.origin) - point, seen(camera, u), seen(camera, v), normal, false);
    });
}

// The disc of its radius that faces the receiver.
TEST(DepthHorizon, OfASphere)
{
    const Camera camera = turned_camera();
    const Vec3 centre(2, 2, -1);
    const SphereLight light{.center = centre, .radius = 1.1, .up = {}};
    expect_shares(light, camera, disc_margin, [&](const Vec3& point, const Vec3& normal) {
        const Vec3 to = seen(camera, centre - camera.frame.origin) - point;
        const Vec3 u = to.cross(std::abs(to.x) < std::abs(to.y) ? Vec3(1, 0, 0) : Vec3(0, 1, 0)).normalized(), v = to.cross(u).normalized();
        return counted_share(to, u * 1.1, v * 1.1, normal, true);
    });
}

// A disc of directions: its radius is the tangent of half the angle.
TEST(DepthHorizon, OfASun)
{
    const Camera camera = turned_camera();
    const Vec3 towards = Vec3(.3, 1, .4).normalized();
    const DirectionalLight light{.direction = -towards, .angular_diameter_deg = 50, .up = {}};
    const double radius = std::tan(25 * std::numbers::pi / 180);
    expect_shares(light, camera, disc_margin, [&](const Vec3&, const Vec3& normal) {
        const Vec3 to = seen(camera, towards), u = to.cross(Vec3(1, 0, 0)).normalized(), v = to.cross(u).normalized();
        return counted_share(to, u * radius, v * radius, normal, true);
    });
}

// A point is above or below.
TEST(DepthHorizon, OfAPoint)
{
    const Camera camera = turned_camera();
    const DepthSurface surface = surface_of_random(300, camera);
    const Vec3 centre(2, 2, -1);
    const auto found =
        clipped(PointLight{.center = centre, .direction = {0, -1, 0}, .up = Vec3(0, 0, 1)}, surface, std::vector<float>(300, .75f), 1);
    for (std::size_t i = 0; i < 300; ++i) {
        const Vec3 point(surface.points[i].x, surface.points[i].y, surface.points[i].z),
            normal(surface.normals[i].x, surface.normals[i].y, surface.normals[i].z);
        const double height = normal.dot(seen(camera, centre - camera.frame.origin) - point);
        // Some roundings of lengths below 10.
        if (std::abs(height) > 1e-5) {
            EXPECT_EQ(found[i], height > 0 ? .75f : 0.f) << i;
        }
    }
}

// The smaller of the two, in each channel; where nobody is, what was.
TEST(DepthHorizon, NeverRaisesAndLeavesNobodyAlone)
{
    const Camera camera = turned_camera();
    DepthSurface surface = surface_of_random(100, camera);
    for (std::size_t i = 0; i < 100; i += 3) surface.points[i].z = 0;
    const RectangleLight light{.center = {2, 2, -1}, .half_u = {1.2, 0, 0}, .half_v = {0, .8, 0}, .emission = {}};
    std::vector<float> visibility;
    for (int i = 0; i < 300; ++i) visibility.push_back(static_cast<float>(i % 7) / 6);
    const auto share = clipped(light, surface, std::vector<float>(100, 1.f), 1), found = clipped(light, surface, visibility, 3);
    for (std::size_t i = 0; i < 300; ++i) EXPECT_EQ(found[i], i / 3 % 3 == 0 ? visibility[i] : std::min(visibility[i], share[i / 3])) << i;
}

} // namespace
} // namespace penumbra::test
