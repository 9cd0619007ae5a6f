#include "depth_image/light.hpp"

#include "depth_image/views.hpp"
#include "scene/light_space.hpp"

namespace penumbra {
namespace {

void set(float (&to)[4], const Vec3& v)
{
    to[0] = static_cast<float>(v.x);
    to[1] = static_cast<float>(v.y);
    to[2] = static_cast<float>(v.z);
    to[3] = 0;
}

} // namespace

DepthLight depth_light(const Light& light, const Camera& image, const Camera& receivers)
{
    const LightFrame frame = light_frame(light);
    DepthLight result{};
    set_transform(result.image_from_receiver, image, receivers);
    set(result.centre, frame.directional ? direction_from_world(image, -frame.direction) : camera_from_world(image, frame.origin));
    set(result.half_u, direction_from_world(image, frame.u * frame.half_u));
    set(result.half_v, direction_from_world(image, frame.v * frame.half_v));
    result.endless = frame.directional;
    result.disc = frame.shape == LightShape::disc;
    result.sphere = std::holds_alternative<SphereLight>(light);
    return result;
}

void clip_at_horizon(opencl::Work& work, const opencl::Specialisation& program, const Horizon& horizon, int channels, const cl::Buffer& visibility)
{
    DepthLight seen = depth_light(horizon.light, horizon.camera, horizon.camera);
    const std::size_t count = horizon.listed() ? horizon.listed_count : static_cast<std::size_t>(horizon.width) * static_cast<std::size_t>(horizon.height);
    seen.count = static_cast<int>(count);
    const auto* rectangle = std::get_if<RectangleLight>(&horizon.light);
    const DepthSight sight{.image_from_camera = {},
                           .pixel_x = static_cast<float>(2 * horizon.camera.half_extent.x / horizon.width),
                           .pixel_y = static_cast<float>(2 * horizon.camera.half_extent.y / horizon.height),
                           .off_x = static_cast<float>(horizon.camera.off_axis.x),
                           .off_y = static_cast<float>(horizon.camera.off_axis.y),
                           .width = horizon.width,
                           .height = horizon.height,
                           .orthographic = horizon.camera.orthographic};
    work.launch(program, "clip_at_horizon", {count, 1}, {64, 1}, count * 28, seen, sight, static_cast<cl_int>(horizon.points.get() != nullptr),
                static_cast<cl_int>(rectangle && rectangle->emission), static_cast<cl_int>(channels), horizon.listed, horizon.points, horizon.depth, horizon.normals,
                visibility);
}

} // namespace penumbra
