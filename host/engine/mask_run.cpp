// One run of masks: prepare, render what the receivers lack, shade, for each light of each frame, and the mean of them all.
#include <algorithm>
#include <map>
#include <optional>
#include <type_traits>

#include <penumbra/error.hpp>
#include <penumbra/mask_job.hpp>

#include "engine/depth_sources.hpp"
#include "engine/error_estimate.hpp"
#include "engine/geometry.hpp"
#include "engine/state.hpp"
#include "engine/weighted_mean.hpp"
#include "scene/lights.hpp"
#include "technique/techniques.hpp"

namespace penumbra {
namespace {

// What a run keeps for itself where the caller keeps nothing: of a light with a sequence, the frame before.
class FrameKeeper : public MaskKeeper {
public:
    std::optional<Prepared> prepared(std::size_t, int) override { return std::nullopt; }
    std::optional<Prepared> prepared_in_any_frame(std::size_t light) override
    {
        const auto found = last_.find(light);
        return found == last_.end() ? std::nullopt : std::optional(found->second);
    }
    void keep(std::size_t light, int frame, const Prepared& prepared) override
    {
        if (frame > 0) last_.insert_or_assign(light, prepared);
    }
    std::shared_ptr<const Receivers> receivers() override { return nullptr; }
    void keep(std::shared_ptr<const Receivers>) override {}

private:
    std::map<std::size_t, Prepared> last_;
};

// A job on its way through its frames.
class MaskRun {
public:
    MaskRun(const Engine& engine, const MaskJob& job, const MaskHooks& hooks)
        : engine_(engine), job_(job), keeper_(hooks.keeper ? *hooks.keeper : own_keeper_), before_(hooks.before), estimated_(hooks.estimated), masks_(job.lights.size())
    {
    }

    int frames() const
    {
        std::size_t most = 0;
        for (const MaskLight& light : job_.lights) most = std::max(most, frames_of(light.light));
        return static_cast<int>(most);
    }

    // What is prepared for a light, and whether it was kept.
    std::pair<Prepared, bool> prepare(std::size_t index, int frame)
    {
        return in_place(index, [&] { return prepared(index, frame); });
    }

    // The mask of one light. Frames come in order.
    Mask of(std::size_t index, int frame)
    {
        return in_place(index, [&] { return mask(index, frame); });
    }

private:
    // What goes wrong with a light of a list names its place there.
    template <class Call> std::invoke_result_t<Call> in_place(std::size_t index, const Call& call)
    {
        const MaskLight& light = job_.lights[index];
        try {
            return call();
        } catch (const Error& error) {
            if (!light.place) throw;
            throw in_list(error, *light.place, light.own_occluders);
        }
    }

    void before(std::string_view next) const
    {
        if (before_) before_(next);
    }

    std::pair<Prepared, bool> prepared(std::size_t index, int frame)
    {
        const MaskLight& light = job_.lights[index];
        // A light without a sequence of its own is the same in all frames.
        const int own_frame = frames_of(light.light) > 0 ? frame : 0;
        if (auto kept = keeper_.prepared(index, own_frame); kept && serves(*kept, light.light)) return {std::move(*kept), true};
        before("preparing");
        const Light now = at_frame(light.light, own_frame);
        auto still = keeper_.prepared_in_any_frame(index);
        if (still && !serves(*still, light.light)) still.reset();
        Prepared made = still ? engine_.with_emission(*still, *std::get<RectangleLight>(now).emission)
                              : engine_.prepare(now, *light.occluders, job_.geometry, job_.technique, job_.receivers.get());
        keeper_.keep(index, own_frame, made);
        return {std::move(made), false};
    }

    // Whether the occluder map holds what casts on these receivers: nothing of theirs lies behind ground that it was not fitted to.
    bool serves(const Prepared& prepared, const Light& light) const
    {
        const std::vector<Ground>& grounds = prepared.state().grounds;
        const Receivers& given = *job_.receivers;
        if (grounds.empty() || !given.depth) return true;
        const Camera camera = resolve_camera(given.camera, light, job_.geometry.objects(), given.width, given.height, "receivers.camera");
        return !shows_behind(grounds, light_frame(light), *given.depth, camera);
    }

    // The receivers with their depth; the first light renders it where it is missing.
    const Receivers& receivers(const Light& light, const std::shared_ptr<const opencl::LateContext>& device, std::vector<Stage>& stages)
    {
        if (!receivers_) receivers_ = keeper_.receivers();
        if (receivers_) return *receivers_;
        before("the receivers' depth");
        const Stopwatch watch;
        Receivers complete = receivers_with_depth(*job_.receivers, light, job_.geometry, device);
        stages.push_back({"render depth", watch.ms(), 0, 0});
        if (complete.depth->from_image) {
            const Stopwatch fitting;
            const Camera camera = resolve_camera(complete.camera, light, {}, complete.width, complete.height, "receivers.camera");
            complete.surface = job_.geometry.state().surface_of_same(*complete.depth, camera);
            if (!complete.surface) complete.surface = surface_of(complete, camera, device);
            stages.push_back({"fit receivers", fitting.ms(), 0, 0});
        }
        receivers_ = std::make_shared<const Receivers>(std::move(complete));
        keeper_.keep(receivers_);
        return *receivers_;
    }

