// Soft Shadow Maps (Atty et al. 2006): settings become device state, device state becomes masks.
#pragma once

#include <vector>

#include "technique/occluder_maps.hpp"
#include "technique/receiver_points.hpp"

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
    float nearest = 0; // greatest disparity of any side; 0: nothing casts
    std::vector<Side> sides;
};

// What shading counted. Zero where the work is only queued.
struct ShadeCounts {
    std::uint64_t pairs = 0;               // (texel, receiver) pairs evaluated
    std::uint64_t receivers = 0;           // that are there
    std::uint64_t uncovered_receivers = 0; // that see part of the light past the occluder map's border
};

// The program with every kernel that the technique launches on this device.
opencl::Specialisation program_of(const opencl::Context& context, const SoftShadowMap& settings);

PreparedSoftShadowMap prepare_soft_shadow_map(opencl::Work& work, const OccluderDepth& depth, const SoftShadowMap& settings);

// Writes visibility, receivers.view.height x receivers.view.width. With `counts` it waits for the device to fill them in.
void shade_soft_shadow_map(opencl::Work& work, const PreparedSoftShadowMap& prepared, const ReceiverPoints& receivers,
                           const cl::Buffer& visibility, ShadeCounts* counts);

// A mask of the light's view, sampled at receivers of another camera (the `project` setting).
void sample_mask(opencl::Work& work, const ReceiverPoints& receivers, const cl::Buffer& mask, int mask_width, int mask_height,
                 const cl::Buffer& visibility, const opencl::Specialisation& program = ReceiversConstants{}.specialisation());

} // namespace penumbra
