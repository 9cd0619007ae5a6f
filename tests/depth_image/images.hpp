// Depth images of simple scenes, in the values of common/depth_walk.h: disparities of a pinhole, far - z of an orthographic camera.
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "support/device_run.hpp"
#include "support/maps.hpp"

#include "depth_image/fit.hpp"

namespace penumbra::test {

constexpr double rounding = 0x1p-24; // of binary32, relative

// Square pixels whose side is 2 half / width.
inline Camera camera_for(int width, int height, double half = 0.6, bool orthographic = false)
{
    return {.frame = {}, .orthographic = orthographic, .half_extent = {half, half * height / width}};
}

// Disparity at (x, y) in pixels from the image's middle.
using Disparity = std::function<double(double x, double y)>;

struct Noise {
    double relative = 0; // standard error of the disparity over the disparity
    std::uint32_t seed = 7;
};

inline DepthMap image_of(int width, int height, const Disparity& disparity, const Noise& noise = {})
{
    std::mt19937 random(noise.seed);
    std::normal_distribution<double> normal(0, 1);
    DepthMap map = map_of(width, height, [&](int x, int y) {
        const double d = disparity(x + .5 - width / 2., y + .5 - height / 2.);
        const double off = noise.relative > 0 ? 1 + noise.relative * normal(random) : 1;
        return d > 0 ? static_cast<float>(1 / (d * off)) : nothing_there;
    });
    map.from_image = true;
    return map;
}

// A plane: disparity is linear over the image.
struct Plane {
    double at_middle, slope_x, slope_y;
    double operator()(double x, double y) const { return at_middle + slope_x * x + slope_y * y; }
};

// Two planes that meet along a line: the further one is seen inside a concave crease.
struct Crease {
    Plane one, other;
    double operator()(double x, double y) const { return std::min(one(x, y), other(x, y)); }
};

struct Step {
    Plane left, right;
    double at;
    double operator()(double x, double y) const { return x < at ? left(x, y) : right(x, y); }
};

// A ball before a plane, as a camera with pixels of `pixel` (tangents) sees it.
struct Ball {
    Plane behind;
    double pixel, z, radius; // its centre lies on the axis
    double operator()(double x, double y) const
    {
        // |s (tx, ty, 1) - (0, 0, z)| = radius for depth s.
        const double a = 1 + pixel * pixel * (x * x + y * y), root = z * z - a * (z * z - radius * radius);
        return root > 0 ? a / (z - std::sqrt(root)) : behind(x, y);
    }
};

inline DepthFit fit_of(const DepthMap& map, const Camera& camera)
{
    opencl::Work work(device_context(true));
    DepthFit fit = fit_depth(work, map, camera);
    work.finish();
    return fit;
}
inline DepthFit fit_of(const DepthMap& map) { return fit_of(map, camera_for(map.width, map.height)); }

} // namespace penumbra::test
