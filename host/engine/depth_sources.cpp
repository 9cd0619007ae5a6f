#include "engine/depth_sources.hpp"

#include <algorithm>
#include <cmath>

#include <penumbra/error.hpp>

#include "depth_image/views.hpp"
#include "engine/geometry.hpp"
#include "scene/fine_depth.hpp"
#include "scene/light_space.hpp"
#include "scene/lights.hpp"
#include "technique/occluder_maps.hpp"
#include "technique/techniques.hpp"

namespace penumbra {
namespace {

[[noreturn]] void missing(const char* key, const char* role, const std::string& hint = {})
{
    throw Error::at(ErrorCode::invalid_input, std::string(key), std::string("is missing and there are no objects that ") + role + " to render it from",
                    "expected a depth image or objects" + hint);
}

// How far a camera's place may be from the light's centre and still count as there: float32 rounding of either, with room for a chain of a
// few operations. A shift by that much moves a back-projection by as much, far below a texel.
double place_tolerance(const LightFrame& light, const Vec3& origin)
{
    const Vec3& a = light.origin;
    const double size = std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z), std::abs(origin.x), std::abs(origin.y), std::abs(origin.z),
                                  light.half_u, light.half_v});
    return 0x1p-18 * size;
}

} // namespace

LeftOut left_out_of(const Light& light, const std::vector<Object>& objects, const Needs& needs, const Receivers* receivers)
{
    LeftOut result;
    if (needs.whole_view || (needs.depth_images && !needs.front)) return result;
    result.receivers = true;
    if (!receivers) return result;
    const LightFrame frame = light_frame(light);
    std::vector<Ground> grounds = grounds_of(frame, objects);
    // Receivers that are rendered from the objects lie before ground, as those do.
    if (receivers->depth && !grounds.empty()) {
        const Camera camera = resolve_camera(receivers->camera, light, objects, receivers->width, receivers->height, "receivers.camera");
        if (shows_behind(grounds, frame, *receivers->depth, camera)) return result;
    }
    result.grounds = std::move(grounds);
    return result;
}

Camera occluder_camera(const Light& light, const CameraSpec& spec, const std::vector<Object>& objects, int width, int height,
                       const LeftOut& left_out)
{
    const LightFrame frame = light_frame(light);
    Camera camera = resolve_camera(spec, light, objects, width, height, "occluders.camera", left_out);
    if (std::holds_alternative<LightCamera>(spec)) return camera;

    // A pinhole will do if it is the light's own view: same place, same axes to within a ten-thousandth.
    const double turned =
        std::max({(camera.frame.x - frame.u).length(), (camera.frame.y - frame.v).length(), (camera.frame.z + frame.direction).length()});
    if (frame.directional || (camera.frame.origin - frame.origin).length() > place_tolerance(frame, camera.frame.origin) || turned > 1e-4)
        throw Error::at(
            ErrorCode::invalid_input, "occluders.camera", "is not the light's own view",
            "expected kind \"light\", or a pinhole at the light's centre along its axes; depth from another camera can be given in "
            "objects");
    // Within the same ten-thousandth of the image: a principal point in a few digits.
    const Vec2 off(std::abs(camera.off_axis.x) / camera.half_extent.x, std::abs(camera.off_axis.y) / camera.half_extent.y);
    if (std::max(off.x, off.y) > 1e-4)
        throw Error::at(ErrorCode::invalid_input, "occluders.camera", "has its axis beside the image's middle",
                        "expected the light's own view, without shift and with cx and cy in the middle; depth from another camera can be given in objects");
    return light_camera(frame, camera.half_extent, frame.origin);
}

CameraSpec explicit_spec(const CameraSpec& spec, const Camera& camera)
{
    if (std::holds_alternative<PinholeCamera>(spec)) return PinholeCamera{.frame = camera.frame, .tan_half_fov = camera.half_extent, .shift = camera.off_axis / camera.half_extent / 2.};
    if (camera.orthographic) return LightCamera{.tan_half_fov = {}, .half_extent = camera.half_extent, .center = camera.frame.origin};
    return LightCamera{.tan_half_fov = camera.half_extent, .half_extent = {}, .center = {}};
}

