// Report::error_estimate against the error that it is of.
#include <cmath>

#include <gtest/gtest.h>

#include <penumbra/engine.hpp>
#include <penumbra/mask_job.hpp>
#include <penumbra/metrics.hpp>

#include "io/mesh_io.hpp"
#include "support/bodies.hpp"

namespace penumbra::test {
namespace {

Object sheet(const Vec3& center, const Vec3& half_u, const Vec3& half_v, bool casts)
{
    Object object = body({center - half_u - half_v, center + half_u - half_v, center + half_u + half_v, center - half_u + half_v}, {{0, 1, 2}, {0, 2, 3}});
    object.casts = casts;
    object.receives = !casts;
    return object;
}

Scene over_floor(std::vector<Object> casters, const Light& light, int texels)
{
    Scene scene;
    scene.light = light;
    for (Object& caster : casters) {
        caster.receives = false;
        scene.objects.push_back(std::move(caster));
    }
    scene.objects.push_back(sheet({0, 0, 0}, {4, 0, 0}, {0, 0, -4}, false));
    scene.occluders.width = scene.occluders.height = texels;
    scene.receivers.camera = PinholeCamera{.frame = {.origin = {0, 6, 0}, .x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}}, .tan_half_fov = {0.4, 0.4}, .shift = {}};
    scene.receivers.width = scene.receivers.height = 120;
    return scene;
}

RectangleLight rectangle(double half) { return {.center = {0.2, 6, 0.1}, .half_u = {half, 0, 0}, .half_v = {0, 0, -half}, .emission = {}}; }

std::vector<Object> balls()
{
    std::vector<Object> all;
    for (int i = 0; i < 9; ++i)
        all.push_back(body(penumbra::sphere({(i % 3) * 0.7 - 0.7, 1.5 + 0.3 * (i % 2), i / 4.5 - 0.9}, 0.25, 3)));
    return all;
}

std::vector<Object> bars()
{
    std::vector<Object> all;
    for (int i = 0; i < 8; ++i) all.push_back(sheet({-1.1 + 0.3 * i, 2, 0}, {0.05, 0, 0}, {0, 0.2, -1}, true));
    return all;
}

std::vector<Object> bunny()
{
    Object above = body(read_mesh(PENUMBRA_BUNNY, "bunny"));
    for (auto& p : above.mesh.positions) p.y += 2;
    return {above};
}

struct Case {
    const char* name;
    Scene scene;
};
std::vector<Case> cases()
{
    std::vector<Case> all;
    for (const int texels : {64, 256})
        for (const double half : {0.1, 0.6}) {
            all.push_back({"balls", over_floor(balls(), rectangle(half), texels)});
            all.push_back({"bars", over_floor(bars(), rectangle(half), texels)});
            all.push_back({"bunny", over_floor(bunny(), rectangle(half), texels)});
            all.push_back({"sheet", over_floor({sheet({0, 1.4, 0}, {0.8, 0.3, 0}, {0, 0.2, -0.7}, true)}, rectangle(half), texels)});
        }
    return all;
}

const Engine& engine()
{
    static const Engine made;
    return made;
}

Mask with_estimate(const Scene& scene, const Technique& technique)
{
    MaskJob job = job_of(scene, technique);
    job.error_estimate = true;
    Mask mask;
    engine().masks(job, {}, [&](NamedMask&& named) { mask = std::move(named.mask); });
    return mask;
}

Image rays_of(const Scene& scene) { return engine().mask(scene, RayTraced{.samples = 8192, .seed = 77}).visibility; }

void expect_estimated(const Mask& mask, const Image& rays, const std::string& what)
{
    const Metrics found = compare(mask.visibility, rays);
    ASSERT_TRUE(mask.report.error_estimate) << what;
    const ErrorEstimate& estimate = *mask.report.error_estimate;
    EXPECT_GT(estimate.mean, 0.5 * found.mae_shadow) << what;
    // Errors below those of the rays that measure them cannot be told from none.
    EXPECT_LT(estimate.mean, std::max(3 * found.mae_shadow, 0.001)) << what;
    EXPECT_GT(estimate.p99, 0.5 * found.p99_shadow) << what;
    EXPECT_LT(estimate.p99, std::max(3 * found.p99_shadow, 0.006)) << what;
}

TEST(ErrorEstimate, OfAnyTechniqueByRays)
{
    for (const Case& one : cases()) {
        if (one.scene.occluders.width < 256) continue;
        const Image rays = rays_of(one.scene);
        for (const Technique& technique : std::vector<Technique>{SoftShadowMap{}, SoftShadowMap{.tolerance = 0.2}, SoftShadowVolume{}, OcclusionTexture{}})
            expect_estimated(with_estimate(one.scene, technique), rays, std::string(one.name) + " by " + kind_of(technique));
    }
}

// The maps of a scene without what they were rendered from.
Scene maps_alone(const Scene& scene)
{
    Scene maps = with_depth(scene, SoftShadowMap{});
    for (DepthMap* map : {&*maps.occluders.front, &*maps.occluders.back}) map->fine = nullptr;
    for (DepthMap& layer : maps.occluders.layers) layer.fine = nullptr;
    maps.objects.clear();
    return maps;
}

TEST(ErrorEstimate, OfUnionsOfGivenMapsByCoarserOnes)
{
    for (const Case& one : cases()) {
        const Mask mask = with_estimate(maps_alone(one.scene), SoftShadowMap{});
        ASSERT_TRUE(mask.report.error_estimate);
        EXPECT_EQ(mask.report.error_estimate->by, "maps of a third");
        expect_estimated(mask, rays_of(one.scene), std::string(one.name) + " at " + std::to_string(one.scene.occluders.width));
    }
}

TEST(ErrorEstimate, IsTheSameAgainAndNothingWhereNothingIsKnown)
{
    const Case one = cases().front();
    EXPECT_EQ(with_estimate(one.scene, SoftShadowMap{}).report.error_estimate->mean, with_estimate(one.scene, SoftShadowMap{}).report.error_estimate->mean);
    EXPECT_FALSE(with_estimate(maps_alone(one.scene), ShadowMap{}).report.error_estimate);
    EXPECT_FALSE(engine().mask(one.scene, SoftShadowMap{}).report.error_estimate);
}

} // namespace
} // namespace penumbra::test
