#include "technique/verbs.hpp"

namespace penumbra {

ReceiverPoints points_of(opencl::Work& work, const DepthMap& depth, const Camera& camera, const Camera& view,
                         const opencl::Specialisation& program, float reach)
{
    work.stage("upload receivers");
    const auto uploaded = work.lend(std::span<const float>(depth.depth), "receiver depth");
    work.stage("receivers");
    return receiver_points(work, receiver_view(camera, depth.width, depth.height, view, reach), uploaded.memory(), depth.precision, program);
}

namespace {

double precision_of(const Receiving& receivers) { return receivers.depth ? receivers.depth->precision : 0x1p-24; }

ReceiverPoints listed_points(opencl::Work& work, const Receiving& receivers, bool planes, const opencl::Specialisation& program, float reach)
{
    const PixelList& list = *receivers.listed;
    const ImageOnDevice image{.depth = receivers.device_depth, .points = receivers.device_points, .normals = planes ? receivers.normals : nullptr};
    return listed_receiver_points(work, receiver_view(receivers.camera, list.width, list.height, receivers.view, reach), list, image, precision_of(receivers), program);
}

} // namespace

ReceiverPoints points_of(opencl::Work& work, const Receiving& receivers, const opencl::Specialisation& program, float reach)
{
    if (receivers.depth) work.stage("receivers");
    if (receivers.listed) return listed_points(work, receivers, false, program, reach);
    const ReceiverView view = receiver_view(receivers.camera, receivers.width, receivers.height, receivers.view, reach);
    const double precision = precision_of(receivers);
    if (!receivers.device_points) return receiver_points(work, view, receivers.device_depth, precision, program);
    return lifted_receiver_points(work, view, *receivers.device_points, precision, program);
}

ReceiverPoints points_with_planes(opencl::Work& work, const Receiving& receivers, const opencl::Specialisation& program, float reach)
{
    if (receivers.listed) {
        work.stage("receivers");
        return listed_points(work, receivers, true, program, reach);
    }
    ReceiverPoints points = points_of(work, receivers, program, reach);
    if (receivers.normals) add_planes(work, points, *receivers.normals, program);
    return points;
}

std::vector<TriangleMesh> surfaces_of(const LightDepth& maps, bool back)
{
    std::vector<TriangleMesh> meshes{mesh_of_texels(*maps.front, maps.camera)};
    if (back && maps.back) meshes.push_back(mesh_of_texels(*maps.back, maps.camera));
    for (const DepthMap& layer : maps.layers) meshes.push_back(mesh_of_texels(layer, maps.camera));
    return meshes;
}

} // namespace penumbra
