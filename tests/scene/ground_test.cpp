// Which objects cast on nothing, and what lies behind them.
#include <random>

#include "support/maps.hpp"

#include "scene/camera.hpp"
#include "scene/ground.hpp"

namespace penumbra::test {
namespace {

Object quad(const Vec3& center, const Vec3& u, const Vec3& v)
{
    Object object{.name = "quad", .mesh = {}};
    for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
        object.mesh.positions.emplace_back(center + u * static_cast<double>(a) + v * static_cast<double>(b));
    object.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return object;
}

const Object floor_quad = quad({0, 0, 0}, {5, 0, 0}, {0, 0, -5});
const Object wall = quad({0, 2, -5}, {5, 0, 0}, {0, 2, 0});
const Object table = quad({0, 1, 0}, {1, 0, 0}, {0, 0, -1});

// The objects all of whose triangles lie in ground.
std::vector<std::size_t> ground(const Light& light, const std::vector<Object>& objects)
{
    const std::vector<Ground> grounds = grounds_of(light_frame(light), objects);
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < objects.size(); ++i)
        if (in_ground(grounds, objects[i].mesh)) found.push_back(i);
    return found;
}

RectangleLight lamp(const Vec3& center, double half) { return {.center = center, .half_u = {half, 0, 0}, .half_v = {0, 0, -half}, .emission = {}}; }

using Places = std::vector<std::size_t>;

TEST(Ground, IsWhatHasEverythingOnTheLightsSide)
{
    EXPECT_EQ(ground(lamp({0, 4, 2}, .5), {floor_quad, table}), Places{0});
    EXPECT_EQ(ground(lamp({0, -4, 2}, .5), {floor_quad, table}), Places{1}) << "seen from below the table has all on its other side, and the floor casts on it";
    Object below = table;
    for (auto& p : below.mesh.positions) p.y = -1;
    EXPECT_EQ(ground(lamp({0, 4, 2}, .5), {floor_quad, table, below}), Places{2}) << "the floor casts on what lies below";
    below.casts = false;
    EXPECT_EQ(ground(lamp({0, 4, 2}, .5), {floor_quad, below}), Places{1}) << "what only receives lies there too";
    EXPECT_EQ(ground(DirectionalLight{.direction = {0.2, -1, 0}, .angular_diameter_deg = 1, .up = {}}, {floor_quad, table}), Places{0});
}

// Part of a light that reaches through the floor's plane is hidden by the floor.
TEST(Ground, TheWholeLightIsBeforeIt)
{
    const auto standing = [](double height) {
        return RectangleLight{.center = {0, height, 2}, .half_u = {1, 0, 0}, .half_v = {0, 1, 0}, .emission = {}};
    };
    EXPECT_EQ(ground(standing(1.5), {floor_quad, wall}), (Places{0, 1}));
    EXPECT_EQ(ground(standing(.9), {floor_quad, wall}), Places{1});
    const DirectionalLight low{.direction = {1, -.05, 0}, .angular_diameter_deg = 10, .up = {}};
    EXPECT_EQ(ground(low, {floor_quad, table}), Places{}) << "half of this sun is below the horizon";
}

// A floor of many triangles and what stands on it, in one mesh.
TEST(Ground, IsFoundWithinAMesh)
{
    Object both{.name = "both", .mesh = table.mesh};
    constexpr int side = 20;
    for (int z = 0; z <= side; ++z)
        for (int x = 0; x <= side; ++x) both.mesh.positions.emplace_back(Vec3(x - side / 2., 0, z - side / 2.));
    for (std::uint32_t z = 0; z < side; ++z)
        for (std::uint32_t x = 0; x < side; ++x) {
            const std::uint32_t a = 4 + z * (side + 1) + x;
            both.mesh.triangles.push_back({a, a + 1, a + side + 1});
            both.mesh.triangles.push_back({a + 1, a + side + 1, a + side + 2}); // the other way round
        }
    const std::vector<Ground> grounds = grounds_of(light_frame(lamp({0, 4, 2}, .5)), {both});
    ASSERT_EQ(grounds.size(), 1u);
    EXPECT_FALSE(in_ground(grounds, both.mesh));
    int inside = 0;
    for (const auto& triangle : both.mesh.triangles) inside += in_ground(grounds, both.mesh, triangle);
    EXPECT_EQ(inside, 2 * side * side);

    const Camera camera = resolve_camera(LightCamera{}, lamp({0, 4, 0}, .5), {both}, 64, 64, "occluders.camera", {.receivers = true, .grounds = grounds});
    EXPECT_NEAR(camera.half_extent.x, 1. / 3 * (1 + 2. / 64), 1e-6) << "the table alone";
}

TEST(Ground, BodiesAreNone)
{
    Object bent = floor_quad;
    bent.mesh.positions[0].y = .1f;
    EXPECT_EQ(ground(lamp({0, 4, 2}, .5), {bent, table}), Places{});
    EXPECT_EQ(ground(lamp({0, 4, 2}, .5), {}), Places{});
}

// A camera above looks down on a floor at y = 0, with noise or with a pit.
TEST(Ground, ADepthImageShowsWhatLiesBehind)
{
    const Camera camera{.frame = {.origin = {0, 4, 0}, .x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}}, .orthographic = false, .half_extent = {1, 1}};
    const LightFrame light = light_frame(lamp({0, 4, 2}, .5));
    const std::vector<Ground> grounds = grounds_of(light, {floor_quad});
    ASSERT_EQ(grounds.size(), 1u);
    constexpr int pixels = 100;
    const auto shows = [&](const DepthMap& map) { return shows_behind(grounds, light, map, camera); };
    EXPECT_FALSE(shows(flat(pixels, pixels, 4)));
    EXPECT_FALSE(shows(flat(pixels, pixels, 3)));
    EXPECT_TRUE(shows(flat(pixels, pixels, 5)));
    DepthMap map = flat(pixels, pixels, 4);
    std::mt19937 random(7);
    std::normal_distribution<float> noise(0, .01f);
    for (float& z : map.depth) z *= 1 + noise(random);
    map.from_image = true;
    EXPECT_TRUE(shows(map)) << "what may be noise may lie behind as well";
    map.noise = .01;
    EXPECT_FALSE(shows(map)) << "noise of one per cent that the image says it has is the floor itself";
    // A floor just below a plate: it receives.
    EXPECT_TRUE(shows(flat(pixels, pixels, 4.01f)));
    map = flat(pixels, pixels, 4);
    map.depth[50 * pixels + 50] = 4.5f;
    EXPECT_TRUE(shows(map)) << "one pixel in a pit";
    map.depth[50 * pixels + 50] = nothing_there;
    map.depth[0] = std::numeric_limits<float>::quiet_NaN();
    map.depth[1] = 0;
    map.depth[2] = -3;
    EXPECT_FALSE(shows(map));
    EXPECT_FALSE(shows_behind({}, light, flat(pixels, pixels, 5), camera));

