// Several lights: their names and weights, and what each of them has for itself.
#include "io/scene_parts.hpp"
#include "scene/lights.hpp"

namespace penumbra {

namespace {

constexpr const char* not_shared = "is the light's own view, and the scene has several lights";

// Whether that camera, or the one that counts when there is none, is the light's own.
bool follows_light(const JsonObject& section, bool by_default)
{
    const auto camera = section.find("camera");
    if (!camera) return by_default;
    const auto kind = JsonObject(*camera).find("kind");
    return kind && kind->json() == "light";
}

} // namespace

const Light& first_light(const Scene& scene) { return scene.lights.empty() ? scene.light : scene.lights.front().light; }

std::vector<SceneLight> parse_light_names(const JsonValue& value)
{
    const std::vector<JsonValue> elements = value.elements();
    if (elements.empty()) throw value.error("has no light", "expected one or more");
    std::vector<SceneLight> lights;
    for (const JsonValue& element : elements) {
        const JsonObject section(element);
        SceneLight light{.name = std::to_string(lights.size() + 1), .weight = 1, .light = {}};
        if (const auto name = section.find("name")) light.name = name->text();
        if (const auto weight = section.find("weight")) light.weight = weight->number();
        lights.push_back(std::move(light));
    }
    validate_names(lights);
    return lights;
}

void parse_lights(const JsonObject& root, const Resources& resources, Scene& scene)
{
    if (root.has("light") && root.has("lights"))
        throw Error::at(ErrorCode::invalid_input, "lights", "stands beside light", "expected one of the two");
    const auto list = root.find("lights");
    if (!list && !root.has("light"))
        throw Error::at(ErrorCode::invalid_input, "light", "is missing", "expected a light, or a list of them under lights");
    if (!list) {
        scene.light = parse_light(root.need("light"), resources);
        return;
    }
    scene.lights = parse_light_names(*list);
    const std::vector<JsonValue> elements = list->elements();
    for (std::size_t i = 0; i < elements.size(); ++i) scene.lights[i].light = parse_light(elements[i], resources, true);
    validate_frames(scene.lights);
}

void check_shared_views(const JsonObject& root)
{
    const auto lights = root.find("lights");
    if (!lights || lights->elements().size() < 2) return;
    const auto receivers = root.find("receivers");
    if (!receivers || follows_light(JsonObject(*receivers), true))
        throw Error::at(ErrorCode::invalid_input, "receivers.camera", not_shared,
                        "expected kind \"pinhole\": all masks have one viewpoint");
    const auto objects = root.find("objects");
    if (!objects) return;
    for (const JsonValue& object : objects->elements())
        if (follows_light(JsonObject(object), false))
            throw JsonValue(object.json(), object.key() + ".camera").error(not_shared, "expected kind \"pinhole\"");
}

void parse_all_occluders(const JsonObject& root, const Resources& resources, Scene& scene)
{
    const auto shared = root.find("occluders");
    if (scene.lights.empty()) {
        if (shared) scene.occluders = parse_occluders(*shared, scene.light, resources, scene.warnings);
        return;
    }
    const std::vector<JsonValue> elements = root.need("lights").elements();
    bool read = false;
    for (std::size_t i = 0; i < elements.size(); ++i) {
        SceneLight& light = scene.lights[i];
        if (const auto own = JsonObject(elements[i]).find("occluders")) {
            light.occluders = parse_occluders(*own, light.light, resources, scene.warnings);
        } else if (shared && !read) {
            scene.occluders = parse_occluders(*shared, light.light, resources, scene.warnings);
            read = true;
        } else if (const auto camera = shared ? JsonObject(*shared).find("camera") : std::nullopt) {
            parse_camera(*camera, light.light); // reads differently for a directional light
        }
    }
    if (shared && !read) throw shared->error("serves no light: each has occluders of its own", "leave it out");
    validate_occluders(scene);
}

} // namespace penumbra
