// The prepare steps of techniques that start from the casters' triangles. Each fills a state that has its light and technique.
#pragma once

#include <memory>

#include <penumbra/engine.hpp>

#include "opencl/work.hpp"

namespace penumbra {

// soft_shadow_volume: from the objects that cast; without any, from the surfaces that `given` shows.
std::shared_ptr<Prepared::State> prepare_wedges(std::shared_ptr<Prepared::State> state, const Occluders& given, const Geometry& geometry,
                                                const SoftShadowVolume& settings);

// occlusion_texture: from the objects that cast; without any, from the surfaces that `given` shows, and the solid between front and back.
std::shared_ptr<Prepared::State> prepare_slices(std::shared_ptr<Prepared::State> state, const Occluders& given, const Geometry& geometry,
                                                const OcclusionTexture& settings);

// smoothie: from the light's view of what casts (front), and silhouettes of the objects that cast, or of that view.
std::shared_ptr<Prepared::State> prepare_smoothies(std::shared_ptr<Prepared::State> state, const Occluders& occluders,
                                                   const Geometry& geometry, const Smoothie& settings);

// Whether there are objects that cast. Throws invalid_input when there are none and no front map either.
bool casts_or_shown(const Geometry& geometry, const Occluders& given, const char* technique);

// Ends the work and notes in the state what it took.
void finish_prepare(opencl::Work& work, Prepared::State& state);

} // namespace penumbra
