// The union of soft_shadow_map on the device: the patches of any number of occluder maps (kernels/soft_shadow_union.cl).
#pragma once

#include <span>

#include "technique/emission.hpp"
#include "technique/occluder_maps.hpp"
#include "technique/receiver_points.hpp"

namespace penumbra {

// All maps behind each other (kernels/micro_patches.cl): texels, their edges' disparities, their reach and what is covered of them [maps][height][width]; the
// patches above them and their reach [maps][above].
struct PreparedUnion {
    opencl::Buffer<cl_float2> texels;
    opencl::Buffer<cl_float4> edges, parts; // no parts: texels are covered whole
    opencl::Buffer<float> texel_reach, reach;
    opencl::Buffer<MicroPatch> patches;
    opencl::Buffer<cl_uint> light_rows; // which samples of the light shine
    int light_samples = 0;
    opencl::Buffer<float> emission; // of a texture [channels][LIGHT_SIDE][LIGHT_SIDE]: what each sample's cell is of the whole light
    int channels = 0;               // of the texture; 0: none
    int maps = 0;
    std::size_t above = 0; // patches of a map
    float nearest = 0;     // greatest disparity of all; 0: nothing casts
};

// What the union is made from: planar depth maps, `from` texels each, used at `size`. `other`: of each map the number of the one that shows the other side of
// its bodies, the next entry's exit or the last exit's entry; -1: none.
struct UnionMaps {
    std::span<const cl::Buffer> depth;
    std::span<const cl::Buffer> fine; // of each map the samples of some texels, fine_side x fine_side a block (FineDepth); none: there are no such
    int fine_side;
    std::size_t fine_samples;
    cl::Buffer blocks;
    std::span<const int> other;
    MapSize from, size;
    double precision; // relative, of the depths
    LightShape shape;
    const Image* emission; // null: none
};

opencl::Specialisation union_program(int lanes);

// Whether a map shows something that none of the others does, `count` depths each.
bool shows_more(opencl::Work& work, const cl::Buffer& depth, std::span<const cl::Buffer> others, std::size_t count);

// Sets the samples' shares of a light with that texture; null: none.
void set_emission(opencl::Work& work, const Image* emission, PreparedUnion& prepared);

PreparedUnion prepare_union(opencl::Work& work, const UnionMaps& maps, const OccluderView& view);

struct UnionShading {
    double bias, tolerance;
    double precision; // relative, of all depths
};
// Writes visibility and, a tile, how many patches its rows of receivers looked at.
void shade_union(opencl::Work& work, const PreparedUnion& prepared, const OccluderView& view, const UnionShading& shading, const ReceiverPoints& receivers,
                 const opencl::Buffer<cl_float8>& bounds, const cl::Buffer& visibility, const opencl::Buffer<cl_uint>& evaluated);

} // namespace penumbra
