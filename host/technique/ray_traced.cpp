#include "technique/ray_traced.hpp"

#include "technique/keys.hpp"
#include "technique/rows.hpp"

namespace penumbra {

TechniqueRow ray_traced_row()
{
    using S = RayTraced;
    return {.kind = "ray_traced",
            .summary = "Stratified shadow rays through the scene's objects: the reference; runs on the host's cores (Embree).",
            .source = "Embree 3; stratified area sampling",
            .keys = {integer_key<S>("samples", &S::samples, {1, 65536}, "rays", "shadow rays a receiver"),
                     flag_key<S>("adaptive", &S::adaptive,
                                 "first_samples rays everywhere, the rest only near receivers whose visibility is not settled"),
                     integer_key<S>("first_samples", &S::first_samples, {1, 65536}, "rays", "rays of the first pass with adaptive"),
                     integer_key<S>("seed", &S::seed, {0, INT64_MAX}, "", "same seed, same bits")},
            .lights = {"rectangle", "sphere", "point", "directional"},
            .textured_lights = true,
            .inputs = "objects that cast; receiver depth (or objects that receive)",
            .defaults = RayTraced{}};
}

VisibilityResult shade_rays(const PreparedRays& prepared, const DepthMap& receivers, const Camera& camera)
{
    return trace_visibility(*prepared.casters, prepared.light, receivers, camera,
                            {.samples = prepared.settings.samples,
                             .adaptive = prepared.settings.adaptive,
                             .first_samples = prepared.settings.first_samples,
                             .seed = static_cast<std::uint64_t>(prepared.settings.seed)});
}

} // namespace penumbra
