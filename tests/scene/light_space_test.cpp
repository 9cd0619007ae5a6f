// Lights as frames: axes as docs/scene_file.md says, defaults, what is refused.
#include <numbers>

#include "support/maps.hpp"

#include "scene/light_space.hpp"

namespace penumbra::test {
namespace {

void expect_near(const Vec3& a, const Vec3& b) { EXPECT_LT((a - b).length(), 1e-15) << a << " is not " << b; }

// Orthonormal, x along u, y along v, shining along cross(v, u).
void expect_frame(const LightFrame& frame)
{
    for (const Vec3& axis : {frame.u, frame.v, frame.direction}) EXPECT_NEAR(axis.length(), 1, 4 * 0x1p-53);
    expect_near(frame.v.cross(frame.u), frame.direction);
}

// The example of docs/scene_file.md: half_u = +X, half_v = -Z shines down.
TEST(LightFrame, RectangleShinesAlongVCrossU)
{
    const LightFrame frame =
        light_frame(RectangleLight{.center = {0, 6, 0}, .half_u = {0.5, 0, 0}, .half_v = {0, 0, -0.25}, .emission = {}});
    expect_near(frame.direction, {0, -1, 0});
    expect_near(frame.u, {1, 0, 0});
    expect_near(frame.v, {0, 0, -1});
    EXPECT_EQ(frame.half_u, 0.5);
    EXPECT_EQ(frame.half_v, 0.25);
    EXPECT_EQ(frame.origin, Vec3(0, 6, 0));
    EXPECT_EQ(frame.shape, LightShape::rectangle);
    EXPECT_FALSE(frame.directional);
    expect_frame(frame);
    expect_frame(light_frame(RectangleLight{.center = {0, 0, 0}, .half_u = {1, 1, 0}, .half_v = {-1, 1, 0.0}, .emission = {}}));
}

// A light without area still has a frame.
TEST(LightFrame, RectanglesWithoutExtent)
{
    const auto frame = [](const Vec3& u, const Vec3& v) {
        return light_frame(RectangleLight{.center = {0, 0, 0}, .half_u = u, .half_v = v, .emission = {}});
    };
    for (const Vec3& edge : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, -2), Vec3(1, 2, 3)}) {
        const LightFrame along_u = frame(edge, {0, 0, 0}), along_v = frame({0, 0, 0}, edge);
        expect_frame(along_u);
        expect_frame(along_v);
        expect_near(along_u.u, edge.normalized());
        expect_near(along_v.v, edge.normalized());
        EXPECT_EQ(along_u.half_v, 0);
        EXPECT_EQ(along_v.half_u, 0);
    }
    expect_near(frame({0, 0, 0}, {0, 0, 0}).direction, {0, -1, 0});
}

// u = normalize(cross(direction, up)), v = cross(u, direction); up is +Y, and -Z within 8 degrees of the Y axis.
TEST(LightFrame, DefaultUp)
{
    const auto expect_up = [](const Vec3& direction, const Vec3& up) {
        for (const Light& light : {Light(PointLight{.center = {0, 0, 0}, .direction = direction, .up = {}}),
                                   Light(SphereLight{.center = {0, 0, 0}, .radius = 1, .direction = direction, .up = {}}),
                                   Light(DirectionalLight{.direction = direction, .angular_diameter_deg = 1, .up = {}})}) {
            const LightFrame frame = light_frame(light);
            expect_frame(frame);
            expect_near(frame.direction, direction.normalized());
            expect_near(frame.u, direction.normalized().cross(up).normalized());
            expect_near(frame.v, frame.u.cross(frame.direction));
        }
    };
    const auto tilted = [](double deg) {
        const double a = deg * std::numbers::pi / 180;
        return Vec3(std::sin(a), -std::cos(a), 0);
    };
    expect_up({0, -1, 0}, {0, 0, -1});
    expect_up({0, 3, 0}, {0, 0, -1});
    expect_up(tilted(7.9), {0, 0, -1});
    expect_up(tilted(8.1), {0, 1, 0});
    expect_up({0, 0, -1}, {0, 1, 0});
    expect_up({1, 2, 3}, {0, 1, 0});

    // Defaults shine down; with that example, a point light and a rectangle then agree.
    const LightFrame point = light_frame(PointLight{});
    expect_near(point.u, {1, 0, 0});
    expect_near(point.v, {0, 0, -1});
}

TEST(LightFrame, GivenUpNeedsNoLengthOfOne)
{
    const LightFrame frame = light_frame(PointLight{.center = {0, 0, 0}, .direction = {0, 0, -5}, .up = Vec3(0, 9, 1)});
    expect_near(frame.u, {1, 0, 0});
    expect_near(frame.v, {0, 1, 0});
}

