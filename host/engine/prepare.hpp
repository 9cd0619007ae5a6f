// The prepare steps of techniques that start from the casters' triangles. Each fills a state that has its light and technique.
#pragma once

#include <memory>

#include <penumbra/engine.hpp>

namespace penumbra {

// occlusion_texture: from the objects that cast; without any, from the surfaces that `given` shows, and the solid between front and back.
std::shared_ptr<Prepared::State> prepare_slices(std::shared_ptr<Prepared::State> state, const Occluders& given, const Geometry& geometry,
                                                const OcclusionTexture& settings);

// smoothie: from the light's view of what casts (front), and silhouettes of the objects that cast, or of that view.
std::shared_ptr<Prepared::State> prepare_smoothies(std::shared_ptr<Prepared::State> state, const Occluders& occluders,
                                                   const Geometry& geometry, const Smoothie& settings);

} // namespace penumbra
