// Which depth images a technique needs, and rendering those that a scene lacks from its objects.
#pragma once

#include <penumbra/engine.hpp>

#include "scene/camera.hpp"
#include "scene/ground.hpp"
#include "technique/verbs.hpp"
#include "trace/tracer.hpp"

namespace penumbra {

// What the light's view of what casts need not hold for these receivers; null: they are not known, and ground stays, as something behind it may be shaded later. Nothing where the technique needs the
// whole view, or traces rays.
LeftOut left_out_of(const Light& light, const std::vector<Object>& objects, const Needs& needs, const Receivers* receivers);

// The light's own view at the occluder map's size. Throws invalid_input when the scene says another camera than the light's.
Camera occluder_camera(const Light& light, const CameraSpec& spec, const std::vector<Object>& objects, int width, int height,
                       const LeftOut& left_out = {});

// The occluders with what `needs` names in place and their camera explicit. Throws invalid_input naming what is missing when there are no
// objects to render it from, and for maps whose sizes do not fit. The same for receivers: with_depth (engine.hpp).
Occluders occluders_with_depth(const Light& light, const Occluders& given, const Geometry& geometry, const Needs& needs, const LeftOut& left_out,
                               const std::shared_ptr<const opencl::LateContext>& device);

// with_depth (engine.hpp) on a device that is open: depth images are fitted there. Null: one of the environment's choice.
Receivers receivers_with_depth(const Receivers& given, const Light& light, const Geometry& geometry,
                               const std::shared_ptr<const opencl::LateContext>& device);

// What a camera sees of the objects of a role: triangles by rays, depth images by walks, which have no layers. `normals` are of triangles, where no image is
// among them. Trailing layers that show nothing are left out.
TracedViews views_of(const Geometry& geometry, bool Object::*role, const Camera& camera, int width, int height, const ViewRequest& request,
                     const std::shared_ptr<const opencl::LateContext>& device, bool with_images = true);

// What is fitted to receivers of somebody else's depth; null for depth that is exact.
std::shared_ptr<const DepthSurface> surface_of(const Receivers& receivers, const Camera& camera,
                                               const std::shared_ptr<const opencl::LateContext>& device);

// Throws too_large for more pixels than any map may have, before memory is taken for them.
void check_pixels(int width, int height, std::string_view where);

// Throws invalid_input unless the map has `width` x `height` depths. `where` is its key.
void check_size(const DepthMap& map, int width, int height, std::string_view where);

// A camera spec that says all of a resolved camera.
CameraSpec explicit_spec(const CameraSpec& spec, const Camera& camera);

} // namespace penumbra
