#include "kept_scene.hpp"

#include <algorithm>
#include <utility>

#include <penumbra/error.hpp>

#include "digest.hpp"
#include "io/json_value.hpp"
#include "io/scene_parts.hpp"
#include "problem.hpp"
#include "resources.hpp"
#include "scene/light_space.hpp"
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
        return a == before.end() || (*a == *b && !mentions(*b, names));
    }
    std::string text(const char* section) const { return after.contains(section) ? after[section].dump() : std::string(); }
};

KeptScene::KeptScene(std::string id, std::span<const Part> parts, const Options& options, const Deadline& deadline)
    : id_(std::move(id)), owned_(copied(parts)), parts_(views(owned_)), scene_(decode_scene(parts_, options, deadline)),
      occluders_(std::make_shared<const Occluders>(std::move(scene_.occluders))),
      receivers_(std::make_shared<const Receivers>(std::move(scene_.receivers))),
      geometry_(std::move(scene_.objects), light_frame(scene_.light).origin)
{
    document_ = parse_json(find_scene(parts_, options)->bytes);
}

std::uint64_t KeptScene::bytes() const
{
    std::uint64_t bytes = geometry_.bytes() + cache_.host_bytes() + cache_.device_bytes();
    for (const auto& [name, part] : owned_) bytes += name.size() + part.size();
    bytes += depth_bytes(occluders_->front) + depth_bytes(occluders_->back) + depth_bytes(receivers_->depth);
    for (const DepthMap& layer : occluders_->layers) bytes += layer.depth.size() * sizeof(float);
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
    if (mentions(*objects, changes.names))
        throw Error(ErrorCode::invalid_input, "objects: name a part that came with this request, and objects are kept as they are",
                    "give the part another name, or upload the scene anew");
    if (!changes.same("light") && objects_follow_light(changes.after))
        throw Error(ErrorCode::invalid_input, "light: cannot be changed: the depth of an object is seen from the light itself",
                    "give that object a camera of kind pinhole, or upload the scene anew");
}

MaskTask KeptScene::task(std::string_view patch, std::span<const Part> extra, const Options& options, const Deadline& deadline) const
{
    const nlohmann::json after = patch.empty() ? document_ : patched(document_, parse_json(patch));
    Changes changes{document_, after, {}};
    for (const Part& part : extra)
        if (part.name != "scene") changes.names.push_back(part.name);
    check_objects(changes);

    std::vector<Part> parts(extra.begin(), extra.end());
    parts.insert(parts.end(), parts_.begin(), parts_.end());
    const RequestResources resources(parts, options, deadline);
    MaskTask task{.light = scene_.light,
                  .occluders = occluders_,
                  .receivers = receivers_,
                  .geometry = geometry_,
                  .technique = technique_from(scene_.technique),
                  .output = scene_.output,
                  .warnings = scene_.warnings,
                  .cache = &cache_,
                  .prepared_key = changes.text("light") + '\n' + changes.text("technique"),
                  .receivers_key = changes.text("receivers")};
    resources.without_paths([&] {
        const JsonObject root(JsonValue(after, {}));
        if (!changes.same("output")) task.output = root.has("output") ? parse_output(root.need("output")) : OutputFormat{};
        if (!changes.same("technique"))
            task.technique = technique_from(root.has("technique") ? parse_technique(root.need("technique")) : TechniqueRequest{});
        if (!changes.same("light")) task.light = parse_light(root.need("light"), resources);

        // A light's camera reads differently for a directional light.
        const bool same_cameras = is_directional(task.light) == is_directional(scene_.light);
        const bool same_occluders = changes.same("occluders") && (same_cameras || !root.has("occluders"));
        if (!same_occluders)
            task.occluders =
                std::make_shared<const Occluders>(parse_occluders(root.need("occluders"), task.light, resources, task.warnings));
        if (!changes.same("receivers") || (!same_cameras && root.has("receivers")))
            task.receivers = std::make_shared<const Receivers>(
                root.has("receivers") ? parse_receivers(root.need("receivers"), task.light, resources, task.warnings) : Receivers{});

        // What came with this request alone has no name that would say what it was.
        if (!same_occluders || mentions(after["light"], changes.names)) task.prepared_key.clear();
        if (!changes.same("receivers") && mentions(after.value("receivers", nlohmann::json()), changes.names)) task.receivers_key.clear();
        // Seen from the light, or fitted by it, the receivers depend on it.
        if (!task.receivers_key.empty() && std::holds_alternative<LightCamera>(task.receivers->camera))
            task.receivers_key += '\n' + changes.text("light");
    });
    return task;
}

} // namespace penumbra::server
