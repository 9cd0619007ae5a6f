// A still camera and a caster that moves by .02 units a frame: texels that go on and off as a whole would flicker.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include <penumbra/engine.hpp>

#include "io/mesh_io.hpp"
#include "support/bodies.hpp"

namespace penumbra::test {
namespace {

// The largest change of a pixel from one frame to the next.
double largest_jump(const std::vector<Image>& frames)
{
    double most = 0;
    for (std::size_t i = 1; i < frames.size(); ++i)
        for (std::size_t k = 0; k < frames[i].pixels.size(); ++k)
            most = std::max(most, std::abs(static_cast<double>(frames[i].pixels[k]) - static_cast<double>(frames[i - 1].pixels[k])));
    return most;
}

// The rays' own changes hold their noise, which is least where most are cast. Twice theirs would be seen.
TEST(MovingCaster, ChangesNoPixelMuchMoreThanRaysDo)
{
    const Engine engine;
    const TriangleMesh bunny = read_mesh(PENUMBRA_BUNNY, "bunny");
    for (const double half : {0.15, 0.5})
        for (const int texels : {128, 512}) {
            std::vector<Image> maps, rays;
            for (int frame = 0; frame < 8; ++frame) {
                Scene scene;
                scene.light = RectangleLight{.center = {0, 8, 0}, .half_u = {half, 0, 0}, .half_v = {0, 0, -half}, .emission = {}};
                Object caster = body(bunny);
                for (auto& p : caster.mesh.positions) p += Imath::V3f(0.02F * static_cast<float>(frame), 2.5F, 0.01F * static_cast<float>(frame));
                caster.receives = false;
                Object floor = body({{-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}}, {{0, 1, 2}, {0, 2, 3}});
                floor.casts = false;
                scene.objects = {caster, floor};
                scene.occluders.width = scene.occluders.height = texels;
                scene.occluders.camera = LightCamera{.tan_half_fov = Vec2(0.4, 0.4), .half_extent = {}, .center = {}};
                scene.receivers.camera = PinholeCamera{.frame = {.origin = {0, 6, 0}, .x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}}, .tan_half_fov = {0.4, 0.4}, .shift = {}};
                scene.receivers.width = scene.receivers.height = 96;
                maps.push_back(engine.mask(scene, SoftShadowMap{}).visibility);
                rays.push_back(engine.mask(scene, RayTraced{.samples = 1024}).visibility);
            }
            const double by_rays = largest_jump(rays);
            EXPECT_GT(by_rays, 0.01) << "hardly a change";
            EXPECT_LT(largest_jump(maps), 2 * by_rays) << "half a light of " << half << ", " << texels << " texels";
        }
}

} // namespace
} // namespace penumbra::test
