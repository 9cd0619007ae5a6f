// The techniques: the one list of them. Each has its settings in a header of its own.
#pragma once

#include <string>
#include <variant>

#include <penumbra/export.hpp>
#include <penumbra/scene.hpp>
#include <penumbra/technique/depth_trace.hpp>
#include <penumbra/technique/occlusion_texture.hpp>
#include <penumbra/technique/ray_traced.hpp>
#include <penumbra/technique/shadow_map.hpp>
#include <penumbra/technique/smoothie.hpp>
#include <penumbra/technique/soft_shadow_map.hpp>
#include <penumbra/technique/soft_shadow_volume.hpp>

namespace penumbra {

using Technique = std::variant<ShadowMap, SoftShadowMap, SoftShadowVolume, OcclusionTexture, Smoothie, RayTraced, DepthTrace>;

// The typed settings of a request, and back. Throws invalid_input for an unknown kind or key (naming the known ones), a value of the
// wrong type or out of range.
PENUMBRA_API Technique technique_from(const TechniqueRequest& request);
PENUMBRA_API TechniqueRequest request_from(const Technique& technique); // every key, with its value
PENUMBRA_API std::string kind_of(const Technique& technique);

} // namespace penumbra
