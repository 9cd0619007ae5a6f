// Ground: planes of triangles that cast on nothing, because all there is lies on the light's side of them. A light's view need not hold them.
#pragma once

#include <array>
#include <vector>

#include <penumbra/scene.hpp>

#include "scene/light_space.hpp"

namespace penumbra {

// Points where normal . p >= offset are on the light's side.
struct Ground {
    Vec3 normal;
    double offset;
    Imath::Box3d box = {}; // of the triangles that lie in it; empty: all of the plane
};

// The planes with the whole light and every object on one side of them (to a hundred-thousandth), among those in which a mesh has most of its area.
std::vector<Ground> grounds_of(const LightFrame& light, const std::vector<Object>& objects);

// Whether the triangle, or every triangle of the mesh, lies in one of the grounds.
bool in_ground(const std::vector<Ground>& grounds, const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle);
bool in_ground(const std::vector<Ground>& grounds, const TriangleMesh& mesh);

// Whether a depth image shows something on the far side of a ground that it casts on: more than 2 in 1000 of its points lie behind by .4 % of their
// depth and four times the noise that the image says it has, or of exact depth any by .01 %, and on the way from there to the light is the ground's box,
// widened by the light. Nearer than that they may be the ground itself.
bool shows_behind(const std::vector<Ground>& grounds, const LightFrame& light, const DepthMap& depth, const Camera& camera);

} // namespace penumbra
