// One run from lights, receivers and objects to masks, for those who keep things between runs or must be able to stop one.
//
//     penumbra::MaskJob job = penumbra::job_of(scene, penumbra::technique_from(scene.technique));
//     engine.masks(job, {.before = [&](std::string_view next) { deadline.check(next); }}, sink);
//
// Engine::mask and Engine::masks of a scene are this run without hooks.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/engine.hpp>

namespace penumbra {

// One light with what casts before it.
struct MaskLight {
    std::string name;                   // empty: the scene's only one
    double weight = 1;                  // as in SceneLight
    std::optional<std::size_t> place{}; // in the scene's list `lights`; nothing: it stands under `light`
    Light light;
    std::shared_ptr<const Occluders> occluders; // seen from this light; or what several share
    bool own_occluders = false;
};

// What masks are computed from. Cheap to copy but for lights with textures.
struct MaskJob {
    std::vector<MaskLight> lights; // at least one
    std::shared_ptr<const Receivers> receivers;
    Geometry geometry;
    Technique technique;
    std::vector<std::string> warnings = {}; // of the scene: they stand in front of those of each report
    bool bound = false;                     // whether Mask::bound is wanted; an error (unsupported) where the technique has none
    bool error_estimate = false;            // whether Report::error_estimate is wanted: some hundred thousand rays a mask
    bool combined = false;                  // whether the mask of all lights together is wanted, after theirs
};

// The job of a scene. The first form copies neither depth nor objects: the scene has to stay as long as the job. The second takes the
// scene. Throws invalid_input where the scene's lights do not go together.
PENUMBRA_API MaskJob job_of(const Scene& scene, const Technique& technique);
PENUMBRA_API MaskJob job_of(Scene&& scene, const Technique& technique);

// The lights alone, of a scene that is not whole yet: nothing is checked.
PENUMBRA_API std::vector<MaskLight> lights_of(Scene&& scene);

// Keeps what was prepared and rendered for later runs of the same job, or of one like it. `light` counts the job's lights.
class PENUMBRA_API MaskKeeper {
public:
    virtual ~MaskKeeper() = default;
    // What was prepared for this light in this frame (0: the job has no sequence), and for any frame of a light with a sequence.
    virtual std::optional<Prepared> prepared(std::size_t light, int frame) = 0;
    virtual std::optional<Prepared> prepared_in_any_frame(std::size_t light) = 0;
    virtual void keep(std::size_t light, int frame, const Prepared& prepared) = 0;
    // The receivers with their depth.
    virtual std::shared_ptr<const Receivers> receivers() = 0;
    virtual void keep(std::shared_ptr<const Receivers> receivers) = 0;
};

// Some of the work that a mask takes.
struct WorkAmount {
    enum class Unit { pairs, rays, slice_texels, receivers };
    std::string_view key; // of the scene file, that asks for it
    double amount = 0;
    Unit unit = Unit::pairs;
    std::string_view what; // are counted
    double seconds = 0;    // that it takes, where a sample was timed; 0: nobody knows
};

// Who takes part in a run. Both may be left out.
struct MaskHooks {
    MaskKeeper* keeper = nullptr;
    // Called before each step that may take long, with what comes next ("preparing", "the receivers' depth", "shading"). What it throws
    // ends the run.
    std::function<void(std::string_view next)> before = {};
    // Called for each light's mask with what shading it will take, which a sample has told. What it throws ends the run.
    std::function<void(const WorkAmount&)> estimated = {};
};

// What a job asks for at the most, as its sizes tell. Pairs of texel, edge or slice and receiver may be thousands of times fewer: that is known
// when the light is prepared (MaskHooks::estimated).
PENUMBRA_API std::vector<WorkAmount> work_of(const MaskJob& job);

} // namespace penumbra
