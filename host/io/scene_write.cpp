// Scene files, written.
#include <nlohmann/json.hpp>

#include <penumbra/error.hpp>

#include <penumbra/scene_file.hpp>

#include "scene/camera.hpp"

namespace penumbra {

using nlohmann::ordered_json;

namespace {

ordered_json array(const Vec3& v) { return {v.x, v.y, v.z}; }
ordered_json array(const Vec2& v) { return {v.x, v.y}; }

void check_count(std::size_t count, std::size_t names, const char* what)
{
    if (count != names)
        throw Error(ErrorCode::usage, std::to_string(count) + " " + what + " and " + std::to_string(names) + " names for them");
}

template <class AxisLight> void write_axes(ordered_json& json, const AxisLight& light)
{
    json["direction"] = array(light.direction);
    if (light.up) json["up"] = array(*light.up);
}

ordered_json write(const RectangleLight& light, const LightNames& names)
{
    ordered_json json{
        {"kind", "rectangle"}, {"center", array(light.center)}, {"half_u", array(light.half_u)}, {"half_v", array(light.half_v)}};
    check_count(light.frames.size(), names.frames.size(), "frames of emission");
    if (!light.frames.empty()) json["emission"] = names.frames;
    if (light.emission && names.emission.empty()) throw Error(ErrorCode::usage, "the light's emission has no name to be written under");
    if (light.emission) json["emission"] = names.emission;
    return json;
}

ordered_json write(const SphereLight& light, const LightNames&)
{
    ordered_json json{{"kind", "sphere"}, {"center", array(light.center)}, {"radius", light.radius}};
    write_axes(json, light);
    return json;
}

ordered_json write(const PointLight& light, const LightNames&)
{
    ordered_json json{{"kind", "point"}, {"center", array(light.center)}};
    write_axes(json, light);
    return json;
}

ordered_json write(const DirectionalLight& light, const LightNames&)
{
    ordered_json json{{"kind", "directional"}, {"angular_diameter_deg", light.angular_diameter_deg}};
    write_axes(json, light);
    return json;
}

ordered_json write_camera(const CameraSpec& spec, int width, int height)
{
    if (const auto* light = std::get_if<LightCamera>(&spec)) {
        ordered_json json{{"kind", "light"}};
        if (light->tan_half_fov) json["tan_half_fov"] = array(*light->tan_half_fov);
        if (light->half_extent) json["half_extent"] = array(*light->half_extent);
        if (light->center) json["center"] = array(*light->center);
        return json;
    }
    const PinholeCamera& camera = std::get<PinholeCamera>(spec);
    const auto& [o, x, y, z] = camera.frame;
    const Camera view = pinhole_view(camera, width, height);
    ordered_json json{{"kind", "pinhole"},
                      {"world_from_camera", {x.x, y.x, z.x, o.x, x.y, y.y, z.y, o.y, x.z, y.z, z.z, o.z, 0, 0, 0, 1}},
                      {"tan_half_fov", array(view.half_extent)}};
    if (view.off_axis != Vec2(0, 0)) json["shift"] = array(view.off_axis / view.half_extent / 2.);
    return json;
}

ordered_json write_technique(const TechniqueRequest& request)
{
    ordered_json json{{"kind", request.kind}};
    for (const auto& setting : request.settings) std::visit([&](const auto& value) { json[setting.first] = value; }, setting.second);
    return json;
}

ordered_json write_occluders(const Occluders& occluders, const LightNames& names)
{
    check_count(occluders.layers.size(), names.layers.size(), "layers of occluder depth");
    ordered_json depth = ordered_json::object();
    if (!names.front.empty()) depth["front"] = names.front;
    if (!names.back.empty()) depth["back"] = names.back;
    if (!names.layers.empty()) depth["layers"] = names.layers;
    ordered_json json{{"camera", write_camera(occluders.camera, occluders.width, occluders.height)},
                      {"resolution", {occluders.width, occluders.height}}};
    if (!depth.empty()) json["depth"] = depth;
    return json;
}

ordered_json write_light(const Light& light, const LightNames& names)
{
    return std::visit([&](const auto& kind) { return write(kind, names); }, light);
}

ordered_json write_listed(const SceneLight& light, const LightNames& names)
{
    ordered_json json{{"name", light.name}, {"weight", light.weight}};
    json.update(write_light(light.light, names));
    if (light.occluders) json["occluders"] = write_occluders(*light.occluders, names);
    return json;
}

ordered_json write_receivers(const Receivers& receivers, const DepthNames& names)
{
    ordered_json json{{"camera", write_camera(receivers.camera, receivers.width, receivers.height)},
                      {"resolution", {receivers.width, receivers.height}}};
    if (!names.receiver.empty()) json["depth"] = names.receiver;
    return json;
}

} // namespace

std::string write_scene(const Scene& scene, const DepthNames& names)
{
    ordered_json json{{"penumbra", 1}};
    check_count(scene.lights.size(), names.lights.size(), "lights");
    bool shared = scene.lights.empty();
    if (scene.lights.empty()) json["light"] = write_light(scene.light, names);
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        json["lights"].push_back(write_listed(scene.lights[i], names.lights[i]));
        shared |= !scene.lights[i].occluders;
    }
    if (shared) json["occluders"] = write_occluders(scene.occluders, names);
    json["receivers"] = write_receivers(scene.receivers, names);
    json["technique"] = write_technique(scene.technique);
    if (!scene.output.format.empty()) {
        json["output"] = {{"format", scene.output.format}};
        if (scene.output.bits != 0) json["output"]["bits"] = scene.output.bits;
    }
    // Names may be any bytes that a file system takes.
    return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

} // namespace penumbra
