#include <algorithm>
#include <cmath>
#include <deque>

#include <penumbra/error.hpp>

#include "depth_image/quality.hpp"
#include "engine/depth_sources.hpp"
#include "engine/geometry.hpp"
#include "engine/impl.hpp"
#include "engine/state.hpp"
#include "scene/joined.hpp"
#include "scene/lights.hpp"
#include "technique/techniques.hpp"

namespace penumbra {
namespace {

bool has_no_extent(const Light& light)
{
    const LightFrame frame = light_frame(light);
    return frame.half_u == 0 && frame.half_v == 0;
}

void refuse_sequence(const Light& light)
{
    if (const std::size_t frames = frames_of(light); frames > 0)
        throw Error::at(ErrorCode::usage, "light.emission", "is a sequence of " + std::to_string(frames) + " images, expected one",
                        "masks computes them all, only_frame takes one, with_emission goes on to the next");
}

std::shared_ptr<Prepared::State> new_state(const std::shared_ptr<const opencl::LateContext>& device, const Light& light,
                                           const Technique& technique)
{
    validate(light);
    refuse_sequence(light);
    check_light(light, technique);
    auto state = std::make_shared<Prepared::State>();
    state->device = device;
    state->technique = technique;
    state->light = light;
    return state;
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

// Whether every triangle before the light's plane lies inside the light's view, but for ground that is left out.
bool casters_inside(const std::vector<Object>& objects, const Camera& view, const LeftOut& left_out)
{
    for (const Object& object : objects) {
        if (!object.casts) continue;
        if (object.seen) return false; // its pixels are many, and counting receivers costs nothing
        if (inside_view(bounds(object.mesh), view)) continue;
        for (const auto& triangle : object.mesh.triangles) {
            int before = 0, inside = 0;
            for (const std::uint32_t vertex : triangle) {
                const Projected p = project(view, 2, 2, Vec3(object.mesh.positions[vertex]));
                before += p.depth > 0;
                inside += inside_view(p);
            }
            if (before > 0 && inside < 3 && !in_ground(left_out.grounds, object.mesh, triangle)) return false;
        }
    }
    return true;
}

// Whether a receiver may lie on what casts. Depth that objects were rendered to is theirs; other depth shows whatever there is.
bool receivers_may_cast(const std::vector<Object>& objects, const Receivers* receivers)
{
    const bool any = std::any_of(objects.begin(), objects.end(), [](const Object& object) { return object.receives; });
    if (!receivers || !any || (receivers->depth && receivers->depth->from_image)) return true;
    return std::any_of(objects.begin(), objects.end(), [](const Object& object) { return object.casts && object.receives; });
}

// Throws invalid_input when the technique wants objects that cast, or a map in their place, and the scene has none.
void check_casters(const Needs& needs, bool casters, const Occluders& given, const std::string& technique)
{
    if (casters || needs.casters == Needs::Casters::unused) return;
    if (needs.casters == Needs::Casters::required)
        throw Error::at(ErrorCode::invalid_input, "objects", technique + " needs objects that cast, and there are none",
                        "expected meshes, quads, or a camera's depth as an object");
    if (!given.front)
        throw Error::at(ErrorCode::invalid_input, "objects",
                        technique + " needs objects that cast or occluders.depth.front, and there are neither",
                        "expected meshes, quads, a camera's depth as an object, or the light's view in occluders.depth.front");
}

// The maps that prepare is handed: those that it needs, or all that there are where they stand for the objects.
LightDepth depth_of(const Light& light, const Occluders& occluders, const std::vector<Object>& objects, const Needs& needs, const LeftOut& left_out,
                    bool all)
{
    const auto taken = [&](const std::optional<DepthMap>& map, bool wanted, const char* where) -> const DepthMap* {
        if (!map || !wanted) return nullptr;
        check_size(*map, occluders.width, occluders.height, where);
        return &*map;
    };
    LightDepth depth{.camera = {},
                     .width = occluders.width,
                     .height = occluders.height,
                     .front = taken(occluders.front, all || needs.front, "occluders.depth.front"),
                     .back = taken(occluders.back, all || needs.back, "occluders.depth.back"),
                     .layers = {},
                     .device_front = {},
                     .device_back = {}};
    if (all) depth.layers = occluders.layers;
    if (!all) depth.layers = std::span(occluders.layers).first(std::min(occluders.layers.size(), static_cast<std::size_t>(std::max(needs.layers, 0))));
    for (std::size_t i = 0; i < depth.layers.size(); ++i)
        check_size(depth.layers[i], depth.width, depth.height, "occluders.depth.layers[" + std::to_string(i) + "]");
    depth.camera = occluder_camera(light, occluders.camera, objects, occluders.width, occluders.height, left_out);
    return depth;
}

// The meshes that cast, without ground as long as there is anything else.
class CastingMeshes {
public:
    CastingMeshes(const Geometry& geometry, const LeftOut& left_out)
    {
        std::vector<const TriangleMesh*> all;
        for (const Object& object : geometry.objects()) {
            if (!object.casts || object.seen) continue;
            all.push_back(&object.mesh);
            if (const TriangleMesh* mesh = without(left_out.grounds, object.mesh)) meshes_.push_back(mesh);
        }
        if (meshes_.empty()) meshes_ = std::move(all);
    }
    const std::vector<const TriangleMesh*>& meshes() const { return meshes_; }

private:
    // The mesh, or what is left of it; null where all of it is ground.
    const TriangleMesh* without(const std::vector<Ground>& grounds, const TriangleMesh& mesh)
    {
        if (grounds.empty()) return &mesh;
        std::vector<std::size_t> left;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            if (!in_ground(grounds, mesh, mesh.triangles[t])) left.push_back(t);
        if (left.size() == mesh.triangles.size()) return &mesh;
        if (left.empty()) return nullptr;
        parts_.push_back({mesh.positions, chosen(mesh.triangles, left), cut_outs_of(mesh, left)});
        return &parts_.back();
    }
    template <class T> static std::vector<T> chosen(const std::vector<T>& all, const std::vector<std::size_t>& places)
    {
        std::vector<T> result;
        result.reserve(places.size());
        for (const std::size_t place : places) result.push_back(all[place]);
        return result;
    }
    static std::shared_ptr<const CutOuts> cut_outs_of(const TriangleMesh& mesh, const std::vector<std::size_t>& left)
    {
        if (!mesh.cut_outs) return nullptr;
        const CutOuts& all = *mesh.cut_outs;
        return std::make_shared<const CutOuts>(CutOuts{all.images, chosen(all.image, left), chosen(all.texture, left)});
    }

    std::deque<TriangleMesh> parts_;
    std::vector<const TriangleMesh*> meshes_;
};

// Ends the work and notes in the state what it took.
void finish_prepare(opencl::Work& work, Prepared::State& state)
{
    add_stages(state.stages, work.finish());
    state.prepare_ms = work_ms(state.stages);
    state.peak_bytes = work.memory().peak;
    state.memory = work.memory_ptr();
}

// Runs the technique's own step and keeps what it made and said.
void prepare_technique(Prepared::State& state, const Casting& casting)
{
    opencl::Work work(state.device);
    Findings findings;
    state.data =
        std::visit([&](const auto& settings) -> PreparedTechnique { return prepare(work, casting, settings, findings); }, state.technique);
    state.light_view = findings.view;
    state.channels = findings.channels;
    state.warnings.insert(state.warnings.end(), findings.warnings.begin(), findings.warnings.end());
    state.notes = std::move(findings.notes);
    finish_prepare(work, state);
}

constexpr int field_side = 256; // texels of the view that is rendered for techniques which need none

// What casts, from the maps that the technique has or from the light's view of the objects. Where the light can have no such view, all receivers are
// shaded.
void add_field(Prepared::State& state, const Casting& casting, const Geometry& geometry, const LeftOut& left_out)
{
    std::vector<const DepthMap*> maps;
    for (const DepthMap* map : {casting.depth.front, casting.depth.back})
        if (map) maps.push_back(map);
    for (const DepthMap& layer : casting.depth.layers) maps.push_back(&layer);
    const LightFrame frame = light_frame(state.light);
    if (!maps.empty()) {
        const Stopwatch watch;
        state.proves_lit = needs_of(state.technique).maps_tell_all;
        state.field = std::make_shared<const OccluderField>(frame, casting.depth.camera, maps, state.proves_lit ? 0 : 1);
        add_stages(state.stages, {{"prepare", watch.ms(), 0, 0}});
        state.prepare_ms = work_ms(state.stages);
        return;
    }
    if (!geometry.state().any(&Object::casts)) return;
    const Stopwatch watch;
    try {
        const Camera camera = occluder_camera(state.light, LightCamera{}, geometry.objects(), field_side, field_side, left_out);
        const TracedViews views = views_of(geometry, &Object::casts, camera, field_side, field_side, {.front = true, .back = true}, state.device);
        const std::array<const DepthMap*, 2> both{&views.front, &views.back};
        state.field = std::make_shared<const OccluderField>(frame, camera, both, 1);
    } catch (const Error& error) {
        if (error.code() != ErrorCode::invalid_input) throw;
    }
    state.stages.push_back({"render depth", watch.ms(), 0, 0});
}

// What was found in the depth images that cast.
void say_quality(Prepared::State& state, const Geometry& geometry)
{
    for (const auto& [index, quality] : geometry.state().qualities(&Object::casts)) {
        const std::string where = "objects[" + std::to_string(index) + "].depth";
        state.notes.push_back(quality_note(quality, where));
        const std::vector<std::string> warnings = quality_warnings(quality, where);
        state.warnings.insert(state.warnings.end(), warnings.begin(), warnings.end());
    }
}

// What traces meshes or sees their depth goes through what is cut out of them; what works on their edges or slices does not.
void warn_of_cut_outs(Prepared::State& state, const Needs& needs, const Casting& casting, const Geometry& geometry)
{
    if (needs.casters == Needs::Casters::unused || needs.depth_images || casting.meshes.empty()) return;
    for (const Object& object : geometry.objects())
        if (object.casts && object.mesh.cut_outs)
            state.warnings.push_back(object.name + " has materials that cut it out, which " + std::string(kind_of(state.technique)) +
                                     " takes as whole: ray_traced and techniques of depth maps do not");
}

PreparedTechnique under_other_emission(opencl::Work& work, const PreparedTechnique& before, const Light& light)
{
    const auto call = [&](const auto& prepared) -> PreparedTechnique {
        if constexpr (requires { with_emission(work, prepared, light); })
            return with_emission(work, prepared, light);
        else
            throw Error(ErrorCode::internal, "a technique takes textured lights and has no with_emission");
    };
    return std::visit(call, before);
}

std::string takers_of_textures()
{
    std::vector<std::string> kinds;
    for (const TechniqueRow& row : technique_table())
        if (row.textured_lights) kinds.emplace_back(row.kind);
    return joined(kinds);
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
        throw Error::at(ErrorCode::unsupported, "light.kind", std::string(row.kind) + " cannot take a " + kind + " light", hint);
    }
    const auto* rectangle = std::get_if<RectangleLight>(&light);
    if (rectangle && (rectangle->emission || !rectangle->frames.empty()) && !row.textured_lights)
        throw Error::at(ErrorCode::unsupported, "light.emission", std::string(row.kind) + " cannot take a textured light", "expected one of " + takers_of_textures());
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

Prepared Engine::prepare(const Light& light, const Occluders& occluders, const Technique& technique) const
{
    if (needs_of(technique).casters == Needs::Casters::required)
        throw Error(ErrorCode::usage, kind_of(technique) + " needs objects", "prepare it from a scene");
    return prepare(light, occluders, Geometry(std::vector<Object>{}), technique);
}

Prepared Engine::prepare(const Scene& scene, const Technique& technique) const
{
    if (!scene.lights.empty())
        throw Error::at(ErrorCode::usage, "lights", "are " + std::to_string(scene.lights.size()) + ", and one can be prepared",
                        "masks computes them all, only_light takes one");
    return prepare(scene.light, scene.occluders, view_of(scene), technique, &scene.receivers);
}

Prepared Engine::prepare(const Light& light, const Occluders& occluders, const Geometry& geometry, const Technique& technique,
                         const Receivers* receivers) const
{
    auto state = new_state(impl_->device, light, technique);
    Needs needs = needs_of(technique);
    const Geometry::State& objects = geometry.state();
    check_casters(needs, objects.any(&Object::casts), occluders, kind_of(technique));
    // Depth images that cast stand for themselves, or the light's view of everything stands for them and the meshes beside them.
    const bool seen = objects.any_seen(&Object::casts);
    const bool by_view = seen && !needs.depth_images, or_front = needs.casters == Needs::Casters::or_front;
    if (by_view && or_front) needs.front = needs.back = true;
    // Of a technique that traces images alone, meshes are what the light sees of them.
    if (needs.depth_images && or_front) needs.front = objects.any_mesh(&Object::casts);
    const bool maps = needs.front || needs.back;
    const LeftOut left_out = left_out_of(light, geometry.objects(), needs, receivers);
    state->grounds = left_out.grounds;
    const CastingMeshes meshes(geometry, left_out);
    Casting casting{.light = state->light,
                    .depth = {},
                    .meshes = by_view ? std::vector<const TriangleMesh*>{} : meshes.meshes(),
                    .topology = [&] { return objects.topology(); },
                    .tracer = [&] { return objects.casters(); },
                    .images = {},
                    .receivers_cast = receivers_may_cast(geometry.objects(), receivers)};
    if (seen && needs.depth_images) {
        const Stopwatch watch;
        casting.images = objects.images(&Object::casts, state->device);
        state->stages.push_back({"fit depth", watch.ms(), 0, 0});
    }

    // Render what the maps lack.
    Occluders complete;
    if (maps) {
        const Stopwatch watch;
        complete = occluders_with_depth(light, occluders, geometry, needs, left_out, state->device);
        state->stages.push_back({"render depth", watch.ms(), 0, 0});
    }
    const bool shown = casting.meshes.empty() && or_front && (by_view || casting.images.empty());
    if (maps || shown) casting.depth = depth_of(light, maps ? complete : occluders, geometry.objects(), needs, left_out, shown);

    prepare_technique(*state, casting);
    if (needs.tolerance > 0) add_field(*state, casting, geometry, left_out);
    warn_of_cut_outs(*state, needs, casting, geometry);
    say_quality(*state, geometry);
    state->covered = !maps || (!geometry.objects().empty() && casters_inside(geometry.objects(), state->light_view, left_out));
    if (needs.receivers_from_light && objects.any(&Object::receives)) state->receiver_geometry = geometry;
    return Prepared(state);
}

Prepared Engine::with_emission(const Prepared& prepared, const Image& emission) const
{
    const Prepared::State& before = prepared.state();
    auto* rectangle = std::get_if<RectangleLight>(&before.light);
    if (!rectangle)
        throw Error::at(ErrorCode::usage, "light.emission", "was prepared for a " + kind_of(before.light), "expected a rectangle");
    auto state =
        new_state(before.device, RectangleLight{rectangle->center, rectangle->half_u, rectangle->half_v, emission}, before.technique);
    state->light_view = before.light_view;
    state->channels = emission.channels;
    state->covered = before.covered;
    state->grounds = before.grounds;
    state->field = before.field;
    state->proves_lit = before.proves_lit;
    state->warnings = before.warnings;
    opencl::Work work(state->device);
    state->data = under_other_emission(work, before.data, state->light);
    finish_prepare(work, *state);
    state->shared = before.shared ? before.shared : before.memory;
    return Prepared(state);
}

Prepared Engine::prepare(const Light& light, const DeviceOccluders& occluders, const Technique& technique) const
{
    if (const auto refused = device_buffers_of(technique).prepare) throw *refused;
    auto state = new_state(impl_->device, light, technique);
    const Needs needs = needs_of(technique);
    const auto taken = [&](cl_mem memory, bool wanted, const char* what) {
        if (!wanted) return cl::Buffer();
        check_device_buffer(memory, occluders.width, occluders.height, what);
        return cl::Buffer(memory, true);
    };
    const LightDepth depth{.camera = occluder_camera(light, occluders.camera, {}, occluders.width, occluders.height),
                           .width = occluders.width,
                           .height = occluders.height,
                           .front = nullptr,
                           .back = nullptr,
                           .layers = {},
                           .device_front = taken(occluders.front, needs.front, "occluders.front"),
                           .device_back = taken(occluders.back, needs.back, "occluders.back")};
    prepare_technique(*state, {.light = state->light, .depth = depth, .meshes = {}, .topology = {}, .tracer = {}, .images = {}});
    return Prepared(state);
}

} // namespace penumbra
