#include <penumbra/scene_file.hpp>

#include <algorithm>
#include <filesystem>

#include <penumbra/technique.hpp>

#include "io/image_format.hpp"
#include "io/image_io.hpp"
#include "io/json_value.hpp"
#include "io/scene_check.hpp"
#include "io/scene_parts.hpp"

namespace penumbra {
namespace {

SettingValue read_setting(const JsonValue& value)
{
    const nlohmann::json& json = value.json();
    if (json.is_boolean()) return json.get<bool>();
    if (json.is_number_integer()) return value.integer(std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max());
    if (json.is_number()) return value.number();
    if (json.is_string()) return value.text();
    throw value.expected("true, false, a number or a string");
}

bool has_images(const Occluders& occluders) { return occluders.front || occluders.back || !occluders.layers.empty(); }

bool has_images(const Scene& scene)
{
    return has_images(scene.occluders) || scene.receivers.depth ||
           std::ranges::any_of(scene.lights, [](const SceneLight& light) { return light.occluders && has_images(*light.occluders); });
}

} // namespace

TechniqueRequest parse_technique(const JsonValue& value)
{
    const JsonObject section(value);
    TechniqueRequest request;
    request.kind = section.need("kind").text();
    for (const auto& [name, member] : section.members()) {
        // Messages about settings name their keys.
        if (std::ranges::any_of(name, [](unsigned char c) { return c < 0x20; }))
            throw member.error("is an unknown key", "keys hold no control characters");
        if (name != "kind") request.settings.emplace_back(name, read_setting(member));
    }
    return request;
}

OutputFormat parse_output(const JsonValue& value)
{
    const JsonObject section = checked(value, scene_file::output());
    OutputFormat output;
    output.format = section.need("format").text();
    if (const auto bits = section.find("bits")) output.bits = static_cast<int>(bits->number());
    try {
        return checked(output, {});
    } catch (const Error& error) {
        throw value.error(error.message(), error.hint());
    }
}

TechniqueRequest default_technique(const JsonObject& root)
{
    const auto objects = root.find("objects");
    if (!objects || !objects->json().is_array()) return {};
    bool depth = false, other = false;
    for (const JsonValue& object : objects->elements()) {
        if (!object.json().is_object()) continue;
        const auto casts = object.json().find("casts");
        if (casts != object.json().end() && *casts == false) continue;
        (object.json().contains("depth") || object.json().contains("position") ? depth : other) = true;
    }
    TechniqueRequest request;
    if (depth && !other) request.kind = "depth_trace";
    return request;
}

Bytes FileResources::bytes(const std::string& name) const { return Bytes(read_file(path(name), name)); }

std::string FileResources::path(const std::string& name) const { return (std::filesystem::path(folder_) / name).string(); }

Scene parse_scene(std::string_view json, const Resources& resources)
{
    const nlohmann::json document = parse_json(json);
    const JsonObject root(JsonValue(document, {}));
    const JsonValue version = root.need("penumbra");
    if (!version.json().is_number_integer() || version.json() != 1) throw version.expected("1, the version of the scene file");
    checked(root.value(), scene_file::scene());

    // What is cheap to refuse comes before images and meshes.
    Scene scene;
    if (const auto output = root.find("output")) scene.output = parse_output(*output);
    if (const auto technique = root.find("technique")) {
        scene.technique = parse_technique(*technique);
        technique_from(scene.technique); // for its errors, which name the key
    } else {
        scene.technique = default_technique(root);
    }
    parse_lights(root, resources, scene);
    check_shared_views(root);
    parse_all_occluders(root, resources, scene);
    const Light& light = first_light(scene);
    if (const auto receivers = root.find("receivers")) scene.receivers = parse_receivers(*receivers, light, resources, scene.warnings);
    if (const auto objects = root.find("objects"))
        for (const JsonValue& object : objects->elements()) scene.objects.push_back(parse_object(object, light, resources, scene.warnings));
    if (scene.objects.empty() && !has_images(scene))
        throw Error(ErrorCode::invalid_input, "the scene has nothing in it",
                    "give objects, or occluders.depth and receivers.depth, or both");
    return scene;
}

Scene load_scene(const std::string& path)
{
    const std::vector<std::byte> bytes = read_file(path, path);
    const FileResources resources(std::filesystem::path(path).parent_path().string());
    try {
        return parse_scene({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, resources);
    } catch (const Error& error) {
        throw error.within(path);
    }
}

} // namespace penumbra
