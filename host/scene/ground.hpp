// Ground: flat objects that cast on nothing, because all there is lies on the light's side of them. A light's view need not hold them.
#pragma once

#include <cstddef>
#include <vector>

#include <penumbra/scene.hpp>

#include "scene/light_space.hpp"

namespace penumbra {

// Points where normal . p >= offset are on the light's side.
struct Ground {
    std::size_t object; // its place in the list
    Vec3 normal;
    double offset;
};

// The objects that lie in one plane with the whole light and every other object on one side of it (to a hundred-thousandth).
std::vector<Ground> grounds_of(const LightFrame& light, const std::vector<Object>& objects);

// Whether a depth image shows something on the far side of a ground, which could then cast on it: more than 2 in 1000 of its points lie behind by
// 3 % of their depth, or any by 10 %. Nearer than that they may be the ground itself, as a noisy image shows it.
bool shows_behind(const std::vector<Ground>& grounds, const DepthMap& depth, const Camera& camera);

} // namespace penumbra
