// occlusion_texture's slices, prefiltered on the device. The kernels are those of occlusion_levels.cl.
#pragma once

#include "opencl/work.hpp"
#include "technique/occlusion_levels.hpp"
#include "technique/occlusion_slices.hpp"

namespace penumbra {

// How many levels each plane needs, for receivers however far away.
void set_levels(MarkedSlices& marked, LevelKind kind, bool directional);

LevelLayout layout_of(const MarkedSlices& marked, LevelKind kind);

// Throws too_large, with what would fit, where the device cannot hold that many elements.
void check_memory(const opencl::Context& context, const MarkedSlices& marked, std::uint64_t elements, LevelKind kind, bool directional,
                  const OcclusionTexture& settings);

// `data` has room for all elements.
void build_tables(opencl::Work& work, const opencl::Specialisation& program, const MarkedSlices& marked, const OcclusionTexture& settings,
                  const opencl::Buffer<OcclusionPlane>& planes, const opencl::Buffer<cl_uchar>& data);
void build_levels(opencl::Work& work, const opencl::Specialisation& program, const MarkedSlices& marked, const OcclusionTexture& settings,
                  LevelKind kind, const LevelLayout& layout, const opencl::Buffer<OcclusionPlane>& planes,
                  const opencl::Buffer<cl_uchar>& data);

} // namespace penumbra