    Mask mask(std::size_t index, int frame)
    {
        if (masks_[index]) return *masks_[index];
        const Stopwatch total;
        const auto [made, kept] = prepared(index, frame);
        std::vector<Stage> stages;
        const Receivers& seen = receivers(job_.lights[index].light, made.state().device, stages);
        before("shading");
        Mask mask = shade_estimated(made, seen, job_.bound, estimated_);
        Report& report = mask.report;
        if (!kept) {
            add_stages(stages, made.state().stages);
            report.prepare_ms = made.state().prepare_ms;
        }
        add_stages(stages, report.stages);
        report.stages = std::move(stages);
        report.warnings.insert(report.warnings.begin(), job_.warnings.begin(), job_.warnings.end());
        if (job_.error_estimate) {
            before("estimating the error");
            const Stopwatch estimating;
            const MaskLight& light = job_.lights[index];
            report.error_estimate = estimate_error(engine_, job_, light, at_frame(light.light, frames_of(light.light) > 0 ? frame : 0), made, seen, mask.visibility);
            report.stages.push_back({"estimate error", estimating.ms(), 0, 0});
        }
        report.total_ms = total.ms();
        if (frame > 0 && frames_of(job_.lights[index].light) == 0) masks_[index] = without_work(mask);
        return mask;
    }

    // Given again, a mask has cost nothing.
    static Mask without_work(Mask mask)
    {
        Report& report = mask.report;
        report.stages.clear();
        report.prepare_ms = report.shade_ms = report.total_ms = 0;
        report.pairs = 0;
        return mask;
    }

    const Engine& engine_;
    const MaskJob& job_;
    FrameKeeper own_keeper_;
    MaskKeeper& keeper_;
    const std::function<void(std::string_view)>& before_;
    const std::function<void(const WorkAmount&)>& estimated_;
    std::vector<std::optional<Mask>> masks_; // of lights that stay the same while others move
    std::shared_ptr<const Receivers> receivers_;
};

NamedMask together(const WeightedMean& mean, Report report, int frame)
{
    const Stopwatch watch;
    NamedMask all{.light = {}, .frame = frame, .mask = {.visibility = mean.take(), .report = std::move(report)}};
    const double ms = watch.ms();
    all.mask.report.stages.push_back({"combine", ms, 0, all.mask.visibility.pixels.size() * sizeof(float)});
    all.mask.report.total_ms += ms;
    return all;
}

// Occluders that stay where they are, or are the job's own now.
std::shared_ptr<const Occluders> shared(const Occluders& occluders) { return {std::shared_ptr<const Occluders>(), &occluders}; }
std::shared_ptr<const Occluders> shared(Occluders&& occluders) { return std::make_shared<const Occluders>(std::move(occluders)); }

// The one list of lights: a scene with one light is a list of one.
template <class SceneType> std::vector<MaskLight> list_of_lights(SceneType&& scene)
{
    const auto common = shared(std::forward<SceneType>(scene).occluders);
    std::vector<MaskLight> lights;
    if (scene.lights.empty()) lights.push_back({.name = {}, .light = std::forward<SceneType>(scene).light, .occluders = common});
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        auto& from = scene.lights[i];
        MaskLight light{.name = from.name, .weight = from.weight, .place = i, .light = from.light, .occluders = common};
        if (from.occluders) {
            light.own_occluders = true;
            if constexpr (std::is_const_v<std::remove_reference_t<SceneType>>)
                light.occluders = shared(*from.occluders);
            else
                light.occluders = shared(std::move(*from.occluders));
        }
        lights.push_back(std::move(light));
    }
    return lights;
}

} // namespace

void add_report(Report& all, const Report& one, const std::string& name, const std::vector<std::string>& common)
{
    if (all.technique.empty()) {
        all = one;
        all.stages.clear();
        all.prepare_ms = all.shade_ms = all.total_ms = 0;
        all.peak_device_bytes = all.pairs = 0;
        all.error_estimate.reset();
        all.warnings = common;
        all.notes.clear();
    }
    add_stages(all.stages, one.stages);
    all.prepare_ms += one.prepare_ms;
    all.shade_ms += one.shade_ms;
    all.total_ms += one.total_ms;
    all.peak_device_bytes = std::max(all.peak_device_bytes, one.peak_device_bytes);
    all.pairs += one.pairs;
    for (std::size_t i = common.size(); i < one.warnings.size(); ++i) all.warnings.push_back(name + ": " + one.warnings[i]);
    for (const std::string& note : one.notes) all.notes.push_back(name + ": " + note);
}

