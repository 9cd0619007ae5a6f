#include <algorithm>
#include <cmath>

#include <penumbra/error.hpp>

#include "engine/depth_sources.hpp"
#include "engine/geometry.hpp"
#include "engine/impl.hpp"
#include "engine/prepare.hpp"
#include "engine/state.hpp"
#include "scene/lights.hpp"
#include "technique/table.hpp"

namespace penumbra {
namespace {

std::string joined(const std::vector<std::string_view>& names)
{
    std::string text;
    for (const std::string_view name : names) text += (text.empty() ? "" : ", ") + std::string(name);
    return text;
}

bool has_no_extent(const Light& light)
{
    const LightFrame frame = light_frame(light);
    return frame.half_u == 0 && frame.half_v == 0;
}

void refuse_sequence(const Light& light)
{
    if (const std::size_t frames = frames_of(light); frames > 0)
        throw Error(ErrorCode::usage, "light.emission: is a sequence of " + std::to_string(frames) + " images, expected one",
                    "masks computes them all, only_frame takes one, with_emission goes on to the next");
}

std::shared_ptr<Prepared::State> new_state(const std::shared_ptr<const opencl::Context>& context, const Light& light,
                                           const Technique& technique)
{
    validate(light);
    refuse_sequence(light);
    check_light(light, technique);
    auto state = std::make_shared<Prepared::State>();
    state->context = context;
    state->technique = technique;
    state->light = light;
    if (std::holds_alternative<ShadowMap>(technique) && !has_no_extent(light))
        state->warnings.push_back("shadow_map takes the light as a point at its centre: its extent is ignored");
    return state;
}

constexpr const char* empty_map = "the occluder map is empty: nothing casts shadows";

// Runs the technique's prepare step on depth that is on the device.
void prepare_maps(opencl::Work& work, const OccluderDepth& depth, Prepared::State& state)
{
    work.stage("prepare");
    if (const auto* settings = std::get_if<SoftShadowMap>(&state.technique)) {
        auto prepared = prepare_soft_shadow_map(work, depth, *settings);
        if (prepared.nearest == 0) state.warnings.push_back(empty_map);
        state.data = std::move(prepared);
    } else {
        state.data = prepare_shadow_map(work, depth, std::get<ShadowMap>(state.technique));
    }
    finish_prepare(work, state);
}

bool inside_view(const Projected& p) { return p.depth > 0 && std::abs(p.x_px - 1) <= 1 && std::abs(p.y_px - 1) <= 1; }

// Whether a box lies before the light's plane and inside its view: both are convex, so its corners decide.
bool inside_view(const Imath::Box3d& box, const Camera& view)
{
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 point(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y, corner & 4 ? box.max.z : box.min.z);
        if (!inside_view(project(view, 2, 2, point))) return false;
    }
    return true;
}

// Whether every triangle before the light's plane lies inside the light's view.
bool casters_inside(const std::vector<Object>& objects, const Camera& view)
{
    for (const Object& object : objects) {
        if (!object.casts || inside_view(bounds(object.mesh), view)) continue;
        for (const auto& triangle : object.mesh.triangles) {
            int before = 0, inside = 0;
            for (const std::uint32_t vertex : triangle) {
                const Projected p = project(view, 2, 2, Vec3(object.mesh.positions[vertex]));
                before += p.depth > 0;
                inside += inside_view(p);
            }
            if (before > 0 && inside < 3) return false;
        }
    }
    return true;
}

OccluderDepth uploaded(opencl::Work& work, const Light& light, const Occluders& occluders, const Camera& view, const DepthNeeds& needs,
                       std::vector<opencl::Buffer<float>>& keep)
{
    OccluderDepth depth{.light = light_frame(light),
                        .camera = view,
                        .width = occluders.width,
                        .height = occluders.height,
                        .precision = 0,
                        .front = {},
                        .back = {}};
    const auto upload = [&](const DepthMap& map, const char* what) {
        depth.precision = std::max(depth.precision, map.precision);
        keep.push_back(work.upload(std::span<const float>(map.depth), what));
        return keep.back().memory();
    };
    work.stage("upload occluders");
    if (needs.front) depth.front = upload(*occluders.front, "front occluder depth");
    if (needs.back) depth.back = upload(*occluders.back, "back occluder depth");
    return depth;
}

std::shared_ptr<Prepared::State> prepare_from_maps(const std::shared_ptr<const opencl::Context>& context, const Light& light,
                                                   const Occluders& occluders, const std::vector<Object>& objects,
                                                   const Technique& technique)
{
    auto state = new_state(context, light, technique);
    const DepthNeeds needs = needs_of(technique);
    if (needs.front && !occluders.front)
        throw Error(ErrorCode::invalid_input, "occluders.depth.front: is missing",
                    "expected a depth map; with_depth renders it from objects");
    if (needs.back && !occluders.back)
        throw Error(ErrorCode::invalid_input, "occluders.depth.back: is missing",
                    "expected a depth map, or sides front; with_depth renders it from objects");
    if (needs.front) check_size(*occluders.front, occluders.width, occluders.height, "occluders.depth.front");
    if (needs.back) check_size(*occluders.back, occluders.width, occluders.height, "occluders.depth.back");
    state->light_view = occluder_camera(light, occluders.camera, objects, occluders.width, occluders.height);

    const auto there = [](float depth) { return depth > 0 && std::isfinite(depth); };
    if (std::holds_alternative<ShadowMap>(technique) && std::none_of(occluders.front->depth.begin(), occluders.front->depth.end(), there))
        state->warnings.push_back(empty_map);

    opencl::Work work(context);
    std::vector<opencl::Buffer<float>> maps;
    const OccluderDepth depth = uploaded(work, light, occluders, state->light_view, needs, maps);
    prepare_maps(work, depth, *state);
    return state;
}

std::shared_ptr<Prepared::State> prepare_from_objects(std::shared_ptr<Prepared::State> state, const Geometry& geometry,
                                                      const RayTraced& settings)
{
    if (!geometry.state().any(&Object::casts))
        throw Error(ErrorCode::invalid_input, "objects: ray_traced needs objects that cast, and there are none",
                    "expected meshes, quads, or a camera's depth as an object");
    const Stopwatch watch;
    PreparedRays rays{.settings = settings, .light = state->light, .casters = geometry.state().casters()};
    state->prepare_ms = watch.ms();
    state->stages.push_back({"prepare", state->prepare_ms, 0, rays.casters->bytes()});
    if (rays.casters->degenerate_count() > 0)
        state->warnings.push_back(std::to_string(rays.casters->degenerate_count()) + " triangles without area were left out");
    state->data = std::move(rays);
    return state;
}

} // namespace

