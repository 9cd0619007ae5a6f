// A depth image as rays meet it, and as receivers stand on it.
#pragma once

#include <vector>

#include <penumbra/scene.hpp>

#include "common/depth_walk.h"
#include "depth_image/fit.hpp"

namespace penumbra {

// What casts: each pixel's front and back, and a pyramid of what is nearest.
struct DepthImage {
    Camera camera;
    DepthView view{};
    std::vector<DepthPixel> pixels; // [height][width]
    std::vector<float> nearest;     // the pyramid: the greatest values of all levels' blocks, then the least
    DepthQuality quality;

    std::uint64_t bytes() const { return pixels.size() * sizeof(DepthPixel) + nearest.size() * sizeof(float); }
};

// thickness: of the bodies behind the surfaces, scene units; not positive: from their silhouettes (thickness.hpp). `back`, where it is given
// and lies behind, is the far side and no guess.
DepthImage depth_image(const DepthFit& fit, const Camera& camera, double thickness, const DepthMap* back = nullptr);

// What receives: a point for each pixel, lifted off its surface, and the surface's normal towards the camera.
struct DepthSurface {
    int width = 0, height = 0;
    Camera camera;
    std::vector<DepthVector> points;  // in the camera's coordinates: x right, y up, z along the view; z = 0: nothing is shaded here
    std::vector<DepthVector> normals; // unit length, in the same
    std::vector<float> depth;         // planar depth of the lifted point; nothing_there where nothing is shaded
    DepthQuality quality;
};

// Of the surface through each pixel's centre, towards the camera, in its coordinates; 0 where nothing is seen.
struct SurfaceNormals {
    std::vector<DepthVector> directions; // [height][width]
};

// Lifted along the normal by .3 of the window's half width (5 x 5 pixels: .6 of the pixel's footprint) times the sine of the angle of view, by what
// the plane may be off, and by 1e-5 of the depth.
DepthSurface depth_surface(const DepthFit& fit, const Camera& camera);

// Whether one camera's pixels are the other's receivers, all but for the rounding of how its place was written.
bool same_place(const Camera& a, const Camera& b);

// From the camera's coordinates to the world and back.
Vec3 world_from_camera(const Camera& camera, const Vec3& point);
Vec3 camera_from_world(const Camera& camera, const Vec3& point);
Vec3 direction_from_world(const Camera& camera, const Vec3& direction);

} // namespace penumbra
