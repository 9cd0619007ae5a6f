#include "trace/outlines.hpp"

#include <algorithm>
#include <cmath>

namespace penumbra {

Outlines::Outlines(const Camera& camera, int width, int height)
    : camera_(camera), width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
{
}

// Points p = z (X, Y, 1) of a plane n . p = c have the disparity 1 / z = n . (X, Y, 1) / c, which is linear over the image; orthographic points (X, Y, z) have
// -z = (n.x X + n.y Y - c) / n.z.
void Outlines::set(int x, int y, float depth, const DepthVector& normal)
{
    if (camera_.orthographic) {
        set_pixel(x, y, -static_cast<double>(depth), normal, 1. / normal.z);
        return;
    }
    const Vec3 ray = camera_point(camera_, width_, height_, x + 0.5, y + 0.5, 1);
    const double height = 1. / static_cast<double>(depth);
    set_pixel(x, y, height, normal, height / (normal.x * ray.x + normal.y * ray.y + normal.z));
}

void Outlines::set_pixel(int x, int y, double height, const DepthVector& normal, double tilt)
{
    pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] = {
        .height = static_cast<float>(height),
        .tilt_x = static_cast<float>(tilt * normal.x * 2 * camera_.half_extent.x / width_),
        .tilt_y = static_cast<float>(-tilt * normal.y * 2 * camera_.half_extent.y / height_)};
}

bool Outlines::is_whole(int x, int y, double gap) const
{
    const Pixel& here = at(x, y);
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v)
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u) {
            const Pixel& there = at(u, v);
            if (here.height == 0 && there.height == 0) continue;
            if (here.height == 0 || there.height == 0) return false;
            // A few roundings of either are no step.
            const float most = std::max(static_cast<float>(gap), 0x1p-20f * std::max(std::abs(here.height), std::abs(there.height)));
            const float step = there.height - here.height, dx = static_cast<float>(u - x), dy = static_cast<float>(v - y);
            const bool one = std::abs(step) <= most || std::abs(step - dx * here.tilt_x - dy * here.tilt_y) <= most ||
                             std::abs(step - dx * there.tilt_x - dy * there.tilt_y) <= most;
            if (!one) return false;
        }
    return true;
}

} // namespace penumbra
