// Triangles that an image cuts out, as rays meet them.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <embree3/rtcore.h>

#include <penumbra/scene.hpp>

namespace penumbra {

// One traced triangle's.
struct TracedCut {
    const CutOut* image = nullptr; // null: the triangle is whole
    std::array<Imath::V2f, 3> texture;
};

// Throws invalid_input unless the mesh's cut-outs fit its triangles and images; `mesh_index` is its place among the objects.
void require_cut_outs(const TriangleMesh& mesh, std::size_t mesh_index);

// That of a triangle of the mesh.
TracedCut cut_of(const TriangleMesh& mesh, std::size_t triangle);

// Whether the surface is there at Embree's u and v, which weigh the second corner and the third.
bool is_there(const TracedCut& cut, float u, float v);

// Embree's filter for shadow rays: they go on where a triangle is cut out. The geometry's user data are its std::vector<TracedCut>.
void pass_cut_outs(const RTCFilterFunctionNArguments* arguments);

} // namespace penumbra
