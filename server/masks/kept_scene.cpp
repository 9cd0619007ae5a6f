#include "masks/kept_scene.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <penumbra/error.hpp>

#include "masks/digest.hpp"
#include "masks/moved_maps.hpp"
#include "masks/resources.hpp"
#include "process/problem.hpp"

namespace penumbra::server {
namespace {

std::vector<std::pair<std::string, std::string>> copied(std::span<const Part> parts)
{
    std::vector<std::pair<std::string, std::string>> copy;
    copy.reserve(parts.size());
    for (const Part& part : parts) copy.emplace_back(part.name, part.bytes);
    return copy;
}

std::vector<Part> views(const std::vector<std::pair<std::string, std::string>>& owned)
{
    std::vector<Part> parts;
    parts.reserve(owned.size());
    for (const auto& [name, bytes] : owned) parts.push_back({name, bytes});
    return parts;
}

std::uint64_t depth_bytes(const std::optional<DepthMap>& map) { return map ? map->depth.size() * sizeof(float) : 0; }

std::uint64_t depth_bytes(const Occluders& occluders)
{
    std::uint64_t bytes = depth_bytes(occluders.front) + depth_bytes(occluders.back);
    for (const DepthMap& layer : occluders.layers) bytes += layer.depth.size() * sizeof(float);
    return bytes;
}

std::uint64_t emission_bytes(const Light& light)
{
    const auto* rectangle = std::get_if<RectangleLight>(&light);
    if (!rectangle) return 0;
    std::uint64_t samples = rectangle->emission ? rectangle->emission->pixels.size() : 0;
    for (const Image& frame : rectangle->frames) samples += frame.pixels.size();
    return samples * sizeof(float);
}

bool is_directional(const Light& light) { return std::holds_alternative<DirectionalLight>(light); }

} // namespace

std::string id_of(std::span<const Part> parts)
{
    Digest digest;
    for (const Part& part : parts) digest.add(part.name).add(part.bytes);
    return digest.hex();
}

// A patched document beside the one that was decoded.
struct KeptScene::Changes {
    const SceneDocument& before;
    const SceneDocument& after;
    std::vector<std::string_view> names; // of the extra parts

