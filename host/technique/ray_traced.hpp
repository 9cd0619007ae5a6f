// Shadow rays through the scene's objects: the reference, on the host's cores.
#pragma once

#include <memory>

#include <penumbra/technique.hpp>

#include "trace/tracer.hpp"

namespace penumbra {

struct PreparedRays {
    RayTraced settings;
    Light light;
    std::shared_ptr<const Tracer> casters;
};

VisibilityResult shade_rays(const PreparedRays& prepared, const DepthMap& receivers, const Camera& camera);

} // namespace penumbra
