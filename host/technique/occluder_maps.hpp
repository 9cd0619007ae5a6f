// Occluder maps on the device: what depth-map techniques prepare from.
#pragma once

#include <penumbra/technique.hpp>

#include "common/shared.h"
#include "opencl/work.hpp"
#include "scene/camera.hpp"
#include "scene/light_space.hpp"
#include "technique/verbs.hpp"

namespace penumbra {

// What FineDepth holds of front, back and layers, in this order; side 0: nothing.
struct FineOnDevice {
    int side = 0;
    cl::Buffer blocks;
    std::vector<cl::Buffer> depth; // of each map
    std::size_t samples = 0;       // of each map
};

// Planar depth as uploaded, with the view it was taken from. `back` may be empty.
struct OccluderDepth {
    LightFrame light;
    Camera camera; // the light's own view
    int width = 0, height = 0;
    double precision = 0; // relative, of the depths
    cl::Buffer front, back;
    std::vector<cl::Buffer> layers; // behind the front
    FineOnDevice fine = {};
};

// The program of occluders.cl by itself (see receivers_program).
opencl::Specialisation occluders_program();

// The maps that prepare was handed, on the device: uploaded in a stage of their own unless they are there already. What is not asked for is
// left out. The buffers have to live until the last launch that reads them.
struct DeviceDepth {
    OccluderDepth depth;
    std::vector<opencl::Buffer<float>> uploaded;
    opencl::Buffer<cl_int> blocks = {};
};
DeviceDepth on_device(opencl::Work& work, const Casting& casting, bool front, bool back, int layers = 0);

// A directional light's maps as those of a perspective view with the disparities 2 - z / reach (kernels/occluders.cl). `depth` keeps its light and camera;
// of any other light it is what was given, and `reach` 0. program: one that has the kernels.
struct EndlessDepth {
    OccluderDepth depth;
    std::vector<opencl::Buffer<float>> made; // what `depth` refers to
    float reach = 0;
};
EndlessDepth endless_depth(opencl::Work& work, const OccluderDepth& depth, const opencl::Specialisation& program);

// What a technique says when its map holds nothing.
constexpr const char* empty_map = "the occluder map is empty: nothing casts shadows";

// One map, ready to be shaded with.
struct OccluderMap {
    opencl::Buffer<cl_float2> texels; // (disparity, covered share)
    opencl::Buffer<cl_float2> steps;  // disparity steps of the surface to the next texel
};

// The map's width and height when its longer side is `resolution` (0, or more than it has: as it is).
struct MapSize {
    int width, height;
};
MapSize reduced_size(int width, int height, int resolution);

// With k (light_scale of kernels/common/shared.h) for both axes. A light of no extent counts as one so small that every back-projected
// texel edge lies far outside it or far inside the texel: 10^18 lights across at a disparity step of 1.
// reach: of a directional light, depth over which disparity changes by 1 (EndlessDepth); 0: disparity is 1 / z, or -z of a directional light.
OccluderView occluder_view(const LightFrame& light, const Camera& camera, MapSize size, float reach = 0);

// The step of disparity between two texels that lets half a texel of light through at the most, across and down: up to it they hide as one surface does.
cl_float2 joining_gap(const OccluderView& view);

// Disparity and covered share at `size`, and the surface's steps; depths are right to the relative `precision`.
// `program`: one that has the kernels.
OccluderMap occluder_map(opencl::Work& work, const cl::Buffer& depth, MapSize from, MapSize size, Reduction reduction, double precision,
                         const opencl::Specialisation& program = occluders_program());

} // namespace penumbra