    // Whether a section is as it was, its images as well.
    bool same(const char* section) const
    {
        return before.has(section) == after.has(section) && before.text(section) == after.text(section) &&
               !after.names_file(section, names);
    }
    bool same_lights() const { return same("light") && same("lights"); }
};

KeptScene::Decoded KeptScene::decoded(std::span<const Part> parts, const Options& options, const Deadline& deadline)
{
    Scene scene = decode_scene(parts, options, deadline);
    const Technique technique = technique_from(scene.technique);
    const MaskChoice first{.light = {}, .frame = frame_count(scene) > 0 ? 1 : 0};
    const OutputFormat output = scene.output;
    return {.job = job_of(std::move(scene), technique), .output = output, .first = first};
}

KeptScene::KeptScene(std::string id, std::span<const Part> parts, const Options& options, const Deadline& deadline)
    : id_(std::move(id)), owned_(copied(parts)), parts_(views(owned_)), scene_(decoded(parts_, options, deadline)),
      document_(find_scene(parts_, options)->bytes), cache_(scene_.job.lights.size())
{
}

std::uint64_t KeptScene::bytes() const
{
    std::uint64_t bytes = scene_.job.geometry.bytes() + cache_.host_bytes() + cache_.device_bytes();
    for (const auto& [name, part] : owned_) bytes += name.size() + part.size();
    bytes += depth_bytes(scene_.job.receivers->depth);
    std::set<const Occluders*> counted; // several lights may share theirs
    for (const MaskLight& light : scene_.job.lights)
        bytes += emission_bytes(light.light) + (counted.insert(light.occluders.get()).second ? depth_bytes(*light.occluders) : 0);
    return bytes;
}

std::string KeptScene::content_of(std::string_view id, std::string_view patch, std::span<const Part> extra)
{
    Digest digest;
    digest.add(id).add(patch);
    for (const Part& part : extra) digest.add(part.name).add(part.bytes);
    return digest.hex();
}

void KeptScene::check_objects(const Changes& changes) const
{
    if (scene_.job.geometry.objects().empty()) return;
    if (changes.after.names_file("objects", changes.names))
        throw Error::at(ErrorCode::invalid_input, "objects", "name a part that came with this request, and objects are kept as they are",
                        "give the part another name, or upload the scene anew");
    if (!changes.same_lights() && changes.after.objects_follow_light())
        throw Error::at(ErrorCode::invalid_input, "light", "cannot be changed: the depth of an object is seen from the light itself",
                        "give that object a camera of kind pinhole, or upload the scene anew");
}

std::vector<MaskLight> KeptScene::patched_lights(const Changes& changes, const Resources& resources,
                                                 std::vector<std::string>& warnings) const
{
    Scene scene = changes.after.lights(resources);
    const bool listed = !scene.lights.empty() || document_.has("lights");
    const MaskLight& before = scene_.job.lights.front();
    // A light's camera reads differently for a directional light.
    const bool same_cameras = is_directional(scene.light) == is_directional(before.light);
    const bool same_occluders = !listed && changes.same("occluders") && (same_cameras || !changes.after.has("occluders"));
    if (!same_occluders) changes.after.add_occluders(scene, resources);
    warnings.insert(warnings.end(), scene.warnings.begin(), scene.warnings.end());
    std::vector<MaskLight> lights = lights_of(std::move(scene));
    if (same_occluders) lights.front().occluders = before.occluders;
    return lights;
}

// What came with this request alone has no name that would say what it was.
void KeptScene::choose(const Changes& changes, const std::vector<MaskLight>& lights, bool same_occluders, const MaskChoice& choice,
                       MaskTask& task)
{
    for (const std::size_t i : chosen_from(lights, choice)) {
        const MaskLight& light = lights[i];
        MaskTask::LightKeys keys;
        if (same_occluders && !changes.after.light_names_file(light.place, changes.names))
            keys.frame = changes.after.light_text(light.place) + '\n' + changes.after.text("technique");
        if (frames_of(light.light) > 0 && !keys.frame.empty()) {
            keys.still = keys.frame;
            keys.frame += "\nframe " + std::to_string(choice.frame);
        }
        task.job.lights.push_back(at_choice(light, choice));
        task.light_keys.push_back(std::move(keys));
    }
    task.job.combined = task.job.lights.size() > 1;
    task.job.bound = choice.image == MaskImage::bound;
    task.job.error_estimate = choice.error_estimate;
}

MaskTask KeptScene::task(std::string_view patch, std::span<const Part> extra, const MaskChoice& choice, const Options& options,
                         const Deadline& deadline) const
{
    const SceneDocument after = document_.patched(patch);
    Changes changes{document_, after, {}};
    for (const Part& part : extra)
        if (part.name != "scene") changes.names.push_back(part.name);
    check_objects(changes);

    std::vector<Part> parts(extra.begin(), extra.end());
    parts.insert(parts.end(), parts_.begin(), parts_.end());
    const RequestResources resources(parts, options, deadline);
    MaskTask task{.job = {.lights = {},
                          .receivers = scene_.job.receivers,
                          .geometry = scene_.job.geometry,
                          .technique = scene_.job.technique,
                          .warnings = scene_.job.warnings,
                          .combined = false},
                  .output = scene_.output,
                  .cache = &cache_,
                  .light_keys = {},
                  .receivers_key = after.text("receivers")};
    if (!changes.same("output")) task.output = after.output();
    if (!changes.same("technique")) task.job.technique = technique_from(after.technique());

    const bool same_lights = changes.same_lights() && changes.same("occluders");
    std::vector<MaskLight> patched;
    if (!same_lights) patched = patched_lights(changes, resources, task.job.warnings);
    const std::vector<MaskLight>& lights = same_lights ? scene_.job.lights : patched;
    const Light& first = lights.front().light;
    const bool same_cameras = is_directional(first) == is_directional(scene_.job.lights.front().light);
    after.check_shared_views();
    if (!changes.same("receivers") || (!same_cameras && after.has("receivers")))
        task.job.receivers = std::make_shared<const Receivers>(after.receivers(first, resources, task.job.warnings));

    if (!same_lights) {
        MaskJob moved{.lights = lights, .receivers = task.job.receivers, .geometry = scene_.job.geometry, .technique = task.job.technique};
        for (std::string& warning : warnings_of_moved_maps(scene_.job, moved)) task.job.warnings.push_back(std::move(warning));
    }

    choose(changes, lights, changes.same("occluders") && (same_cameras || !after.has("occluders")), choice, task);
    if (!changes.same("receivers") && after.names_file("receivers", changes.names)) task.receivers_key.clear();
    // Seen from the light, or fitted by it, the receivers depend on it.
    if (!task.receivers_key.empty() && std::holds_alternative<LightCamera>(task.job.receivers->camera))
        task.receivers_key += '\n' + after.text("light") + after.text("lights");
    return task;
}

} // namespace penumbra::server
