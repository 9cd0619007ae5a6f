#include "depth_image/views.hpp"

#include <algorithm>

namespace penumbra {

void set_transform(float (&to_from)[12], const Camera& to, const Camera& from)
{
    // Differences of origins in double, so that scenes far from the world's origin keep their digits.
    const Vec3 axes_to[3] = {to.frame.x, to.frame.y, -to.frame.z};
    const Vec3 axes_from[3] = {from.frame.x, from.frame.y, -from.frame.z};
    const Vec3 offset = from.frame.origin - to.frame.origin;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) to_from[4 * row + column] = static_cast<float>(axes_to[row].dot(axes_from[column]));
        to_from[4 * row + 3] = static_cast<float>(axes_to[row].dot(offset));
    }
}

opencl::Specialisation depth_trace_program(int lanes) { return {"depth_trace.cl", {{"LANES", std::to_string(lanes)}}}; }

void add_view(opencl::Work& work, const DepthImage& image, const Camera& camera, DepthMap& front, DepthMap& back)
{
    DepthSight sight{};
    set_transform(sight.image_from_camera, image.camera, camera);
    sight.pixel_x = static_cast<float>(2 * camera.half_extent.x / front.width);
    sight.pixel_y = static_cast<float>(2 * camera.half_extent.y / front.height);
    sight.off_x = static_cast<float>(camera.off_axis.x);
    sight.off_y = static_cast<float>(camera.off_axis.y);
    sight.width = front.width;
    sight.height = front.height;
    sight.orthographic = camera.orthographic;
    const auto pixels = work.upload(std::span<const DepthPixel>(image.pixels), "depth image");
    const auto nearest = work.upload(std::span<const float>(image.nearest), "depth image's pyramid");
    const auto fronts = work.upload(std::span<const float>(front.depth), "front depth"), backs = work.upload(std::span<const float>(back.depth), "back depth");
    work.launch(depth_trace_program(work.context().quirks().lanes), "depth_view", {static_cast<std::size_t>(front.width), static_cast<std::size_t>(front.height)}, {16, 8},
                pixels.bytes() + 2 * fronts.bytes(), image.view, sight, pixels, nearest, fronts, backs, work.stop());
    front.depth = work.read(fronts);
    back.depth = work.read(backs);
    front.precision = back.precision = std::max(front.precision, image.quality.noise);
}

} // namespace penumbra