void check_pixels(int width, int height, std::string_view where)
{
    // As for images that are read. Kernels count pixels in an int: rows padded to a multiple of 16 and columns to the tile's rows stay
    // below 2^31.
    constexpr std::int64_t limit = std::int64_t{1} << 30;
    if (width > 65536 || height > 65536 || std::int64_t{width} * height > limit)
        throw Error::at(ErrorCode::too_large, std::string(where), "is " + std::to_string(width) + " x " + std::to_string(height),
                        "expected at most 65536 each way and " + std::to_string(limit) + " pixels");
}

void check_size(const DepthMap& map, int width, int height, std::string_view where)
{
    check_pixels(width, height, where);
    const std::size_t count = static_cast<std::size_t>(std::max(width, 0)) * static_cast<std::size_t>(std::max(height, 0));
    if (width < 1 || height < 1 || map.width != width || map.height != height || map.depth.size() != count)
        throw Error::at(ErrorCode::invalid_input, std::string(where),
                        "is " + std::to_string(map.width) + " x " + std::to_string(map.height) + " with " +
                            std::to_string(map.depth.size()) + " depths",
                        "expected " + std::to_string(width) + " x " + std::to_string(height));
}

namespace {

bool shows_nothing(const DepthMap& map)
{
    const auto nothing = [](float z) { return !std::isfinite(z); };
    return std::ranges::all_of(map.depth, nothing) && (!map.fine || std::ranges::all_of(map.fine->depth, nothing));
}

DepthMap empty_view(int width, int height)
{
    return {.width = width, .height = height, .depth = std::vector<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), nothing_there)};
}

} // namespace

TracedViews views_of(const Geometry& geometry, bool Object::*role, const Camera& camera, int width, int height, const ViewRequest& request,
                     const std::shared_ptr<const opencl::LateContext>& device, bool with_images)
{
    const Geometry::State& state = geometry.state();
    TracedViews views{.front = empty_view(width, height), .back = empty_view(width, height), .layers = {}, .normals = {}};
    const bool images_too = with_images && state.any_seen(role);
    if (state.any_mesh(role)) {
        const auto tracer = role == &Object::casts ? state.casters() : state.receivers();
        ViewRequest of_meshes = request;
        of_meshes.normals = request.normals && !images_too;
        if (images_too) of_meshes.fine = 0; // images have no more than their pixels
        TracedViews traced = tracer->views(camera, width, height, of_meshes);
        if (request.front) views.front = std::move(traced.front);
        if (request.back) views.back = std::move(traced.back);
        views.layers = std::move(traced.layers);
        views.normals = std::move(traced.normals);
        while (!views.layers.empty() && shows_nothing(views.layers.back())) views.layers.pop_back();
    }
    if (!images_too) return views;
    opencl::Work work(device ? device : std::make_shared<const opencl::LateContext>(""));
    for (const auto& image : state.images(role, device)) add_view(work, *image, camera, views.front, views.back);
    return views;
}