TEST(LightFrame, Extents)
{
    const LightFrame sphere = light_frame(SphereLight{.center = {1, 2, 3}, .radius = 4, .direction = {0, -1, 0}, .up = {}});
    EXPECT_EQ(sphere.shape, LightShape::disc);
    EXPECT_EQ(sphere.half_u, 4);
    EXPECT_EQ(sphere.half_v, 4);
    const LightFrame sun = light_frame(DirectionalLight{.direction = {0, -1, 0}, .angular_diameter_deg = 90, .up = {}});
    EXPECT_TRUE(sun.directional);
    EXPECT_NEAR(sun.half_u, 1, 4 * 0x1p-53);
    EXPECT_EQ(light_frame(PointLight{}).half_u, 0);
}

TEST(LightFrame, PointsInLightSpace)
{
    const LightFrame frame = light_frame(RectangleLight{.center = {0, 6, 0}, .half_u = {1, 0, 0}, .half_v = {0, 0, -1}, .emission = {}});
    expect_near(light_from_world(frame, {2, 1, -3}), {2, 3, 5});
    EXPECT_LT(light_from_world(frame, {0, 7, 0}).z, 0) << "behind the light";
}

TEST(ValidateLight, SaysWhichKeyIsWrong)
{
    const double nan = std::nan(""), inf = HUGE_VAL;
    const auto refused = [](const Light& light, const std::string& key) {
        const Error error = error_of([&] { validate(light); });
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_TRUE(error.path() == "light." + std::string(key)) << error.what();
        EXPECT_FALSE(error.hint().empty());
    };
    refused(RectangleLight{.center = {nan, 0, 0}, .half_u = {1, 0, 0}, .half_v = {0, 1, 0}, .emission = {}}, "center");
    refused(RectangleLight{.center = {0, 0, 0}, .half_u = {inf, 0, 0}, .half_v = {0, 1, 0}, .emission = {}}, "half_u");
    refused(RectangleLight{.center = {0, 0, 0}, .half_u = {1, 0, 0}, .half_v = {0.1, 1, 0}, .emission = {}}, "half_v");
    refused(SphereLight{.center = {0, 0, 0}, .radius = -1, .direction = {0, -1, 0}, .up = {}}, "radius");
    refused(SphereLight{.center = {0, 0, 0}, .radius = nan, .direction = {0, -1, 0}, .up = {}}, "radius");
    refused(SphereLight{.center = {0, 0, 0}, .radius = 1, .direction = {0, 0, 0}, .up = {}}, "direction");
    refused(PointLight{.center = {0, inf, 0}, .direction = {0, -1, 0}, .up = {}}, "center");
    refused(PointLight{.center = {0, 0, 0}, .direction = {0, -1, 0}, .up = Vec3(0, 2, 0)}, "up");
    refused(PointLight{.center = {0, 0, 0}, .direction = {0, -1, 0}, .up = Vec3(0, 0, 0)}, "up");
    for (const double angle : {-1.0, 180.0, nan, inf})
        refused(DirectionalLight{.direction = {0, -1, 0}, .angular_diameter_deg = angle, .up = {}}, "angular_diameter_deg");

    RectangleLight textured = rectangle_light(1, 1);
    textured.emission = Image{.width = 1, .height = 1, .channels = 1, .pixels = {0}};
    refused(textured, "emission");
    textured.emission->pixels[0] = -1;
    refused(textured, "emission");
    textured.emission = Image{.width = 1, .height = 1, .channels = 4, .pixels = {1, 1, 1, 1}};
    refused(textured, "emission");
    textured.emission = Image{.width = 1, .height = 1, .channels = 1, .pixels = {1}};
    EXPECT_NO_THROW(validate(Light(textured)));
    textured.half_u = {0, 0, 0};
    refused(textured, "emission");
}

TEST(ValidateLight, TakesTheExtremes)
{
    EXPECT_NO_THROW(validate(Light(rectangle_light(0, 0))));
    EXPECT_NO_THROW(validate(Light(rectangle_light(1e-30, 1e30))));
    // Orthogonal to 1e-5 is what text and float32 allow.
    EXPECT_NO_THROW(validate(Light(RectangleLight{.center = {0, 0, 0}, .half_u = {1, 0, 0}, .half_v = {9e-6, 1, 0}, .emission = {}})));
    EXPECT_NO_THROW(validate(Light(SphereLight{.center = {0, 0, 0}, .radius = 0, .direction = {0, -1, 0}, .up = {}})));
    EXPECT_NO_THROW(validate(Light(DirectionalLight{.direction = {0, -1e-300, 0}, .angular_diameter_deg = 179.9, .up = {}})));
}

} // namespace
} // namespace penumbra::test
