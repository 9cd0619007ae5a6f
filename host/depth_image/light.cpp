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

opencl::Specialisation horizon_program() { return {"horizon.cl", {}}; }

void clip_at_horizon(opencl::Work& work, const Light& light, const DepthSurface& surface, int channels, const cl::Buffer& visibility)
{
    work.stage("clip at horizon");
    DepthLight seen = depth_light(light, surface.camera, surface.camera);
    seen.count = static_cast<int>(surface.points.size());
    const auto points = work.upload(std::span<const DepthVector>(surface.points), "receiver points");
    const auto normals = work.upload(std::span<const DepthVector>(surface.normals), "receiver normals");
    work.launch(horizon_program(), "clip_at_horizon", {surface.points.size(), 1}, {64, 1}, 2 * points.bytes(), seen, static_cast<cl_int>(channels),
                points, normals, visibility);
}

} // namespace penumbra
