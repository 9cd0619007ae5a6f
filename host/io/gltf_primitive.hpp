// The triangles of a glTF mesh's parts.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "io/gltf_file.hpp"

namespace penumbra {

// One part as it is before it stands anywhere.
struct GltfPrimitive {
    std::vector<Vec3> positions; // morph targets added
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::uint32_t cut = not_cut;     // of the soup's
    std::vector<Imath::V2f> texture; // of each vertex, when it is cut out
    std::size_t lines = 0;           // 1: it is points or lines, and there are no triangles
};

// With the weights of its morph targets; missing ones are 0.
GltfPrimitive read_primitive(const GltfFile& file, const tinygltf::Primitive& primitive, const std::vector<double>& weights);

// Corners of triangles from indices: lists, strips and fans.
std::vector<std::array<std::uint32_t, 3>> triangles_of(const std::vector<std::uint32_t>& indices, int mode);

} // namespace penumbra
