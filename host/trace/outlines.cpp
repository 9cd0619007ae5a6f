#include "trace/outlines.hpp"

#include <algorithm>
#include <cmath>

namespace penumbra {

Outlines::Outlines(const Camera& camera, int width, int height)
    : camera_(camera), width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
{
}

// Points p = z (X, Y, 1) of a plane n . p = c have the disparity 1 / z = n . (X, Y, 1) / c, which is linear over the image.
void Outlines::set(int x, int y, float depth, const DepthVector& normal)
{
    const Vec3 ray = camera_point(camera_, width_, height_, x + 0.5, y + 0.5, 1);
    const double disparity = 1. / static_cast<double>(depth), across = normal.x * ray.x + normal.y * ray.y + normal.z;
    pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] = {
        .disparity = static_cast<float>(disparity),
        .tilt_x = static_cast<float>(disparity * normal.x * 2 * camera_.half_extent.x / width_ / across),
        .tilt_y = static_cast<float>(-disparity * normal.y * 2 * camera_.half_extent.y / height_ / across)};
}

bool Outlines::is_whole(int x, int y, double gap) const
{
    const Pixel& here = at(x, y);
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v)
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u) {
            const Pixel& there = at(u, v);
            if (here.disparity == 0 && there.disparity == 0) continue;
            if (here.disparity == 0 || there.disparity == 0) return false;
            // A few roundings of either disparity are no step.
            const float most = std::max(static_cast<float>(gap), 0x1p-20f * std::max(here.disparity, there.disparity));
            const float step = there.disparity - here.disparity, dx = static_cast<float>(u - x), dy = static_cast<float>(v - y);
            const bool one = std::abs(step) <= most || std::abs(step - dx * here.tilt_x - dy * here.tilt_y) <= most ||
                             std::abs(step - dx * there.tilt_x - dy * there.tilt_y) <= most;
            if (!one) return false;
        }
    return true;
}

} // namespace penumbra
