// Shadow mapping and its filters: the baselines.
#pragma once

#include "technique/occluder_maps.hpp"
#include "technique/receiver_points.hpp"

namespace penumbra {

struct PreparedShadowMap {
    ShadowMap settings;
    opencl::Specialisation program;
    OccluderView view{};
    double precision = 0;
    OccluderMap map;
};

PreparedShadowMap prepare_shadow_map(opencl::Work& work, const OccluderDepth& depth, const ShadowMap& settings);

// Writes visibility, receivers.view.height x receivers.view.width.
void shade_shadow_map(opencl::Work& work, const PreparedShadowMap& prepared, const ReceiverPoints& receivers, const cl::Buffer& visibility);

} // namespace penumbra
