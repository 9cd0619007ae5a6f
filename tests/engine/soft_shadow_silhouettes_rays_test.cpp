// Silhouettes from each receiver beside traced rays: closed meshes, open ones, many in each other, and surfaces that shadow themselves.
#include <gtest/gtest.h>

#include "engine/soft_shadow_volume_scenes.hpp"
#include "io/mesh_io.hpp"

namespace penumbra::test::wedges {
namespace {

const SoftShadowVolume per_receiver{.silhouettes = Silhouettes::per_receiver};

// The samples' own error: an edge is resolved to 7/1024 at the worst; the rays' noise comes on top.
void expect_rays(const std::string& name, const Scene& scene, double mean = 0.003)
{
    const Image rays = mask_of(scene, RayTraced{.samples = 4096});
    const Metrics m = compare(mask_of(scene, per_receiver), rays), centre = compare(mask_of(scene), rays);
    record(name, m);
    record(name + ", silhouettes of the light's centre", centre);
    EXPECT_LT(m.mae_shadow, mean) << name;
    EXPECT_LT(std::abs(m.bias_shadow), 0.001) << name;
    EXPECT_LT(m.max, 0.05) << name;
    EXPECT_GT(m.pixels_shadow, 200u) << name;
}

TriangleMesh turned(TriangleMesh mesh, double angle, const Vec3& to)
{
    const double c = std::cos(angle), s = std::sin(angle);
    for (Imath::V3f& p : mesh.positions) p = Imath::V3f(Vec3(c * p.x + s * p.z, p.y, -s * p.x + c * p.z) + to);
    return mesh;
}

TEST(SilhouettesOfReceivers, Sheets)
{
    for (const double side : {0.3, 1.0, 4.0}) {
        const Light light = rectangle_light(side, side);
        const std::string name = ", half a light of " + std::to_string(side);
        expect_rays("stacked" + name, scene_of(light, {sheet(-1, 1, -1, 1, 3), sheet(-1, 1, -1, 1, 5)}, floor_at(8)));
        expect_rays("tilted" + name, scene_of(light, {sheet({Vec3(-2, -1.5, 3), Vec3(2, -1.5, 6), Vec3(2, 1.5, 6.5), Vec3(-2, 1.5, 3.5)})}, floor_at(8)));
        std::vector<TriangleMesh> fence;
        for (int i = -8; i <= 8; ++i) fence.push_back(sheet(0.25 * i, 0.25 * i + 0.1, -2, 2, 5));
        expect_rays("fence" + name, scene_of(light, fence, floor_at(8)));
    }
}

TEST(SilhouettesOfReceivers, ClosedMeshes)
{
    const Light light = rectangle_light(0.5, 0.5);
    expect_rays("torus knot", scene_of(light, {torus_knot({0, 0, 4})}, floor_at(8)));
    expect_rays("two boxes in each other, on the floor", scene_of(light, {closed_box({-1, -1, 6}, {1, 1, 8}), closed_box({0, -2, 5}, {0.5, 2, 7})}, floor_at(8)));
    std::vector<TriangleMesh> balls;
    for (int i = 0; i < 27; ++i) balls.push_back(ball(Vec3(i % 3 - 1, i / 3 % 3 - 1, 4 + i / 9), 0.4, 12, 20));
    expect_rays("27 balls", scene_of(light, balls, floor_at(8)));
}

// Many parts without an inside, that hang together nowhere and stand in each other.
TEST(SilhouettesOfReceivers, OpenParts)
{
    std::vector<TriangleMesh> parts;
    for (int i = 0; i < 40; ++i) {
        TriangleMesh shell = ball({0, 0, 0}, 0.5, 10, 16);
        shell.triangles.resize(shell.triangles.size() * (4 + static_cast<std::size_t>(i) % 5) / 10);
        parts.push_back(turned(shell, 0.7 * i, world_of(1.2 * std::cos(2.4 * i), 1.2 * std::sin(2.4 * i), 3 + 0.05 * i)));
    }
    expect_rays("open parts", scene_of(rectangle_light(0.5, 0.5), parts, floor_at(8)));
}

// On the caster itself: what rays see, to the facets. A convex one hides of the light what lies below its own plane.
TEST(SilhouettesOfReceivers, OnTheCaster)
{
    Scene scene = scene_of(rectangle_light(1, 1), {ball({0, 0, 6}, 2, 40, 64), closed_box({-3, -3, 9}, {3, 3, 9.5})}, {});
    for (Object& object : scene.objects) object.receives = true;
    const PinholeCamera beside{.frame = {.origin = {20, 0, -6}, .x = {0, 0, -1}, .y = {0, 1, 0}, .z = {1, 0, 0}}, .tan_half_fov = {0.22, 0.22}};
    scene.receivers = {.camera = beside, .width = 128, .height = 128, .depth = {}};
    const Image rays = mask_of(scene, RayTraced{.samples = 1024});
    const Metrics m = compare(mask_of(scene, per_receiver), rays), centre = compare(mask_of(scene), rays);
    record("a ball above a box, on themselves", m);
    record("the same, silhouettes of the light's centre", centre);
    EXPECT_LT(m.mae_shadow, 0.002);
    EXPECT_LT(m.mae_shadow, centre.mae_shadow);
    EXPECT_LT(m.max, 0.05);
}

TEST(SilhouettesOfReceivers, Bunny)
{
    TriangleMesh bunny = read_mesh(PENUMBRA_BUNNY, "bunny");
    Imath::Box3f box;
    for (const Imath::V3f& p : bunny.positions) box.extendBy(p);
    for (Imath::V3f& p : bunny.positions) {
        p = (p - box.center()) * (2 / box.size().y);
        p = Imath::V3f(p.x, p.z, -p.y - 4);
    }
    for (const double side : {0.1, 0.5, 2.0}) expect_rays("bunny, half a light of " + std::to_string(side), scene_of(rectangle_light(side, side), {bunny}, floor_at(8, 96, 0.6)));
}

} // namespace
} // namespace penumbra::test::wedges
