#include <algorithm>
#include <array>

#include <penumbra/error.hpp>
#include <penumbra/scene_file.hpp>

#include "io/json_value.hpp"
#include "io/scene_check.hpp"
#include "io/scene_parts.hpp"
#include "io/scene_schema.hpp"

namespace penumbra {
namespace {

using Json = nlohmann::json;

constexpr std::array<std::string_view, 5> sections{"light", "lights", "receivers", "technique", "output"};

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

void check_patch(const Json& patch)
{
    if (!patch.is_object()) throw Error(ErrorCode::invalid_input, "the patch is no JSON object", "expected {\"light\": {...}} or the like");
    for (const auto& [key, value] : JsonObject(JsonValue(patch, {})).members())
        if (std::ranges::find(sections, key) == sections.end())
            throw value.error("cannot be changed in a kept scene",
                              "expected light, lights, receivers, technique or output; for anything else upload the scene anew");
}

} // namespace

struct SceneDocument::State {
    explicit State(Json json_) : json(std::move(json_)) {}

    JsonObject root() const { return JsonObject(JsonValue(json, {})); }
    // A section, or nothing where there is none.
    const Json* section(std::string_view name) const
    {
        const auto found = json.find(std::string(name));
        return found == json.end() ? nullptr : &*found;
    }
    const Json& light(std::optional<std::size_t> place) const { return place ? json["lights"][*place] : json["light"]; }

    const Json json;
};

SceneDocument::SceneDocument(std::string_view json) : state_(std::make_shared<const State>(parse_json(json))) {}

SceneDocument SceneDocument::patched(std::string_view patch) const
{
    if (patch.empty()) return *this;
    const Json change = parse_json(patch);
    check_patch(change);
    Json result = state_->json;
    merge(result, change);
    return SceneDocument(std::make_shared<const State>(std::move(result)));
}

std::string SceneDocument::text() const { return state_->json.dump(); }

std::string SceneDocument::text(std::string_view section) const
{
    const Json* const found = state_->section(section);
    return found ? found->dump() : std::string();
}

std::string SceneDocument::light_text(std::optional<std::size_t> place) const { return state_->light(place).dump(); }

bool SceneDocument::has(std::string_view section) const { return state_->section(section) != nullptr; }

bool SceneDocument::names_file(std::string_view section, std::span<const std::string_view> files) const
{
    const Json* const found = state_->section(section);
    return found && penumbra::names_file(*found, section, files);
}

bool SceneDocument::light_names_file(std::optional<std::size_t> place, std::span<const std::string_view> files) const
{
    return penumbra::names_file(state_->light(place), place ? "lights[]" : "light", files);
}

bool SceneDocument::objects_follow_light() const
{
    const Json* const objects = state_->section("objects");
    return objects && std::ranges::any_of(*objects, [](const Json& object) {
               const auto camera = object.find("camera");
               return camera != object.end() && camera->value("kind", "") == "light";
           });
}

OutputFormat SceneDocument::output() const
{
    const auto value = state_->root().find("output");
    return value ? parse_output(*value) : OutputFormat{};
}

TechniqueRequest SceneDocument::technique() const
{
    const auto value = state_->root().find("technique");
    return value ? parse_technique(*value) : default_technique(state_->root());
}

Scene SceneDocument::lights(const Resources& resources) const
{
    Scene scene;
    parse_lights(state_->root(), resources, scene);
    return scene;
}

void SceneDocument::add_occluders(Scene& scene, const Resources& resources) const { parse_all_occluders(state_->root(), resources, scene); }

Receivers SceneDocument::receivers(const Light& first, const Resources& resources, std::vector<std::string>& warnings) const
{
    const auto value = state_->root().find("receivers");
    return value ? parse_receivers(*value, first, resources, warnings) : Receivers{};
}

void SceneDocument::check_shared_views() const { penumbra::check_shared_views(state_->root()); }

std::span<const std::string_view> patched_sections() { return sections; }

std::string scene_definitions_json(std::string_view prefix) { return scene_definitions(prefix).dump(); }

} // namespace penumbra
