#include "process/ready.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <penumbra/describe.hpp>
#include <penumbra/error.hpp>

namespace penumbra::server {
namespace {

constexpr int side = 16;
constexpr double half_light = 0.5;

// A light of one unit square at the origin shines along -Z. A plane at depth 1 covers x < 0; receivers are a plane at depth 2, seen from
// the light through half its view, so that every segment to the light crosses the occluder map inside its borders.
Scene known_scene()
{
    Scene scene;
    scene.light = RectangleLight{.center = {0, 0, 0}, .half_u = {half_light, 0, 0}, .half_v = {0, half_light, 0}, .emission = {}};
    DepthMap plane{.width = side, .height = side, .depth = {}}, floor{.width = side, .height = side, .depth = {}};
    for (int i = 0; i < side * side; ++i) {
        plane.depth.push_back(i % side < side / 2 ? 1 : nothing_there);
        floor.depth.push_back(2);
    }
    scene.occluders = {.camera = LightCamera{.tan_half_fov = Vec2(1, 1), .half_extent = {}, .center = {}},
                       .width = side,
                       .height = side,
                       .front = plane,
                       .back = plane,
                       .layers = {}};
    scene.receivers = {.camera = LightCamera{.tan_half_fov = Vec2(0.5, 0.5), .half_extent = {}, .center = {}},
                       .width = side,
                       .height = side,
                       .depth = floor};
    // The same plane as an object, for techniques that trace rays.
    TriangleMesh mesh;
    mesh.positions = {{-1, -1, -1}, {0, -1, -1}, {0, 1, -1}, {-1, 1, -1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.objects.push_back({.name = "plane", .mesh = mesh, .casts = true, .receives = false});
    return scene;
}

} // namespace

void check_known_mask(const Engine& engine)
{
    const Mask mask = engine.mask(known_scene(), SoftShadowMap{.visibility = PatchVisibility::sum, .sides = Sides::front});
    // The light's point u is hidden from x when the segment's middle, (u + x) / 2, has x < 0: the visible share is 1/2 + x / (2
    // half_light). The sum has at most side * side terms of a share of at most 1, each right to a few units of float32's last place (8 are
    // allowed for): 256 * 8 * 2^-24.
    const double tolerance = side * side * 8 * 0x1p-24;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const double at = (x + 0.5) / (side / 2) - 1;
            const double expected = std::clamp(0.5 + at / (2 * half_light), 0.0, 1.0);
            const double found = mask.visibility.at(x, y);
            if (!(std::abs(found - expected) <= tolerance))
                throw Error(ErrorCode::device, "the known mask is wrong at " + std::to_string(x) + ", " + std::to_string(y) + ": " +
                                                   std::to_string(found) + ", expected " + std::to_string(expected));
        }
}

void warm(const Engine& engine)
{
    const Scene scene = known_scene();
    for (const Technique& technique : technique_choices()) {
        try {
            engine.mask(scene, technique);
        } catch (const Error& error) {
            // A choice that does not go with the other defaults has no kernels of its own.
            if (error.code() != ErrorCode::invalid_input || !error.path().starts_with("technique.")) throw;
        }
    }
    // A reduced occluder map has a kernel of its own.
    engine.mask(scene, SoftShadowMap{.visibility = PatchVisibility::sum, .resolution = side / 2});
    engine.mask(scene, SoftShadowMap{.resolution = side / 2, .reduction = Reduction::nearest});
}

} // namespace penumbra::server
