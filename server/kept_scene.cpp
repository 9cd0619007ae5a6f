#include "kept_scene.hpp"

#include <algorithm>
#include <utility>

#include <penumbra/error.hpp>

#include "digest.hpp"
#include "io/json_value.hpp"
#include "io/scene_check.hpp"
#include "io/scene_parts.hpp"
#include "problem.hpp"
#include "resources.hpp"
#include "scene/light_space.hpp"
#include "scene/lights.hpp"
#include "scene_patch.hpp"

namespace penumbra::server {
namespace {

std::vector<std::pair<std::string, std::string>> copied(std::span<const Part> parts)
{
    std::vector<std::pair<std::string, std::string>> copy;
    for (const Part& part : parts) copy.emplace_back(part.name, part.bytes);
    return copy;
}

std::vector<Part> views(const std::vector<std::pair<std::string, std::string>>& owned)
{
    std::vector<Part> parts;
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
    const nlohmann::json& before;
    const nlohmann::json& after;
    std::vector<std::string_view> names; // of the extra parts

    // Whether a section is as it was, its images as well.
    bool same(const char* section) const
    {
        const auto a = before.find(section), b = after.find(section);
        if ((a == before.end()) != (b == after.end())) return false;
        return a == before.end() || (*a == *b && !names_file(*b, section, names));
    }
    bool same_lights() const { return same("light") && same("lights"); }
    std::string text(const char* section) const { return after.contains(section) ? after[section].dump() : std::string(); }
};

KeptScene::KeptScene(std::string id, std::span<const Part> parts, const Options& options, const Deadline& deadline)
    : id_(std::move(id)), owned_(copied(parts)), parts_(views(owned_)),
      scene_(decode_scene(parts_, options, deadline)), first_choice_{.light = {}, .frame = frame_count(scene_) > 0 ? 1 : 0},
      lights_(lights_of(scene_)), receivers_(std::make_shared<const Receivers>(std::move(scene_.receivers))),
      geometry_(std::move(scene_.objects), light_frame(lights_->list.front().light).origin), cache_(lights_->list.size())
{
    document_ = parse_json(find_scene(parts_, options)->bytes);
}

std::uint64_t KeptScene::bytes() const
{
    std::uint64_t bytes = geometry_.bytes() + cache_.host_bytes() + cache_.device_bytes();
    for (const auto& [name, part] : owned_) bytes += name.size() + part.size();
    bytes += depth_bytes(*lights_->shared) + depth_bytes(receivers_->depth);
    for (const Lights::One& light : lights_->list) bytes += emission_bytes(light.light) + (light.own ? depth_bytes(*light.own) : 0);
    return bytes;
}

std::string KeptScene::content_of(std::string_view patch, std::span<const Part> extra) const
{
    Digest digest;
    digest.add(id_).add(patch);
    for (const Part& part : extra) digest.add(part.name).add(part.bytes);
    return digest.hex();
}

void KeptScene::check_objects(const Changes& changes) const
{
    if (geometry_.objects().empty()) return;
    const auto objects = changes.after.find("objects");
    if (objects == changes.after.end()) return;
    if (names_file(*objects, "objects", changes.names))
        throw Error::at(ErrorCode::invalid_input, "objects", "name a part that came with this request, and objects are kept as they are",
                        "give the part another name, or upload the scene anew");
    if (!changes.same_lights() && objects_follow_light(changes.after))
        throw Error::at(ErrorCode::invalid_input, "light", "cannot be changed: the depth of an object is seen from the light itself",
                        "give that object a camera of kind pinhole, or upload the scene anew");
}

std::shared_ptr<const KeptScene::Lights> KeptScene::lights_of(Scene& scene)
{
    Lights lights;
    if (scene.lights.empty()) lights.list.push_back({.name = {}, .weight = 1, .light = std::move(scene.light), .own = nullptr});
    for (SceneLight& light : scene.lights) {
        auto own = light.occluders ? std::make_shared<const Occluders>(std::move(*light.occluders)) : nullptr;
        lights.list.push_back({.name = light.name, .weight = light.weight, .light = std::move(light.light), .own = std::move(own)});
    }
    lights.shared = std::make_shared<const Occluders>(std::move(scene.occluders));
    return std::make_shared<const Lights>(std::move(lights));
}

std::shared_ptr<const KeptScene::Lights> KeptScene::patched_lights(const Changes& changes, const JsonObject& root,
                                                                   const Resources& resources, std::vector<std::string>& warnings) const
{
    Scene scene;
    parse_lights(root, resources, scene);
    const bool listed = !scene.lights.empty() || document_.contains("lights");
    // A light's camera reads differently for a directional light.
    const bool same_cameras = is_directional(scene.light) == is_directional(lights_->list.front().light);
    const bool same_occluders = !listed && changes.same("occluders") && (same_cameras || !root.has("occluders"));
    if (!same_occluders) parse_all_occluders(root, resources, scene);
    warnings.insert(warnings.end(), scene.warnings.begin(), scene.warnings.end());
    Lights lights = *lights_of(scene);
    if (same_occluders) lights.shared = lights_->shared;
    return std::make_shared<const Lights>(std::move(lights));
}

// What came with this request alone has no name that would say what it was.
std::vector<TaskLight> KeptScene::chosen(const Changes& changes, const Lights& lights, bool same_occluders, const MaskChoice& choice)
{
    std::vector<Choosable> choosable;
    for (const Lights::One& light : lights.list) choosable.push_back({light.name, static_cast<int>(frames_of(light.light))});
    std::vector<TaskLight> result;
    for (const std::size_t i : chosen_from(choosable, choice)) {
        const Lights::One& light = lights.list[i];
        const nlohmann::json& json = light.name.empty() ? changes.after["light"] : changes.after["lights"][i];
        TaskLight task{.name = light.name,
                       .weight = light.weight,
                       .place = i,
                       .own_occluders = light.own != nullptr,
                       .light = at_frame(light.light, choice.frame),
                       .occluders = light.own ? light.own : lights.shared,
                       .key = json.dump() + '\n' + changes.text("technique"),
                       .still_key = {}};
        if (!same_occluders || names_file(json, light.name.empty() ? "light" : "lights[]", changes.names)) task.key.clear();
        if (choosable[i].frames > 0 && !task.key.empty()) {
            task.still_key = task.key;
            task.key += "\nframe " + std::to_string(choice.frame);
        }
        result.push_back(std::move(task));
    }
    return result;
}

MaskTask KeptScene::task(std::string_view patch, std::span<const Part> extra, const MaskChoice& choice, const Options& options,
                         const Deadline& deadline) const
{
    const nlohmann::json after = patch.empty() ? document_ : patched(document_, parse_json(patch));
    Changes changes{document_, after, {}};
    for (const Part& part : extra)
        if (part.name != "scene") changes.names.push_back(part.name);
    check_objects(changes);

    std::vector<Part> parts(extra.begin(), extra.end());
    parts.insert(parts.end(), parts_.begin(), parts_.end());
    const RequestResources resources(parts, options, deadline);
    MaskTask task{.lights = {},
                  .receivers = receivers_,
                  .geometry = geometry_,
                  .technique = technique_from(scene_.technique),
                  .output = scene_.output,
                  .warnings = scene_.warnings,
                  .cache = &cache_,
                  .receivers_key = changes.text("receivers")};
    const JsonObject root(JsonValue(after, {}));
    if (!changes.same("output")) task.output = root.has("output") ? parse_output(root.need("output")) : OutputFormat{};
    if (!changes.same("technique"))
        task.technique = technique_from(root.has("technique") ? parse_technique(root.need("technique")) : TechniqueRequest{});

    const bool same_lights = changes.same_lights() && changes.same("occluders");
    const auto lights = same_lights ? lights_ : patched_lights(changes, root, resources, task.warnings);
    const Light& first = lights->list.front().light;
    const bool same_cameras = is_directional(first) == is_directional(lights_->list.front().light);
    check_shared_views(root);
    if (!changes.same("receivers") || (!same_cameras && root.has("receivers")))
        task.receivers = std::make_shared<const Receivers>(
            root.has("receivers") ? parse_receivers(root.need("receivers"), first, resources, task.warnings) : Receivers{});

    task.lights = chosen(changes, *lights, changes.same("occluders") && (same_cameras || !root.has("occluders")), choice);
    if (!changes.same("receivers") && names_file(after.value("receivers", nlohmann::json()), "receivers", changes.names))
        task.receivers_key.clear();
    // Seen from the light, or fitted by it, the receivers depend on it.
    if (!task.receivers_key.empty() && std::holds_alternative<LightCamera>(task.receivers->camera))
        task.receivers_key += '\n' + changes.text("light") + changes.text("lights");
    return task;
}

} // namespace penumbra::server