void check_light(const Light& light, const Technique& technique)
{
    const TechniqueRow& row = row_of(kind_of(technique));
    const std::string kind = kind_of(light);
    const auto takes = [&](std::string_view name) { return std::find(row.lights.begin(), row.lights.end(), name) != row.lights.end(); };
    if (!takes(kind) && !(has_no_extent(light) && takes("point"))) {
        std::string hint = "it takes " + joined(row.lights);
        if (kind == "sphere") hint += "; a rectangle of the same area has half-edges of 0.886 times the radius";
        throw Error(ErrorCode::unsupported, "light.kind: " + std::string(row.kind) + " cannot take a " + kind + " light", hint);
    }
    const auto* rectangle = std::get_if<RectangleLight>(&light);
    if (rectangle && (rectangle->emission || !rectangle->frames.empty()) && !row.textured_lights)
        throw Error(ErrorCode::unsupported, "light.emission: " + std::string(row.kind) + " cannot take a textured light", "ray_traced can");
}

double work_ms(const std::vector<Stage>& stages)
{
    double sum = 0;
    for (const Stage& stage : stages)
        if (stage.name != "compile" && stage.name != "render depth") sum += stage.ms;
    return sum;
}

void add_stages(std::vector<Stage>& all, const std::vector<Stage>& more)
{
    for (const Stage& stage : more) {
        const auto same = std::find_if(all.begin(), all.end(), [&](const Stage& s) { return s.name == stage.name; });
        if (same == all.end()) {
            all.push_back(stage);
            continue;
        }
        same->ms += stage.ms;
        same->device_ms += stage.device_ms;
        same->bytes += stage.bytes;
    }
}

void finish_prepare(opencl::Work& work, Prepared::State& state)
{
    add_stages(state.stages, work.finish());
    state.prepare_ms = work_ms(state.stages);
    state.peak_bytes = work.memory().peak;
    state.memory = work.memory_ptr();
}

bool casts_or_shown(const Geometry& geometry, const Occluders& given, const char* technique)
{
    const bool objects = geometry.state().any(&Object::casts);
    if (!objects && !given.front)
        throw Error(ErrorCode::invalid_input,
                    std::string("objects: ") + technique + " needs objects that cast or occluders.depth.front, and there are neither",
                    "expected meshes, quads, a camera's depth as an object, or the light's view in occluders.depth.front");
    return objects;
}

Prepared Engine::prepare(const Light& light, const Occluders& occluders, const Technique& technique) const
{
    if (std::holds_alternative<RayTraced>(technique)) throw Error(ErrorCode::usage, "ray_traced needs objects", "prepare it from a scene");
    if (std::holds_alternative<SoftShadowVolume>(technique) || std::holds_alternative<OcclusionTexture>(technique) ||
        std::holds_alternative<Smoothie>(technique))
        return prepare(light, occluders, Geometry(std::vector<Object>{}), technique);
    return Prepared(prepare_from_maps(impl_->context, light, occluders, {}, technique));
}

