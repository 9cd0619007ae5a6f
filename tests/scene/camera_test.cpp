// Cameras: pixels to points and back, fitting to objects, what is refused.
#include "support/maps.hpp"

#include "scene/camera.hpp"

namespace penumbra::test {
namespace {

Frame turned_frame()
{
    // Two rotations, so that no axis stays in place.
    const double a = 0.7, b = -0.4;
    const Vec3 x(std::cos(a), std::sin(a) * std::sin(b), -std::sin(a) * std::cos(b)), y(0, std::cos(b), std::sin(b));
    return {.origin = {3, -2, 5}, .x = x, .y = y, .z = x.cross(y)};
}

Object quad(const Vec3& center, const Vec3& u, const Vec3& v, const std::string& name = "quad")
{
    Object object{.name = name, .mesh = {}};
    for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
        object.mesh.positions.emplace_back(center + u * static_cast<double>(a) + v * static_cast<double>(b));
    object.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return object;
}

TEST(Camera, PixelsToPointsAndBack)
{
    for (const bool orthographic : {false, true}) {
        const Camera camera{.frame = turned_frame(), .orthographic = orthographic, .half_extent = {0.8, 0.3}};
        for (const double depth : {1e-3, 1.0, 1e6})
            for (const auto& [x, y] : {std::pair{0.5, 0.5}, {92.5, 6.5}, {46.5, 3.5}, {-10.0, 200.0}}) {
                const Projected p = project(camera, 93, 7, world_point(camera, 93, 7, x, y, depth));
                // Doubles: the points' coordinates are some 1e2 times the depth or 1e1 at most, and a pixel is at least 1e-2 of the depth.
                const double bound = 64 * 0x1p-53 * (1e2 * depth + 1e1) / (1e-2 * std::min(depth, 1.0));
                EXPECT_NEAR(p.x_px, x, bound);
                EXPECT_NEAR(p.y_px, y, bound);
                EXPECT_NEAR(p.depth, depth, bound);
            }
    }
}

TEST(Camera, RowZeroIsTheTopAndDepthIsPlanar)
{
    const Camera camera{.frame = {}, .orthographic = false, .half_extent = {1, 0.5}};
    const Vec3 corner = world_point(camera, 2, 2, 0, 0, 4);
    EXPECT_EQ(corner, Vec3(-4, 2, -4));
    EXPECT_EQ(camera_point(camera, 2, 2, 2, 2, 4), Vec3(4, -2, 4));
    EXPECT_LT(project(camera, 2, 2, Vec3(0, 0, 1)).depth, 0) << "behind the camera";
}

TEST(Camera, OfTheLightLooksAlongItsDirection)
{
    const LightFrame light = light_frame(rectangle_light(2, 1));
    const Camera camera = light_camera(light, {0.5, 0.25}, light.origin);
    EXPECT_EQ(camera.frame.x, light.u);
    EXPECT_EQ(camera.frame.y, light.v);
    EXPECT_EQ(camera.frame.z, -light.direction);
    EXPECT_FALSE(camera.orthographic);
    EXPECT_NO_THROW(validate(camera, "camera"));
}

// A fitted view holds every corner, no more than a texel inside the border.
TEST(Camera, FitsTheObjects)
{
    const Object object = quad({1, 0, -10}, {2, 0, 0}, {0, 1, 0.5});
    const int width = 64, height = 32;
    const Camera camera = resolve_camera(LightCamera{}, rectangle_light(1, 1), {object}, width, height, "occluders.camera");
    double reach_x = 0, reach_y = 0;
    for (const auto& p : object.mesh.positions) {
        const Projected at = project(camera, width, height, Vec3(p));
        EXPECT_TRUE(at.x_px > 0 && at.x_px < width && at.y_px > 0 && at.y_px < height);
        reach_x = std::max(reach_x, std::abs(at.x_px - width / 2.0));
        reach_y = std::max(reach_y, std::abs(at.y_px - height / 2.0));
    }
    EXPECT_GT(reach_x, width / 2.0 - 1.5);
    EXPECT_GT(reach_y, height / 2.0 - 1.5);

    // What neither casts nor receives does not count; what lies behind the light does not either.
    Object idle = quad({100, 0, -10}, {1, 0, 0}, {0, 1, 0});
    idle.casts = idle.receives = false;
    const Object behind = quad({100, 0, 10}, {1, 0, 0}, {0, 1, 0});
    const Camera same = resolve_camera(LightCamera{}, rectangle_light(1, 1), {idle, object, behind}, width, height, "occluders.camera");
    EXPECT_EQ(same.half_extent, camera.half_extent);
}

TEST(Camera, FitsTheSun)
{
    const DirectionalLight sun{.direction = {0, -1, 0}, .angular_diameter_deg = 0.53, .up = {}};
    const Object floor = quad({5, 0, 5}, {4, 0, 0}, {0, 0, -3}), roof = quad({5, 7, 5}, {1, 0, 0}, {0, 0, -1});
    const Camera camera = resolve_camera(LightCamera{}, sun, {floor, roof}, 64, 64, "occluders.camera");
    EXPECT_TRUE(camera.orthographic);
    for (const Object& object : {floor, roof})
        for (const auto& p : object.mesh.positions) {
            const Projected at = project(camera, 64, 64, Vec3(p));
            EXPECT_TRUE(at.depth > 0 && at.x_px > 0 && at.x_px < 64 && at.y_px > 0 && at.y_px < 64) << at.depth;
        }
}

TEST(Camera, TakesWhatIsGiven)
{
    const Camera light = resolve_camera(light_view(0.5, 0.25), rectangle_light(1, 1), {}, 64, 32, "camera");
    EXPECT_EQ(light.half_extent, Vec2(0.5, 0.25));
    const Camera pinhole =
        resolve_camera(PinholeCamera{.frame = turned_frame(), .tan_half_fov = {0, 0.5}}, rectangle_light(1, 1), {}, 64, 32, "camera");
    EXPECT_EQ(pinhole.half_extent, Vec2(1, 0.5)); // from the image's aspect
}

TEST(Camera, NothingToFitTo)
{
    const auto error = [](const Light& light, const std::vector<Object>& objects) {
        return error_of([&] { resolve_camera(LightCamera{}, light, objects, 64, 64, "occluders.camera"); });
    };
    for (const auto& objects : {std::vector<Object>{}, {quad({0, 0, 5}, {1, 0, 0}, {0, 1, 0})}}) {
        const Error e = error(rectangle_light(1, 1), objects);
        EXPECT_EQ(e.code(), ErrorCode::invalid_input);
        EXPECT_TRUE(e.path() == "occluders.camera.tan_half_fov") << e.what();
    }
    EXPECT_TRUE(error(DirectionalLight{}, {}).path() == "occluders.camera.half_extent");
}

// A triangle through the light's plane spans any field of view: up to tangents of 8, and a texel's margin of 64 texels.
TEST(Camera, WhatReachesThroughTheLightsPlaneIsSeenUpToAWideAngle)
{
    const Object wall = quad({.5, 0, 0}, {0, 0, 1}, {0, 1, 0}, "wall");
    const Camera alone = resolve_camera(LightCamera{}, rectangle_light(1, 1), {wall}, 64, 64, "occluders.camera");
    EXPECT_EQ(alone.half_extent, Vec2(8 * (1 + 2. / 64), 8 * (1 + 2. / 64)));

    // Ground, with all else on the light's side of it, casts on nothing: the view is fitted to the rest.
    const Object body = quad({0, 0, -5}, {1, 0, 0}, {0, 1, 0}, "body"), ground = quad({0, -2, -5}, {20, 0, 0}, {0, 0, 20}, "ground");
    const Camera rest = resolve_camera(LightCamera{}, rectangle_light(1, 1), {body, ground}, 64, 64, "occluders.camera");
    EXPECT_EQ(rest.half_extent, Vec2(.2 * (1 + 2. / 64), .2 * (1 + 2. / 64)));
}

// A depth image that shows a plate, a lower half that is near and a wall far behind. Where that runs into the light's plane, its tangents would have
// no end; the view stays within what casts: tan(1.4) and the penumbra's width.
TEST(Camera, ADepthImagesViewHoldsWhatCasts)
{
    constexpr int size = 200;
    SeenSurface seen{.depth = {.width = size, .height = size, .depth = {}, .from_image = true},
                     .camera = {.frame = {}, .orthographic = false, .half_extent = {1, 1}}};
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const bool plate = std::abs(x - size / 2) < size / 8 && std::abs(y - size / 2) < size / 8;
            seen.depth.depth.push_back(plate ? 4.f : y > size / 2 ? 8.f : 400.f);
        }
    seen.camera.frame.origin = {.5, 0, 0}; // beside the light, so that some of what the plate shades is seen
    RectangleLight light = rectangle_light(.1, .1);
    const Object object{.name = "depth", .mesh = {}, .seen = seen};
    const Camera narrow = resolve_camera(LightCamera{}, light, {object}, 64, 64, "occluders.camera");
    EXPECT_LE(narrow.half_extent.x, 1.3) << "nothing here runs into the light's plane: all of it is held";

