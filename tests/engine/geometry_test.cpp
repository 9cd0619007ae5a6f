// Objects whose hierarchies are kept: the same masks as from a scene, for many lights.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>

#include "engine/geometry.hpp"

using namespace penumbra;

namespace {

TriangleMesh square(double half, double y)
{
    const auto at = [&](double x, double z) { return Imath::V3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)); };
    TriangleMesh mesh;
    mesh.positions = {at(-half, half), at(half, half), at(half, -half), at(-half, -half)};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

Scene scene_at(double x)
{
    Scene scene;
    scene.light = RectangleLight{.center = {x, 6, 0}, .half_u = {0.5, 0, 0}, .half_v = {0, 0, -0.5}, .emission = {}};
    scene.objects = {{.name = "square", .mesh = square(0.5, 2), .casts = true, .receives = false},
                     {.name = "floor", .mesh = square(4, 0), .casts = false, .receives = true}};
    scene.occluders.width = scene.occluders.height = 64;
    scene.receivers.camera =
        PinholeCamera{.frame = {.origin = {0, 8, 0}, .x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}}, .tan_half_fov = {0.4, 0.4}};
    scene.receivers.width = scene.receivers.height = 48;
    return scene;
}

const Engine& engine()
{
    static const Engine one;
    return one;
}

Mask mask_of(const Scene& scene, const Geometry& geometry, const Technique& technique)
{
    const Prepared prepared = engine().prepare(scene.light, scene.occluders, geometry, technique);
    return engine().shade(prepared, with_depth(scene.receivers, scene.light, geometry));
}

} // namespace

TEST(Geometry, GivesTheMaskOfTheSceneBitForBit)
{
    const Scene scene = scene_at(0);
    const Geometry geometry(scene.objects, {0, 6, 0});
    for (const Technique& technique : {Technique(SoftShadowMap{}), Technique(ShadowMap{}), Technique(RayTraced{.samples = 16})})
        EXPECT_EQ(mask_of(scene, geometry, technique).visibility.pixels, engine().mask(scene, technique).visibility.pixels)
            << kind_of(technique);
}

TEST(Geometry, ServesALightThatMovedAwayFromWhereItsHierarchiesAre)
{
    // Depths rendered from a hierarchy that lies 3 units aside differ by float32 rounding of coordinates below 16 (2^-24 * 16, through two
    // operations), which moves an edge on the light (1 unit wide, lever 2 of 4 units) by as much: far below 2^-12.
    const Scene moved = scene_at(3);
    const Geometry geometry(scene_at(0).objects, {0, 6, 0});
    const Image kept = mask_of(moved, geometry, SoftShadowMap{}).visibility, fresh = engine().mask(moved, SoftShadowMap{}).visibility;
    double worst = 0;
    for (std::size_t i = 0; i < kept.pixels.size(); ++i)
        worst = std::max(worst, std::abs(static_cast<double>(kept.pixels[i]) - fresh.pixels[i]));
    EXPECT_LT(worst, 0x1p-12);
    EXPECT_LT(*std::min_element(kept.pixels.begin(), kept.pixels.end()), 0.1F) << "there is a shadow";
}

TEST(Geometry, BuildsOneHierarchyWhereAllObjectsDoBoth)
{
    Scene scene = scene_at(0);
    for (Object& object : scene.objects) object.casts = object.receives = true;
    const Geometry both(scene.objects);
    EXPECT_EQ(both.state().casters(), both.state().receivers());
    const Geometry apart(scene_at(0).objects);
    EXPECT_NE(apart.state().casters(), apart.state().receivers());
    EXPECT_EQ(apart.state().casters(), apart.state().casters()) << "built once";
}

TEST(Geometry, CountsItsBytes)
{
    const Geometry geometry(scene_at(0).objects);
    const std::uint64_t triangles = 2 * (4 * 12 + 2 * 12);
    EXPECT_EQ(geometry.bytes(), triangles);
    geometry.state().casters();
    EXPECT_GT(geometry.bytes(), triangles);
}

TEST(Geometry, SaysWhatIsMissing)
{
    const Scene scene = scene_at(0);
    const Geometry nothing(std::vector<Object>{});
    EXPECT_THROW(engine().prepare(scene.light, scene.occluders, nothing, RayTraced{}), Error);
    EXPECT_THROW(with_depth(scene.receivers, scene.light, nothing), Error);
}
