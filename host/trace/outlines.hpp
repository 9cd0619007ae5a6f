// Where something begins or ends in a depth map.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/light_space.hpp"
#include "trace/tracer.hpp"

namespace penumbra {

// What a map's pixels show: a height that is linear over the image of a plane, 1 / z or orthographic -z, and how it changes to the next pixel along the surface's
// plane.
class Outlines {
public:
    Outlines(const Camera& camera, int width, int height);

    // normal: of the surface, in the camera's coordinates, z along its axis.
    void set(int x, int y, float depth, const DepthVector& normal);

    // Whether a pixel and those around it show one surface, or all of them nothing. Two pixels are one where their heights differ by at most `gap`, or
    // by that much from where the plane of either meets the other.
    bool is_whole(int x, int y, double gap) const;

private:
    struct Pixel {
        float height = 0, tilt_x = 0, tilt_y = 0; // height 0: nothing
    };
    void set_pixel(int x, int y, double height, const DepthVector& normal, double tilt);
    const Pixel& at(int x, int y) const { return pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)]; }

    Camera camera_;
    int width_, height_;
    std::vector<Pixel> pixels_;
};

} // namespace penumbra
