// Bodies that cast on themselves, as soft_shadow_map's union has them. A body that bulges everywhere casts none of its shadow on itself: what darkens it is its own
// horizons, which have closed forms.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <penumbra/engine.hpp>

#include "engine/state.hpp"
#include "io/mesh_io.hpp"
#include "support/bodies.hpp"

namespace penumbra::test {
namespace {

constexpr int side = 128;

// Two rows of ridges: each hides the other's foot from low light.
Object ridges(int count)
{
    std::vector<Vec3> corners;
    std::vector<std::array<std::uint32_t, 3>> facets;
    for (int i = 0; i <= 2 * count; ++i)
        for (const double z : {1.2, -1.2}) corners.emplace_back(1.2 * (i - count) / count, i % 2 ? 0.25 : 0, z);
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(2 * count); ++i) facets.insert(facets.end(), {{2 * i, 2 * i + 2, 2 * i + 3}, {2 * i, 2 * i + 3, 2 * i + 1}});
    return body(corners, std::move(facets));
}

Scene scene_of(const Light& light, Object object, int texels)
{
    Scene scene;
    scene.light = light;
    scene.objects = {std::move(object)};
    scene.occluders.width = scene.occluders.height = texels;
    const Vec3 z = Vec3(0.1, 3.2, 3.4).normalized(), x = Vec3(0, 1, 0).cross(z).normalized();
    scene.receivers.camera = PinholeCamera{.frame = {.origin = z * 4.6, .x = x, .y = z.cross(x), .z = z}, .tan_half_fov = {0.32, 0.32}, .shift = {}};
    scene.receivers.width = scene.receivers.height = side;
    return scene;
}

SphereLight sphere(double degrees)
{
    const Vec3 towards = Vec3(0.4, 0.9, 0.3).normalized();
    return {.center = towards * 12, .radius = 12 * std::tan(degrees / 2 * std::numbers::pi / 180), .direction = -towards, .up = {}};
}
RectangleLight rectangle() { return {.center = {2, 5, 2}, .half_u = {1, 0, 0}, .half_v = {0, 0, -1}, .emission = {}}; }

const Engine& engine()
{
    static const Engine made;
    return made;
}

struct Difference {
    double mean = 0, bias = 0, most = 0; // over shadow pixels, largest over all
    int alone = 0;                       // lit ones that are dark
};
Difference difference(const Scene& scene, const Technique& technique)
{
    const Image seen = engine().mask(scene, technique).visibility, rays = engine().mask(scene, RayTraced{.samples = 1024}).visibility;
    Difference all;
    int shadow = 0;
    for (std::size_t i = 0; i < seen.pixels.size(); ++i) {
        const double step = static_cast<double>(seen.pixels[i]) - static_cast<double>(rays.pixels[i]);
        all.most = std::max(all.most, std::abs(step));
        all.alone += rays.pixels[i] == 1.f && seen.pixels[i] < 0.9f;
        if (rays.pixels[i] >= 0.999f && seen.pixels[i] >= 0.999f) continue;
        all.mean += std::abs(step);
        all.bias += step;
        ++shadow;
    }
    EXPECT_GT(shadow, 100) << "hardly a shadow";
    all.mean /= std::max(shadow, 1);
    all.bias /= std::max(shadow, 1);
    return all;
}

SoftShadowMap exact() { return {.tolerance = 0}; }

// 1024 rays are off by .005 where half the light is hidden; a sphere's samples by as much again.
TEST(ShadowsOfOneself, ABallIsDarkenedByItsHorizonsAlone)
{
    for (const int texels : {128, 256, 512})
        for (const Light& light : {Light(sphere(20)), Light(sphere(2)), Light(rectangle())}) {
            const Difference off = difference(scene_of(light, body(penumbra::sphere({0, 0, 0}, 1, 4)), texels), exact());
            EXPECT_LT(off.mean, 0.006) << texels;
            EXPECT_LT(std::abs(off.bias), 0.003) << texels;
            EXPECT_EQ(off.alone, 0) << texels;
        }
}
// Its front sees half of what shines from above.
TEST(ShadowsOfOneself, ABoxesFaces)
{
    for (const double z : {0.4, 0.7, 1.}) {
        const RectangleLight above{.center = {0.1, 4, z}, .half_u = {1, 0, 0}, .half_v = {0, 0, -1}, .emission = {}};
        const Difference off = difference(scene_of(above, body(box({-0.7, -0.7, -0.7}, {0.7, 0.7, 0.7})), 256), exact());
        EXPECT_LT(off.mean, 0.006);
        EXPECT_EQ(off.alone, 0);
    }
}

// Neither the sizes of texels and of the samples that they come from, nor what lies between decides whether a surface darkens itself.
TEST(ShadowsOfOneself, OfMapsThatAreReduced)
{
    for (const int resolution : {100, 150, 173, 255}) {
        const Difference off = difference(scene_of(rectangle(), body(penumbra::sphere({0, 0, 0}, 1, 4)), 256), SoftShadowMap{.resolution = resolution, .tolerance = 0});
        EXPECT_LT(off.mean, 0.006) << resolution;
        EXPECT_LE(off.alone, 2) << resolution;
    }
}

// What hides a foot's light lies partly above its horizon, and partly not: both count, each once.
TEST(ShadowsOfOneself, RidgesHideEachOthersFeet)
{
    const RectangleLight low{.center = {5, 1.6, 0}, .half_u = {0, 1, 0}, .half_v = {0, 0, 1}, .emission = {}};
    for (const int texels : {256, 512}) {
        const Difference off = difference(scene_of(low, ridges(4), texels), exact());
        EXPECT_LT(off.mean, 0.01) << texels;
        EXPECT_LT(std::abs(off.bias), 0.005) << texels;
        EXPECT_EQ(off.alone, 0) << texels;
    }
}

// Each of its 70,000 faces is as large as five texels: what is finer than a texel stays unknown, most of it where light grazes a face. (Where the lesser of what casts and
// what the horizon cuts was taken: .032, .022 too bright.)
TEST(ShadowsOfOneself, OfABunny)
{
    const Difference off = difference(scene_of(sphere(20), body(read_mesh(PENUMBRA_BUNNY, "bunny")), 512), exact());
    EXPECT_LT(off.mean, 0.02);
    EXPECT_LT(std::abs(off.bias), 0.011);
    EXPECT_EQ(off.alone, 0);
}

// Whatever receivers lie in one tile, and in one vector, with it.
TEST(ShadowsOfOneself, DoNotDependOnTheReceiversBeside)
{
    for (const Light& light : {Light(sphere(20)), Light(rectangle())}) {
        Scene scene = scene_of(light, body(read_mesh(PENUMBRA_BUNNY, "bunny")), 256);
        scene.receivers = with_depth(scene.receivers, light, Geometry(scene.objects));
        const Prepared prepared = engine().prepare(scene, exact());
        const Image whole = engine().shade(prepared, scene.receivers).visibility;
        // A fifth of the image at a time, from its end on.
        for (std::uint32_t first = 0; first < 5; ++first) {
            std::vector<std::uint32_t> pixels;
            for (std::uint32_t pixel = side * side - 1 - first; pixel < side * side; pixel -= 5) pixels.push_back(pixel);
            const std::vector<float> some = shade_pixels(prepared, scene.receivers, pixels);
            for (std::size_t i = 0; i < pixels.size(); ++i) ASSERT_EQ(some[i], whole.pixels[pixels[i]]) << pixels[i];
        }
    }
}

} // namespace
} // namespace penumbra::test
