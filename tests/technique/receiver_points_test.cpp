// Receivers as light-space points, from the light's own view and from any other camera.
#include "support/device_run.hpp"
#include "support/maps.hpp"

#include "common/shared.h"

namespace penumbra::test {
namespace {

const Camera light_camera_at_origin{.frame = {}, .orthographic = false, .half_extent = {1, 0.5}};

std::vector<oracle::Receiver> points_of(const Camera& camera, const DepthMap& depth, const Camera& light_view)
{
    opencl::Work work(device_context(true));
    const auto uploaded = work.upload(std::span<const float>(depth.depth), "depth");
    const ReceiverPoints points =
        receiver_points(work, receiver_view(camera, depth.width, depth.height, light_view), uploaded.memory(), depth.precision);
    auto result = read_points(work, points);

    // The padding holds nobody.
    const auto d = work.read(points.d);
    for (int y = 0; y < points.view.rows; ++y)
        for (int x = 0; x < points.view.stride; ++x)
            if (x >= depth.width || y >= depth.height) {
                EXPECT_EQ(d[static_cast<std::size_t>(y * points.view.stride + x)], NO_RECEIVER);
            }
    work.finish();
    return result;
}

// The light's own view: pixel centres and one over depth.
TEST(ReceiverPoints, OfTheLightsView)
{
    for (const auto& [width, height] : {std::pair{1, 1}, std::pair{7, 93}, std::pair{61, 2}}) {
        const DepthMap depth = random_map(width, height, 1e-3, 1e3, 0.2, 3);
        const auto points = points_of(light_camera_at_origin, depth, light_camera_at_origin);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const oracle::Receiver p = points[static_cast<std::size_t>(y * width + x)];
                const float z = depth.at(x, y);
                if (!std::isfinite(z)) {
                    EXPECT_EQ(p.d, NO_RECEIVER);
                    continue;
                }
                // The pixel's tangents (2 roundings), times depth, times disparity (itself rounded), over the light's tangents (2).
                EXPECT_NEAR(p.xi, (2 * x + 1.0) / width - 1, 7 * 0x1p-24);
                EXPECT_NEAR(p.eta, 1 - (2 * y + 1.0) / height, 7 * 0x1p-24);
                EXPECT_EQ(p.d, 1 / z);
            }
    }
}

TEST(ReceiverPoints, NothingThereIsNobody)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const DepthMap depth{.width = 7, .height = 1, .depth = {nan, -nan, 0, -0.0f, -1, nothing_there, -nothing_there}};
    for (const auto& p : points_of(light_camera_at_origin, depth, light_camera_at_origin)) EXPECT_EQ(p.d, NO_RECEIVER);
}

// One over the smallest depths is beyond binary32.
TEST(ReceiverPoints, TheSmallestDepthsAreNobody)
{
    const DepthMap depth{.width = 2, .height = 1, .depth = {std::numeric_limits<float>::denorm_min(), 0x1p-126f}};
    const auto points = points_of(light_camera_at_origin, depth, light_camera_at_origin);
    EXPECT_EQ(points[0].d, NO_RECEIVER);
    EXPECT_EQ(points[1].d, 0x1p126);
}

// Another camera, against world_point and light space in double precision.
TEST(ReceiverPoints, OfAnotherCamera)
{
    const double c = std::cos(0.7), s = std::sin(0.7);
    for (const bool orthographic : {false, true}) {
        const Camera camera{.frame = {.origin = {3, 1, -2}, .x = {c, 0, -s}, .y = {0, 1, 0}, .z = {s, 0, c}},
                            .orthographic = orthographic,
                            .half_extent = {0.9, 0.4}};
        const DepthMap depth = random_map(31, 17, 1, 6, 0.1, 4);
        const auto points = points_of(camera, depth, light_camera_at_origin);
        for (int y = 0; y < depth.height; ++y)
            for (int x = 0; x < depth.width; ++x) {
                const oracle::Receiver p = points[static_cast<std::size_t>(y * depth.width + x)];
                if (!std::isfinite(depth.at(x, y))) {
                    EXPECT_EQ(p.d, NO_RECEIVER);
                    continue;
                }
                const Vec3 w = world_point(camera, depth.width, depth.height, x + 0.5, y + 0.5, depth.at(x, y));
                const double z = -w.z;
                // Coordinates of up to 16 in light space are sums of four products: 8 roundings of at most that.
                const double place = 8 * 16 * 0x1p-24;
                if (z < -place) {
                    EXPECT_EQ(p.d, NO_RECEIVER) << "behind the light";
                } else if (z > 0.25) {
                    EXPECT_NEAR(p.d, 1 / z, place / (z * z));
                    EXPECT_NEAR(p.xi, w.x / z, (place + std::abs(w.x / z) * place) / z);
                    EXPECT_NEAR(p.eta, w.y / (0.5 * z), 2 * (place + std::abs(w.y / z) * place) / z);
                }
            }
    }
}

// Far from the world's origin nothing is lost: only the difference of the cameras' places counts.
TEST(ReceiverPoints, FarFromTheWorldsOrigin)
{
    Camera light = light_camera_at_origin, camera = light_camera_at_origin;
    camera.frame.origin = {0.5, 0.25, 1};
    const DepthMap depth = random_map(16, 8, 2, 3, 0, 6);
    const auto here = points_of(camera, depth, light);
    const Vec3 away(1 << 20, -(1 << 21), 1 << 19);
    light.frame.origin += away;
    camera.frame.origin += away;
    const auto there = points_of(camera, depth, light);
    for (std::size_t i = 0; i < here.size(); ++i) {
        EXPECT_EQ(here[i].xi, there[i].xi);
        EXPECT_EQ(here[i].eta, there[i].eta);
        EXPECT_EQ(here[i].d, there[i].d);
    }
}

} // namespace
} // namespace penumbra::test
