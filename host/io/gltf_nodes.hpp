// Where the nodes of a glTF file stand.
#pragma once

#include <vector>

#include <Imath/ImathMatrix.h>

#include "io/gltf_file.hpp"

namespace penumbra {

// Row vectors: a point p is at p * world[node].
struct GltfNodes {
    std::vector<Imath::M44d> world; // of every node
    std::vector<int> shown;         // those of the default scene that are visible, parents first
};

// Throws invalid_input for nodes that are their own ancestors or have two parents.
GltfNodes read_nodes(const GltfFile& file);

// The places of the mesh of node `index`: the node's own, or with EXT_mesh_gpu_instancing those of all instances.
std::vector<Imath::M44d> places_of(const GltfFile& file, int index, const Imath::M44d& world);

} // namespace penumbra
