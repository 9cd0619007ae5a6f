// The scenes on which techniques and rays are compared at equal error.
#pragma once

#include <string>
#include <vector>

#include <penumbra/penumbra.hpp>

namespace penumbra::bench {

struct SuiteScene {
    std::string name;
    Scene scene;
};

// Eleven, each of an occluder over the plane of paper_scene (scenes.hpp); only the last one's receives itself: closed and open, near and far, under lights that are small,
// of the casters' size, and larger than the scene. Both maps have `texels` a side.
std::vector<SuiteScene> suite_scenes(int texels, int receivers);

// The ray-traced mask of one with 512 x 512 receivers, from $PENUMBRA_BENCH_REFERENCES where it was kept by a run before.
Image suite_reference(const Engine& engine, const SuiteScene& scene);

} // namespace penumbra::bench
