// The parts of a scene file, each in a file of its own.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/json_value.hpp"
#include "io/scene_file.hpp"
#include "scene/depth.hpp"

namespace penumbra {

// Light (scene_light.cpp); the emission image comes through `resources`.
Light parse_light(const JsonValue& value, const Resources& resources);

// Camera (scene_camera.cpp). A light's camera depends on whether the light is directional.
CameraSpec parse_camera(const JsonValue& value, const Light& light);

// Depth images (scene_depth.cpp).
struct MapEncoding {
    DepthEncoding depth;
    std::string channel; // empty: found by itself
};
MapEncoding parse_encoding(const JsonValue& value);

// The map that `name` stands for. `camera` gives the tangents that radial depth needs.
DepthMap load_depth(const JsonValue& name, const MapEncoding& encoding, const CameraSpec& camera, const Resources& resources,
                    std::vector<std::string>& warnings);

Occluders parse_occluders(const JsonValue& value, const Light& light, const Resources& resources, std::vector<std::string>& warnings);
Receivers parse_receivers(const JsonValue& value, const Light& light, const Resources& resources, std::vector<std::string>& warnings);

// Technique and output (scene_file.cpp).
TechniqueRequest parse_technique(const JsonValue& value);
OutputFormat parse_output(const JsonValue& value);

// Objects (scene_objects.cpp).
Object parse_object(const JsonValue& value, const Light& light, const Resources& resources, std::vector<std::string>& warnings);

// What `name` stands for; errors name the key.
Bytes load_bytes(const JsonValue& name, const Resources& resources);

} // namespace penumbra
