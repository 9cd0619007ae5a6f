// The prepare steps of techniques that start from the casters' triangles. Each fills a state that has its light and technique.
#pragma once

#include <memory>

#include <penumbra/engine.hpp>

namespace penumbra {

// occlusion_texture: from the objects that cast; without any, from the surfaces that `given` shows, and the solid between front and back.
std::shared_ptr<Prepared::State> prepare_slices(std::shared_ptr<Prepared::State> state, const Occluders& given, const Geometry& geometry,
                                                const OcclusionTexture& settings);

} // namespace penumbra
