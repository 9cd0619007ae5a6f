#include "masks/scene_patch.hpp"

#include <algorithm>

#include <penumbra/error.hpp>

#include "io/json_value.hpp"

namespace penumbra::server {
namespace {

using Json = nlohmann::json;

// RFC 7396, but for objects of another kind.
void merge(Json& target, const Json& patch)
{
    if (!patch.is_object()) {
        target = patch;
        return;
    }
    const bool other_kind = target.is_object() && patch.contains("kind") && target.contains("kind") && patch["kind"] != target["kind"];
    if (!target.is_object() || other_kind) target = Json::object();
    for (const auto& [key, value] : patch.items()) {
        if (value.is_null())
            target.erase(key);
        else
            merge(target[key], value);
    }
}

} // namespace

Json patched(const Json& scene, const Json& patch)
{
    if (!patch.is_object()) throw Error(ErrorCode::invalid_input, "the patch is no JSON object", "expected {\"light\": {...}} or the like");
    for (const auto& [key, value] : JsonObject(JsonValue(patch, {})).members())
        if (std::ranges::find(patched_sections, key) == patched_sections.end())
            throw value.error("cannot be changed in a kept scene",
                              "expected light, lights, receivers, technique or output; for anything else upload the scene anew");
    Json result = scene;
    merge(result, patch);
    return result;
}

bool objects_follow_light(const Json& scene)
{
    const auto objects = scene.find("objects");
    return objects != scene.end() && std::ranges::any_of(*objects, [](const Json& object) {
               const auto camera = object.find("camera");
               return camera != object.end() && camera->value("kind", "") == "light";
           });
}

} // namespace penumbra::server
