// Which depth images a technique needs, and rendering those that a scene lacks from its objects.
#pragma once

#include <memory>

#include <penumbra/engine.hpp>

#include "scene/camera.hpp"
#include "trace/tracer.hpp"

namespace penumbra {

struct DepthNeeds {
    bool front = false, back = false, receivers = true;
};
DepthNeeds needs_of(const Technique& technique);

// The light's own view at the occluder map's size. Throws invalid_input when the scene says another camera than the light's.
Camera occluder_camera(const Light& light, const CameraSpec& spec, const std::vector<Object>& objects, int width, int height);

// A hierarchy of the objects that cast, or of those that receive.
std::shared_ptr<const Tracer> casters_of(const Scene& scene);
std::shared_ptr<const Tracer> receivers_of(const Scene& scene);

// The scene's occluders and receivers with what `needs` names in place and cameras explicit. Throws invalid_input naming what is missing
// when there are no objects to render it from, and for maps whose sizes do not fit.
Occluders occluders_with_depth(const Scene& scene, const DepthNeeds& needs);
Receivers receivers_with_depth(const Scene& scene);

// Throws too_large for more pixels than any map may have, before memory is taken for them.
void check_pixels(int width, int height, std::string_view where);

// Throws invalid_input unless the map has `width` x `height` depths. `where` is its key.
void check_size(const DepthMap& map, int width, int height, std::string_view where);

// A camera spec that says all of a resolved camera.
CameraSpec explicit_spec(const CameraSpec& spec, const Camera& camera);

} // namespace penumbra
