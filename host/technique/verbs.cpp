#include "technique/verbs.hpp"

namespace penumbra {

ReceiverPoints points_of(opencl::Work& work, const DepthMap& depth, const Camera& camera, const Camera& view,
                         const opencl::Specialisation& program)
{
    work.stage("upload receivers");
    const auto uploaded = work.upload(std::span<const float>(depth.depth), "receiver depth");
    work.stage("receivers");
    return receiver_points(work, receiver_view(camera, depth.width, depth.height, view), uploaded.memory(), depth.precision, program);
}

ReceiverPoints points_of(opencl::Work& work, const Receiving& receivers, const opencl::Specialisation& program)
{
    if (receivers.depth) return points_of(work, *receivers.depth, receivers.camera, receivers.view, program);
    const ReceiverView view = receiver_view(receivers.camera, receivers.width, receivers.height, receivers.view);
    return receiver_points(work, view, receivers.device_depth, 0x1p-24, program);
}

} // namespace penumbra
