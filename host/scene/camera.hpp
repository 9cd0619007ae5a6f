// Cameras: from what a scene says to one that is ready, and between pixels and points.
#pragma once

#include <string_view>

#include <penumbra/scene.hpp>

#include "scene/ground.hpp"
#include "scene/light_space.hpp"

namespace penumbra {

// What a light's view need not hold: objects that do not cast, and ground.
struct LeftOut {
    bool receivers = false;
    std::vector<Ground> grounds = {};

    bool holds(const Object& object) const { return receivers && !object.casts; }
};

// The camera of the light, looking along its direction, image x along u, image up along v.
Camera light_camera(const LightFrame& light, const Vec2& half_extent, const Vec3& center);

// The view of a pinhole through an image of this size.
Camera pinhole_view(const PinholeCamera& pinhole, int width, int height);

// The camera whose whole image is `width` x `height` pixels of another's, of which the top left corner lies at (x, y) of its `of_width` x
// `of_height`; it may reach beyond.
Camera part_of_view(const Camera& camera, int of_width, int of_height, int x, int y, int width, int height);

// Makes a camera ready. A light's camera with parts left out is fitted to the objects that cast or receive, but for what is left
// out, as long as others are left; throws invalid_input ("<where>.tan_half_fov: ...") when there is nothing to fit to, or when
// objects lie at or behind the light's plane all round.
Camera resolve_camera(const CameraSpec& spec, const Light& light, const std::vector<Object>& objects, int width, int height,
                      std::string_view where, const LeftOut& left_out = {});

// Throws invalid_input for a frame that is not orthonormal and right-handed (1e-4) or fields of view that are not positive and finite.
void validate(const Camera& camera, std::string_view where);

// Camera space point (x right, y up, depth positive along the view) of a pixel's centre at `depth`, and its world space point.
Vec3 camera_point(const Camera& camera, int width, int height, double x_px, double y_px, double depth);
Vec3 world_point(const Camera& camera, int width, int height, double x_px, double y_px, double depth);

// Pixel coordinates (pixel (0, 0)'s centre is at 0.5, 0.5) and planar depth of a world point. Depth <= 0 is behind the camera.
struct Projected {
    double x_px, y_px, depth;
};
Projected project(const Camera& camera, int width, int height, const Vec3& world);

Imath::Box3d bounds(const TriangleMesh& mesh);

} // namespace penumbra
