// Skins of glTF files, as their joints stand.
#pragma once

#include "io/gltf_nodes.hpp"

namespace penumbra {

// Of each vertex its place in the world, from its own joints and weights.
std::vector<Imath::M44d> skin_places(const GltfFile& file, const tinygltf::Primitive& primitive, int skin, const GltfNodes& nodes,
                                     std::size_t vertices);

} // namespace penumbra
