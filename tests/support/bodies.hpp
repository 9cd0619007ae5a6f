// Bodies that cast and receive.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <penumbra/scene.hpp>

#include "trace/meshes.hpp"

namespace penumbra::test {

inline Object body(TriangleMesh mesh)
{
    Object object;
    object.name = "body";
    object.mesh = std::move(mesh);
    object.casts = object.receives = true;
    return object;
}

inline Object body(const std::vector<Vec3>& positions, std::vector<std::array<std::uint32_t, 3>> triangles)
{
    TriangleMesh mesh;
    for (const Vec3& p : positions) mesh.positions.emplace_back(p);
    mesh.triangles = std::move(triangles);
    return body(std::move(mesh));
}

} // namespace penumbra::test
