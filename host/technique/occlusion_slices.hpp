// occlusion_texture's slices: what casts, marked in them on the device. The kernels are those of occlusion_slices.cl.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <penumbra/technique.hpp>

#include "common/shared.h"
#include "opencl/work.hpp"
#include "scene/camera.hpp"
#include "scene/light_space.hpp"
#include "technique/slice_fit.hpp"

namespace penumbra {

// The solid between two maps of the light's own view, planar depth: filled in beside the casters' surfaces.
struct SolidMaps {
    const DepthMap &front, &back;
    Camera camera;
};

// What casts, on the device. `depths` is empty where nothing lies before the light.
struct SliceScenery {
    const LightFrame& light;
    SliceCasters casters;
    SliceRange range;
    std::vector<float> depths;
    opencl::Buffer<float> vertices, planes;
    opencl::Buffer<cl_int> triangles, large;
    const SolidMaps* solid;
    SelfShadow self_shadow; // not automatic
    opencl::Buffer<float> front, back;
};

SliceScenery slice_scenery(opencl::Work& work, const LightFrame& frame, std::span<const TriangleMesh* const> meshes, const SolidMaps* solid,
                           const OcclusionTexture& settings, bool receivers_cast);

// n x n parts of the light, of even size.
std::vector<SlicePart> slice_parts(const LightFrame& light, int splits);

// The marked slices of one part.
struct MarkedSlices {
    SliceView view{};
    std::vector<OcclusionPlane> planes; // those that hold anything
    std::array<int, 2> taps{1, 1};
    opencl::Buffer<cl_uint> occupancy;
};

MarkedSlices marked_slices(opencl::Work& work, const opencl::Specialisation& program, const SliceScenery& scenery, const SlicePart& part,
                           const OcclusionTexture& settings);

inline cl_int2 size_of(const SliceView& view) { return {{view.width, view.height}}; }

} // namespace penumbra