Prepared Engine::prepare(const Scene& scene, const Technique& technique) const
{
    if (!scene.lights.empty())
        throw Error(ErrorCode::usage, "lights: are " + std::to_string(scene.lights.size()) + ", and one can be prepared",
                    "masks computes them all, only_light takes one");
    return prepare(scene.light, scene.occluders, view_of(scene), technique);
}

Prepared Engine::prepare(const Light& light, const Occluders& given, const Geometry& geometry, const Technique& technique) const
{
    if (const auto* settings = std::get_if<RayTraced>(&technique))
        return Prepared(prepare_from_objects(new_state(impl_->context, light, technique), geometry, *settings));

    if (const auto* settings = std::get_if<SoftShadowVolume>(&technique))
        return Prepared(prepare_wedges(new_state(impl_->context, light, technique), given, geometry, *settings));

    if (const auto* settings = std::get_if<OcclusionTexture>(&technique))
        return Prepared(prepare_slices(new_state(impl_->context, light, technique), given, geometry, *settings));

    validate(light);
    check_light(light, technique);
    refuse_sequence(light);
    const Stopwatch watch;
    const Occluders occluders = occluders_with_depth(light, given, geometry, needs_of(technique));
    const Stage render{"render depth", watch.ms(), 0, 0};
    const auto* smoothie = std::get_if<Smoothie>(&technique);
    auto state = smoothie ? prepare_smoothies(new_state(impl_->context, light, technique), occluders, geometry, *smoothie)
                          : prepare_from_maps(impl_->context, light, occluders, geometry.objects(), technique);
    state->stages.insert(state->stages.begin(), render);
    if (smoothie) return Prepared(state);
    state->covered = !geometry.objects().empty() && casters_inside(geometry.objects(), state->light_view);
    const auto* soft = std::get_if<SoftShadowMap>(&technique);
    if (soft && soft->project && geometry.state().any(&Object::receives)) state->receiver_tracer = geometry.state().receivers();
    return Prepared(state);
}

Prepared Engine::with_emission(const Prepared& prepared, const Image& emission) const
{
    const Prepared::State& before = prepared.state();
    auto* rectangle = std::get_if<RectangleLight>(&before.light);
    if (!rectangle) throw Error(ErrorCode::usage, "light.emission: was prepared for a " + kind_of(before.light), "expected a rectangle");
    auto state =
        new_state(before.context, RectangleLight{rectangle->center, rectangle->half_u, rectangle->half_v, emission}, before.technique);
    state->light_view = before.light_view;
    state->covered = before.covered;
    state->warnings = before.warnings;
    if (const auto* rays = std::get_if<PreparedRays>(&before.data)) {
        state->data = PreparedRays{.settings = rays->settings, .light = state->light, .casters = rays->casters};
        return Prepared(state);
    }
    opencl::Work work(state->context);
    work.stage("prepare");
    state->data = with_emission_of(work, std::get<PreparedSoftShadowVolume>(before.data), state->light);
    finish_prepare(work, *state);
    state->shared = before.shared ? before.shared : before.memory;
    return Prepared(state);
}

Prepared Engine::prepare(const Light& light, const DeviceOccluders& occluders, const Technique& technique) const
{
    if (std::holds_alternative<RayTraced>(technique)) throw Error(ErrorCode::usage, "ray_traced needs objects", "prepare it from a scene");
    if (std::holds_alternative<Smoothie>(technique))
        throw Error(ErrorCode::unsupported, "smoothie finds silhouettes on the host and cannot prepare from device buffers",
                    "prepare it from objects, or from depth maps in memory");
    if (std::holds_alternative<OcclusionTexture>(technique))
        throw Error(ErrorCode::unsupported,
                    "occlusion_texture makes surfaces of depth maps on the host and cannot prepare from device buffers",
                    "prepare it from objects, or from depth maps in memory");
    if (std::holds_alternative<SoftShadowVolume>(technique))
        throw Error(ErrorCode::unsupported, "soft_shadow_volume finds silhouettes on the host and cannot prepare from device buffers",
                    "prepare it from objects, or from depth maps in memory");
    auto state = new_state(impl_->context, light, technique);
    const DepthNeeds needs = needs_of(technique);
    if (needs.front) check_device_buffer(occluders.front, occluders.width, occluders.height, "occluders.front");
    if (needs.back) check_device_buffer(occluders.back, occluders.width, occluders.height, "occluders.back");
    state->light_view = occluder_camera(light, occluders.camera, {}, occluders.width, occluders.height);

    opencl::Work work(impl_->context);
    OccluderDepth depth{.light = light_frame(light),
                        .camera = state->light_view,
                        .width = occluders.width,
                        .height = occluders.height,
                        .precision = 0x1p-24,
                        .front = {},
                        .back = {}};
    if (needs.front) depth.front = cl::Buffer(occluders.front, true);
    if (needs.back) depth.back = cl::Buffer(occluders.back, true);
    prepare_maps(work, depth, *state);
    return Prepared(state);
}

} // namespace penumbra
