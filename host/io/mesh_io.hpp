// Meshes: OBJ, STL, 3DS and glTF 2 through Assimp, PLY by ourselves.
#pragma once

#include <string>
#include <string_view>

#include <penumbra/scene.hpp>

namespace penumbra {

// All triangles of the file, node transforms applied, vertices at equal positions joined. Throws not_found, invalid_input (unreadable,
// empty, no triangles, positions that are not finite), unsupported (another format), too_large (over 64 Mi triangles).
TriangleMesh read_mesh(const std::string& path, std::string_view where);

} // namespace penumbra