Occluders occluders_with_depth(const Light& light, const Occluders& given, const Geometry& geometry, const Needs& needs, const LeftOut& left_out,
                               const std::shared_ptr<const opencl::LateContext>& device)
{
    Occluders occluders = given;
    if (!needs.front && !needs.back) return occluders;
    check_pixels(occluders.width, occluders.height, "occluders.resolution");

    const bool casters = geometry.state().any(&Object::casts);
    const bool render_front = needs.front && !occluders.front, render_back = needs.back && !occluders.back;
    if (render_front && !casters) missing("occluders.depth.front", "cast");
    if (render_back && !casters) missing("occluders.depth.back", "cast", "; or set \"sides\": \"front\"");
    const Camera camera = occluder_camera(light, occluders.camera, geometry.objects(), occluders.width, occluders.height, left_out);
    // Depth images among what casts have a front and a back alone.
    const bool render_layers = needs.layers > 0 && occluders.layers.empty() && casters && !geometry.state().any_seen(&Object::casts);
    if (render_front || render_back || render_layers) {
        const bool all_rendered = render_front == needs.front && render_back == needs.back && render_layers == (needs.layers > 0);
        const double texels = static_cast<double>(occluders.width) * occluders.height * (render_front + render_back + (render_layers ? needs.layers : 0));
        const cl_float2 gap = joining_gap(occluder_view(light_frame(light), camera, {occluders.width, occluders.height}));
        const ViewRequest request{.front = render_front,
                                  .back = render_back,
                                  .layers = render_layers ? needs.layers : 0,
                                  .first_layer = 1,
                                  .fine = all_rendered && texels <= needs.fine_texels ? needs.fine : 0,
                                  .gap = std::min(gap.s[0], gap.s[1])};
        TracedViews views = views_of(geometry, &Object::casts, camera, occluders.width, occluders.height, request, device, !needs.depth_images);
        if (render_front) occluders.front = std::move(views.front);
        if (render_back) occluders.back = std::move(views.back);
        if (render_layers) occluders.layers = std::move(views.layers);
    }
    if (needs.front) check_size(*occluders.front, occluders.width, occluders.height, "occluders.depth.front");
    if (needs.back) check_size(*occluders.back, occluders.width, occluders.height, "occluders.depth.back");
    occluders.camera = explicit_spec(LightCamera{}, camera);
    return occluders;
}

Receivers with_depth(const Receivers& given, const Light& light, const Geometry& geometry)
{
    return receivers_with_depth(given, light, geometry, nullptr);
}

Receivers receivers_with_depth(const Receivers& given, const Light& light, const Geometry& geometry,
                               const std::shared_ptr<const opencl::LateContext>& device)
{
    Receivers receivers = given;
    check_pixels(receivers.width, receivers.height, "receivers.resolution");
    const Camera camera =
        resolve_camera(receivers.camera, light, geometry.objects(), receivers.width, receivers.height, "receivers.camera");
    if (!receivers.depth) {
        if (!geometry.state().any(&Object::receives)) missing("receivers.depth", "receive");
        TracedViews views = views_of(geometry, &Object::receives, camera, receivers.width, receivers.height, {.front = true, .normals = true}, device);
        receivers.depth = std::move(views.front);
        receivers.normals = views.normals.empty() ? nullptr : std::make_shared<const SurfaceNormals>(SurfaceNormals{std::move(views.normals)});
        // What was seen of a depth image is as good as its planes.
        receivers.depth->from_image = geometry.state().any_seen(&Object::receives);
    }
    check_size(*receivers.depth, receivers.width, receivers.height, "receivers.depth");
    receivers.camera = explicit_spec(receivers.camera, camera);
    return receivers;
}

std::shared_ptr<const DepthSurface> surface_of(const Receivers& receivers, const Camera& camera,
                                               const std::shared_ptr<const opencl::LateContext>& device)
{
    if (!receivers.depth || !receivers.depth->from_image) return nullptr;
    if (receivers.surface) return receivers.surface;
    opencl::Work work(device ? device : std::make_shared<const opencl::LateContext>(""));
    return std::make_shared<const DepthSurface>(depth_surface(fit_depth(work, *receivers.depth, camera), camera));
}

Scene with_depth(const Scene& scene, const Technique& technique)
{
    validate_lights(scene);
    const Geometry geometry = view_of(scene);
    const Needs needs = needs_of(technique);
    const auto complete = [&](const Light& light, const Occluders& given) {
        const LeftOut left_out = left_out_of(light, scene.objects, needs, &scene.receivers);
        return occluders_with_depth(light, given, geometry, needs, left_out, nullptr);
    };
    Scene result = scene;
    if (scene.lights.empty()) {
        result.occluders = complete(scene.light, scene.occluders);
        result.receivers = with_depth(scene.receivers, scene.light, geometry);
        return result;
    }
    for (std::size_t i = 0; i < result.lights.size(); ++i) {
        SceneLight& light = result.lights[i];
        const bool own = light.occluders.has_value();
        try {
            light.occluders = complete(light.light, own ? *light.occluders : scene.occluders);
        } catch (const Error& error) {
            throw in_list(error, i, own);
        }
    }
    result.receivers = with_depth(scene.receivers, scene.lights.front().light, geometry);
    return result;
}

} // namespace penumbra