    // Turned by 80 degrees, the light has a part of the wall behind its plane, and another at tangents without end.
    const double a = 80 * 3.14159265358979 / 180;
    light.center = {3, 0, -6};
    light.half_u = {.1 * std::cos(a), 0, .1 * std::sin(a)};
    const Camera turned = resolve_camera(LightCamera{}, light, {object}, 64, 64, "occluders.camera");
    EXPECT_LE(std::max(turned.half_extent.x, turned.half_extent.y), 6) << "tan(1.4) and a penumbra's width at the most";
}

TEST(Camera, BadFramesAndViewsAreRefused)
{
    const auto refused = [](const Frame& frame, const Vec2& half) {
        const Error error = error_of([&] { validate({.frame = frame, .orthographic = false, .half_extent = half}, "receivers.camera"); });
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_TRUE(error.path().starts_with("receivers.camera")) << error.what();
    };
    const Frame good;
    Frame scaled = good, skewed = good, mirrored = good, lost = good, nan = good;
    scaled.x *= 1.01;
    skewed.y = Vec3(0.1, 1, 0).normalized();
    mirrored.x = -mirrored.x;
    lost.origin.y = HUGE_VAL;
    nan.z.z = std::nan("");
    for (const Frame& frame : {scaled, skewed, mirrored, lost, nan}) refused(frame, {1, 1});
    for (const double half : {0.0, -1.0, HUGE_VAL, std::nan("")}) {
        refused(good, {half, 1});
        refused(good, {1, half});
    }
    EXPECT_NO_THROW(validate({.frame = turned_frame(), .orthographic = false, .half_extent = {1, 1}}, "camera"));
}

} // namespace
} // namespace penumbra::test
