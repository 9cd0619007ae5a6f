// glTF 2 (.gltf, .glb): the structure through tinygltf, the bytes by ourselves. tinygltf would open files itself, want a buffer's size to
// the byte, know few types of data URIs, and take images that lie outside of their buffer. Assimp 5.2 ignores what a file requires, skins
// and weights, and crashes on changed files.
#pragma once

#include <cstddef>
#include <span>

#include "io/polygon_soup.hpp"

namespace penumbra {

// The triangles of the default scene (`scene`, else the first): what its nodes hold, where they stand, turned around under mirrored nodes.
// Skins are as their joints stand, morph targets as their weights say; KHR_mesh_quantization, EXT_mesh_gpu_instancing,
// KHR_texture_transform and KHR_node_visibility are read. Materials of alphaMode MASK are cut out. Throws unsupported for another required
// extension, by its name; invalid_input for what is broken; not_found for another file that is not there; too_large.
PolygonSoup decode_gltf(std::span<const std::byte> bytes, const MeshSource& source);

} // namespace penumbra
