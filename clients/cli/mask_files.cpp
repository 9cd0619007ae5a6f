#include "mask_files.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include <penumbra/error.hpp>

#include "scene/lights.hpp"

namespace penumbra::cli {
namespace {

using nlohmann::json;

const json& member(const json& value, const char* key)
{
    static const json nothing;
    const auto found = value.is_object() ? value.find(key) : value.end();
    return value.is_object() && found != value.end() ? *found : nothing;
}

int frames_in(const json& light)
{
    const json& emission = member(light, "emission");
    return emission.is_array() ? static_cast<int>(std::min(emission.size(), max_frames)) : 0;
}

// The names of `lights`; none where they are no names, which is an error to come.
std::vector<SceneLight> names_in(const json& lights)
{
    std::vector<SceneLight> names;
    if (!lights.is_array() || lights.size() > max_lights) return names;
    for (const json& light : lights) {
        const json& name = member(light, "name");
        names.push_back({.name = name.is_string() ? name.get<std::string>() : std::to_string(names.size() + 1), .weight = 1, .light = {}});
    }
    try {
        validate_names(names);
    } catch (const Error&) {
        names.clear();
    }
    return names;
}

} // namespace

std::string mask_file(const std::string& output, std::string_view light, int frame)
{
    const std::filesystem::path path(output);
    std::string suffix = light.empty() ? std::string() : "." + std::string(light);
    char number[16] = "";
    if (frame > 0) std::snprintf(number, sizeof(number), ".%04d", frame);
    suffix += number;
    if (suffix.empty()) return output;
    return (path.parent_path() / (path.stem().string() + suffix + path.extension().string())).string();
}

std::vector<MaskFile> mask_files(const std::string& output, const json& scene, const MaskChoice& choice)
{
    const json& list = member(scene, "lights");
    const std::vector<SceneLight> lights = names_in(list);
    int frames = frames_in(member(scene, "light"));
    std::vector<std::string> names;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!choice.light.empty() && lights[i].name != choice.light) continue;
        frames = std::max(frames, frames_in(list[i]));
        if (choice.light.empty()) names.push_back(lights[i].name);
    }
    names.emplace_back();
    const bool sequence = frames > 0 && choice.frame == 0;

    std::vector<MaskFile> files;
    for (int frame = sequence ? 1 : 0; frame <= (sequence ? frames : 0); ++frame)
        for (const std::string& name : names)
            files.push_back({.light = choice.light.empty() ? name : choice.light,
                             .frame = sequence ? frame : choice.frame,
                             .file = mask_file(output, name, frame)});
    return files;
}

Scene chosen(Scene scene, const MaskChoice& choice)
{
    const auto as = [](const char* flag, const auto& choose) {
        try {
            return choose();
        } catch (const Error& error) {
            throw error.within(flag);
        }
    };
    if (choice.frame != 0) scene = as("--frame", [&] { return only_frame(std::move(scene), choice.frame); });
    if (!choice.light.empty()) scene = as("--light", [&] { return only_light(std::move(scene), choice.light); });
    return scene;
}

} // namespace penumbra::cli
