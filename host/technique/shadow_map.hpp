// Shadow mapping and its filters: the baselines.
#pragma once

#include "technique/occluder_maps.hpp"
#include "technique/receiver_points.hpp"
#include "technique/table.hpp"
#include "technique/verbs.hpp"

namespace penumbra {

struct PreparedShadowMap {
    ShadowMap settings;
    opencl::Specialisation program;
    OccluderView view{};
    double precision = 0;
    float reach = 0; // of a directional light (ReceiverView::light_reach)
    OccluderMap map;
};

PreparedShadowMap prepare_shadow_map(opencl::Work& work, const OccluderDepth& given, const ShadowMap& settings);

// Writes visibility, receivers.view.height x receivers.view.width.
void shade_shadow_map(opencl::Work& work, const PreparedShadowMap& prepared, const ReceiverPoints& receivers, const cl::Buffer& visibility);

// The verbs (verbs.hpp).
TechniqueRow row(const ShadowMap&);
Needs needs(const ShadowMap&);
PreparedShadowMap prepare(opencl::Work& work, const Casting& casting, const ShadowMap& settings, Findings& findings);
void shade(opencl::Work& work, const PreparedShadowMap& prepared, const Receiving& receivers, Shaded& shaded);
std::vector<WorkAmount> work(const ShadowMap& settings, const MaskShape& shape);
std::vector<opencl::Specialisation> specialisations(const ShadowMap& settings, int lanes);
DeviceBuffers device_buffers(const ShadowMap& settings);

} // namespace penumbra
