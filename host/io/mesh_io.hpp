// Meshes: OBJ, PLY and STL by ourselves, glTF 2 through tinygltf, 3DS through Assimp.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/scene.hpp>
#include <penumbra/scene_file.hpp>

#include "scene/object_placement.hpp"

namespace penumbra {

struct MeshOptions {
    ObjectPlacement placement;
    double weld = 0;                                         // vertices no further apart are joined, scene units
    std::function<Bytes(const std::string& name)> companion; // files that it names, relative to it; without one they lie beside it
    std::uint64_t max_samples = std::uint64_t{1} << 30;      // of an image that cuts it out
    std::vector<std::string>* warnings = nullptr;            // what was left out or looks wrong, each starting with `where`
};

// All triangles of the file, node transforms applied, placed, vertices at equal positions joined (mesh_build.hpp). Throws not_found,
// invalid_input (unreadable, empty, no triangles, positions that are not finite), unsupported (another format, a required extension),
// too_large (over 64 Mi triangles).
TriangleMesh read_mesh(const std::string& path, std::string_view where, const MeshOptions& options = {});

} // namespace penumbra