std::vector<MaskLight> lights_of(Scene&& scene) { return list_of_lights(std::move(scene)); }

MaskJob job_of(const Scene& scene, const Technique& technique)
{
    validate_lights(scene);
    return {.lights = list_of_lights(scene),
            .receivers = {std::shared_ptr<const Receivers>(), &scene.receivers},
            .geometry = view_of(scene),
            .technique = technique,
            .warnings = scene.warnings,
            .combined = !scene.lights.empty()};
}

MaskJob job_of(Scene&& scene, const Technique& technique)
{
    validate_lights(scene);
    const Vec3 near = first_origin(scene);
    const bool combined = !scene.lights.empty();
    MaskJob job{.lights = {},
                .receivers = std::make_shared<const Receivers>(std::move(scene.receivers)),
                .geometry = Geometry(std::move(scene.objects), near),
                .technique = technique,
                .warnings = std::move(scene.warnings),
                .combined = combined};
    job.lights = list_of_lights(std::move(scene)); // what is left of it
    return job;
}

namespace {

// Three a triangle, of objects that cast, or of the sheets that depth maps show.
double edges_of(const MaskJob& job, const MaskShape& shape)
{
    double triangles = 0;
    for (const Object& object : job.geometry.objects())
        if (object.casts) triangles += object.seen ? 4 * static_cast<double>(object.seen->depth.depth.size()) : static_cast<double>(object.mesh.triangles.size());
    if (triangles == 0)
        for (const MaskShape::Map& map : shape.occluders) triangles = std::max(triangles, 4.0 * map.width * map.height);
    return 3 * triangles;
}

} // namespace

std::vector<WorkAmount> work_of(const MaskJob& job)
{
    MaskShape shape{.receivers = {job.receivers->width, job.receivers->height}, .occluders = {}};
    for (const MaskLight& light : job.lights) shape.occluders.push_back({light.occluders->width, light.occluders->height});
    shape.bound = job.bound;
    shape.edges = edges_of(job, shape);
    std::vector<WorkAmount> all = std::visit([&](const auto& settings) { return work(settings, shape); }, job.technique);
    if (job.error_estimate && job.geometry.state().any(&Object::casts))
        all.push_back({.key = "error_estimate", .amount = shape.lights() * rays_of_estimate(), .unit = WorkAmount::Unit::rays, .what = "rays"});
    return all;
}

Mask Engine::mask(const Scene& scene) const { return mask(scene, technique_from(scene.technique)); }

Mask Engine::mask(const Scene& scene, const Technique& technique) const
{
    if (const int frames = frame_count(scene); frames > 0)
        throw Error::at(ErrorCode::usage, "light.emission", "is a sequence of " + std::to_string(frames) + " images, expected one",
                        "masks computes them all, only_frame takes one");
    std::optional<Mask> last;
    masks(scene, technique, [&](NamedMask&& named) { last = std::move(named.mask); });
    return std::move(*last);
}

std::vector<NamedMask> Engine::masks(const Scene& scene) const { return masks(scene, technique_from(scene.technique)); }

std::vector<NamedMask> Engine::masks(const Scene& scene, const Technique& technique) const
{
    std::vector<NamedMask> all;
    masks(scene, technique, [&](NamedMask&& named) { all.push_back(std::move(named)); });
    return all;
}

void Engine::masks(const Scene& scene, const Technique& technique, const MaskSink& sink) const
{
    masks(job_of(scene, technique), {}, sink);
}

void Engine::masks(const MaskJob& job, const MaskHooks& hooks, const MaskSink& sink) const
{
    if (job.bound) require_bounds(job.technique);
    MaskRun run(*this, job, hooks);
    const int frames = run.frames();
    for (int frame = frames > 0 ? 1 : 0; frame <= frames; ++frame) {
        WeightedMean mean, bounds;
        Report report;
        for (std::size_t i = 0; i < job.lights.size(); ++i) {
            const MaskLight& light = job.lights[i];
            Mask mask = run.of(i, frame);
            if (job.combined) {
                mean.add(mask.visibility, light.weight);
                if (job.bound) bounds.add(mask.bound, light.weight);
                add_report(report, mask.report, light.name, job.warnings);
            }
            sink({.light = light.name, .frame = frame, .mask = std::move(mask)});
        }
        if (!job.combined) continue;
        NamedMask all = together(mean, std::move(report), frame);
        if (job.bound) all.mask.bound = bounds.take();
        sink(std::move(all));
    }
}

void Engine::prepare(const MaskJob& job, const MaskHooks& hooks) const
{
    MaskRun run(*this, job, hooks);
    for (std::size_t i = 0; i < job.lights.size(); ++i) run.prepare(i, run.frames() > 0 ? 1 : 0);
}

} // namespace penumbra
