// From a scene to its masks: of one light, of several and of all together, of each frame.
#include <algorithm>
#include <optional>

#include <penumbra/error.hpp>

#include "engine/depth_sources.hpp"
#include "engine/geometry.hpp"
#include "engine/state.hpp"
#include "engine/weighted_mean.hpp"
#include "scene/lights.hpp"

namespace penumbra {
namespace {

// A scene on its way through its frames: what its lights share, and what a later frame has from an earlier one.
class MaskRun {
public:
    MaskRun(const Engine& engine, const Scene& scene, const Technique& technique)
        : engine_(engine), scene_(scene), technique_(technique), geometry_(view_of(scene)),
          kept_(std::max<std::size_t>(scene.lights.size(), 1))
    {
    }

    // The mask of the scene's only light. Frames come in order; 0: there is no sequence.
    Mask only(int frame) { return next(kept_[0], scene_.light, scene_.occluders, frame); }

    // The mask of one of `lights`.
    Mask of(std::size_t index, int frame)
    {
        const SceneLight& light = scene_.lights[index];
        try {
            return next(kept_[index], light.light, light.occluders ? *light.occluders : scene_.occluders, frame);
        } catch (const Error& error) {
            throw in_list(error, index, light.occluders.has_value());
        }
    }

private:
    // Of one light, from one frame to the next.
    struct Kept {
        std::optional<Prepared> prepared; // of a light with a sequence
        std::optional<Mask> mask;         // of a light without one: it stays
    };

    Mask next(Kept& kept, const Light& light, const Occluders& occluders, int frame)
    {
        if (kept.mask) return *kept.mask;
        const Stopwatch total;
        const bool moves = frames_of(light) > 0;
        const Prepared prepared = prepare(kept, light, occluders, moves ? frame : 0);

        std::vector<Stage> stages;
        if (!receivers_) {
            const Stopwatch render;
            receivers_ = with_depth(scene_.receivers, light, geometry_);
            stages.push_back({"render depth", render.ms(), 0, 0});
        }
        Mask mask = engine_.shade(prepared, *receivers_);
        add_stages(stages, prepared.state().stages);
        add_stages(stages, mask.report.stages);
        mask.report.stages = std::move(stages);
        mask.report.prepare_ms = prepared.state().prepare_ms;
        mask.report.warnings.insert(mask.report.warnings.begin(), scene_.warnings.begin(), scene_.warnings.end());
        mask.report.total_ms = total.ms();
        if (frame > 0 && moves) kept.prepared = prepared;
        if (frame > 0 && !moves) kept.mask = without_work(mask);
        return mask;
    }

    Prepared prepare(const Kept& kept, const Light& light, const Occluders& occluders, int frame) const
    {
        if (kept.prepared)
            return engine_.with_emission(*kept.prepared, std::get<RectangleLight>(light).frames[static_cast<std::size_t>(frame - 1)]);
        return engine_.prepare(at_frame(light, frame), occluders, geometry_, technique_);
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
    const Scene& scene_;
    const Technique& technique_;
    const Geometry geometry_;
    std::vector<Kept> kept_;
    std::optional<Receivers> receivers_;
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

} // namespace

void add_report(Report& all, const Report& one, const std::string& name, const std::vector<std::string>& common)
{
    if (all.technique.empty()) {
        all = one;
        all.stages.clear();
        all.prepare_ms = all.shade_ms = all.total_ms = 0;
        all.peak_device_bytes = all.pairs = 0;
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

Mask Engine::mask(const Scene& scene) const { return mask(scene, technique_from(scene.technique)); }

Mask Engine::mask(const Scene& scene, const Technique& technique) const
{
    if (const int frames = frame_count(scene); frames > 0)
        throw Error(ErrorCode::usage, "light.emission: is a sequence of " + std::to_string(frames) + " images, expected one",
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
    validate_lights(scene);
    MaskRun run(*this, scene, technique);
    const int frames = frame_count(scene);
    for (int frame = frames > 0 ? 1 : 0; frame <= frames; ++frame) {
        if (scene.lights.empty()) {
            sink({.light = {}, .frame = frame, .mask = run.only(frame)});
            continue;
        }
        WeightedMean mean;
        Report report;
        for (std::size_t i = 0; i < scene.lights.size(); ++i) {
            const SceneLight& light = scene.lights[i];
            Mask mask = run.of(i, frame);
            mean.add(mask.visibility, light.weight);
            add_report(report, mask.report, light.name, scene.warnings);
            sink({.light = light.name, .frame = frame, .mask = std::move(mask)});
        }
        sink(together(mean, std::move(report), frame));
    }
}

} // namespace penumbra
