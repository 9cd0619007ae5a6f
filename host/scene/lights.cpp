#include "scene/lights.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "scene/joined.hpp"
#include "scene/light_space.hpp"

namespace penumbra {
namespace {

std::string key_of(std::size_t index) { return "lights[" + std::to_string(index) + "]"; }

[[noreturn]] void reject(std::string path, std::string what, std::string expected)
{
    throw Error::at(ErrorCode::invalid_input, std::move(path), std::move(what), std::move(expected));
}

bool is_name(std::string_view name)
{
    const auto fits = [](char c) {
        return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    };
    return !name.empty() && name.size() <= 64 && std::ranges::all_of(name, fits);
}

} // namespace

std::size_t frames_of(const Light& light)
{
    const auto* rectangle = std::get_if<RectangleLight>(&light);
    return rectangle ? rectangle->frames.size() : 0;
}

Light at_frame(const Light& light, int frame)
{
    if (frames_of(light) == 0) return light;
    const RectangleLight& moving = std::get<RectangleLight>(light);
    return RectangleLight{.center = moving.center,
                          .half_u = moving.half_u,
                          .half_v = moving.half_v,
                          .emission = moving.frames.at(static_cast<std::size_t>(frame - 1))};
}

void validate_names(std::span<const SceneLight> lights)
{
    if (lights.size() > max_lights)
        throw Error::at(ErrorCode::too_large, "lights", "are " + std::to_string(lights.size()),
                        "expected at most " + std::to_string(max_lights));
    std::set<std::string_view> names;
    bool shines = false;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const auto& [name, weight, light, occluders] = lights[i];
        if (!is_name(name)) reject(key_of(i) + ".name", "is no name", "expected 1 to 64 of A-Z a-z 0-9 _ -");
        if (!names.insert(name).second) reject(key_of(i) + ".name", name + " is the name of an earlier light", "expected another");
        if (!std::isfinite(weight) || weight < 0)
            reject(key_of(i) + ".weight", "is " + std::to_string(weight), "expected a finite number, 0 or more");
        shines |= weight > 0;
    }
    // A sum beyond double has no mean.
    double sum = 0;
    for (const SceneLight& light : lights) sum += light.weight;
    if (!lights.empty() && !shines) reject("lights", "have weight 0, all of them", "expected a weight above 0");
    if (!std::isfinite(sum)) reject("lights", "have weights with a sum beyond double", "expected smaller ones");
}

void validate_frames(std::span<const SceneLight> lights)
{
    std::size_t first = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const std::size_t frames = frames_of(lights[i].light);
        if (frames == 0) continue;
        const std::size_t expected = frames_of(lights[first].light);
        if (expected == 0) first = i;
        if (expected != 0 && frames != expected)
            reject(key_of(i) + ".emission", "has " + std::to_string(frames) + " frames",
                   "expected " + std::to_string(expected) + " as in " + key_of(first) + ".emission, or one image");
    }
}

void validate_occluders(const Scene& scene)
{
    const auto sharing = std::ranges::count_if(scene.lights, [](const SceneLight& light) { return !light.occluders; });
    const Occluders& shared = scene.occluders;
    const bool maps = shared.front || shared.back || !shared.layers.empty();
    if (sharing > 1 && maps && std::holds_alternative<LightCamera>(shared.camera))
        reject("occluders.depth", "is seen from one light, and " + std::to_string(sharing) + " lights share it",
               "expected it in the occluders of the light that it was rendered from, such as lights[0].occluders");
}

void validate_lights(const Scene& scene)
{
    if (scene.lights.empty()) return validate(scene.light);
    validate_names(scene.lights);
    for (std::size_t i = 0; i < scene.lights.size(); ++i) validate(scene.lights[i].light, key_of(i));
    validate_frames(scene.lights);
    if (scene.lights.size() > 1 && std::holds_alternative<LightCamera>(scene.receivers.camera))
        reject("receivers.camera", "is the light's own, and there are " + std::to_string(scene.lights.size()) + " lights",
               "expected kind \"pinhole\": all masks have one viewpoint and the lights have not");
    validate_occluders(scene);
}

Error in_list(const Error& error, std::size_t index, bool own_occluders)
{
    const std::string& path = error.path();
    const auto starts = [&path](std::string_view section) {
        return path.starts_with(section) && (path.size() == section.size() || path[section.size()] == '.' || path[section.size()] == '[');
    };
    if (starts("light")) return error.with_path(key_of(index) + path.substr(std::string_view("light").size()));
    if (own_occluders && starts("occluders")) return error.under(key_of(index));
    if (starts("receivers") || starts("objects")) return error;
    return error.within(key_of(index));
}

int frame_count(const Scene& scene)
{
    std::size_t most = frames_of(scene.light);
    if (!scene.lights.empty()) most = 0;
    for (const SceneLight& light : scene.lights) most = std::max(most, frames_of(light.light));
    return static_cast<int>(most);
}

Scene only_light(Scene scene, std::string_view name)
{
    const auto found = std::ranges::find(scene.lights, name, &SceneLight::name);
    if (found == scene.lights.end())
        throw Error::at(ErrorCode::usage, "lights", "none has the name " + std::string(name),
                        scene.lights.empty() ? "the scene has one light, without a name"
                                             : "there are: " + joined(scene.lights, &SceneLight::name));
    scene.light = std::move(found->light);
    if (found->occluders) scene.occluders = std::move(*found->occluders);
    scene.lights.clear();
    return scene;
}

Scene only_frame(Scene scene, int frame)
{
    const int count = frame_count(scene);
    if (frame < 1 || frame > count)
        throw Error(ErrorCode::usage, "there is no frame " + std::to_string(frame),
                    count == 0 ? "the scene has no sequence" : "expected 1 to " + std::to_string(count));
    if (frames_of(scene.light) > 0) scene.light = at_frame(scene.light, frame);
    for (SceneLight& light : scene.lights)
        if (frames_of(light.light) > 0) light.light = at_frame(light.light, frame);
    return scene;
}

} // namespace penumbra
