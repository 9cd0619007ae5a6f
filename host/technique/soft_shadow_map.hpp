// Soft Shadow Maps (Atty et al. 2006): settings become device state, device state becomes masks.
#pragma once

#include <vector>

#include "technique/occluder_maps.hpp"
#include "technique/receiver_points.hpp"
#include "technique/soft_shadow_union.hpp"
#include "technique/table.hpp"
#include "technique/verbs.hpp"

namespace penumbra {

struct PreparedSoftShadowMap {
    // One occluder map and its pyramid: the nearest disparity in each block of texels, and in each block of blocks.
    struct Side {
        OccluderMap map;
        opencl::Buffer<float> blocks, superblocks;
    };
    SoftShadowMap settings;
    opencl::Specialisation program;
    OccluderView view{};
    double precision = 0;
    float reach = 0;   // of a directional light (ReceiverView::light_reach)
    float nearest = 0; // greatest disparity of any side; 0: nothing casts
    std::vector<Side> sides; // of the sum
    PreparedUnion united;    // of the union
};

PreparedSoftShadowMap prepare_soft_shadow_map(opencl::Work& work, const OccluderDepth& given, const SoftShadowMap& settings, const Image* emission = nullptr);

// Writes visibility, receivers.view.height x receivers.view.width, of a textured light with its channels. With `counts` it waits for the device to fill them in.
void shade_soft_shadow_map(opencl::Work& work, const PreparedSoftShadowMap& prepared, const ReceiverPoints& receivers,
                           const cl::Buffer& visibility, ShadeCounts* counts);

// A mask of the light's view, sampled at receivers of another camera (the `project` setting).
void sample_mask(opencl::Work& work, const ReceiverPoints& receivers, const cl::Buffer& mask, int mask_width, int mask_height,
                 const cl::Buffer& visibility, const opencl::Specialisation& program = receivers_program());

// The verbs (verbs.hpp).
TechniqueRow row(const SoftShadowMap&);
Needs needs(const SoftShadowMap& settings);
PreparedSoftShadowMap prepare(opencl::Work& work, const Casting& casting, const SoftShadowMap& settings, Findings& findings);
PreparedSoftShadowMap with_emission(opencl::Work& work, const PreparedSoftShadowMap& prepared, const Light& light);
void shade(opencl::Work& work, const PreparedSoftShadowMap& prepared, const Receiving& receivers, Shaded& shaded);
std::vector<WorkAmount> work(const SoftShadowMap& settings, const MaskShape& shape);
std::vector<opencl::Specialisation> specialisations(const SoftShadowMap& settings, int lanes);
DeviceBuffers device_buffers(const SoftShadowMap& settings);
void check_together(const SoftShadowMap& settings);

} // namespace penumbra