    // Far below, and far beside the floor's end: the light comes there past the floor.
    std::vector<Ground> small = grounds;
    small.front().box = Imath::Box3d(Vec3(-2, 0, -2), Vec3(2, 0, 2));
    map = flat(pixels, pixels, nothing_there);
    map.depth[2] = 30;
    EXPECT_FALSE(shows_behind(small, light, map, camera));
    map.depth[50 * pixels + 50] = 30;
    EXPECT_TRUE(shows_behind(small, light, map, camera));

    // The place on the image counts: a tilted camera, against points one by one.
    const double a = .5;
    const Camera tilted{.frame = {.origin = {0, 4, 3}, .x = {1, 0, 0}, .y = {0, std::cos(a), -std::sin(a)}, .z = {0, std::sin(a), std::cos(a)}}, .orthographic = false, .half_extent = {.5, .3}};
    for (const double depth : {3., 5., 7., 9.}) {
        bool behind = false;
        for (int y = 0; y < pixels; ++y)
            for (int x = 0; x < pixels; ++x) behind |= -world_point(tilted, pixels, pixels, x + .5, y + .5, depth).y > 1e-4 * depth;
        EXPECT_EQ(shows_behind(grounds, light, flat(pixels, pixels, static_cast<float>(depth)), tilted), behind) << depth;
    }
}

} // namespace
} // namespace penumbra::test
