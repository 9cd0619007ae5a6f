// The parts of a scene file, each in a file of its own.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/depth_channel.hpp"
#include "io/json_value.hpp"
#include <penumbra/scene_file.hpp>
#include "scene/depth.hpp"

namespace penumbra {

// What `read` gives; its errors are found under the key of `value`.
template <class Read> auto under(const JsonValue& value, const Read& read)
{
    try {
        return read();
    } catch (const Error& error) {
        throw error.under(value.key());
    }
}

// Lights (scene_light.cpp); emission images come through `resources`. What is wrong with a light is told under the key of `value`. A member
// of `lights` may have the keys of SceneLight as well, which are left to others.
Light parse_light(const JsonValue& value, const Resources& resources, bool listed = false);

// Of every light its name and weight (scene_lights.cpp); nothing is loaded.
std::vector<SceneLight> parse_light_names(const JsonValue& value);

// `light` or `lights`, whichever of the two the scene has, into `scene` (scene_lights.cpp). Throws unless there is exactly one of them.
void parse_lights(const JsonObject& root, const Resources& resources, Scene& scene);

// What lights cannot share is refused, before images and meshes are read: their own view, for receivers and in objects. And `occluders`,
// of each light or shared (scene_lights.cpp).
void check_shared_views(const JsonObject& root);
void parse_all_occluders(const JsonObject& root, const Resources& resources, Scene& scene);

// The scene's light, or the first of its lights.
const Light& first_light(const Scene& scene);

// Camera (scene_camera.cpp). A light's camera depends on whether the light is directional.
CameraSpec parse_camera(const JsonValue& value, const Light& light);

// Depth images (scene_depth.cpp).
struct MapEncoding {
    DepthEncoding depth;
    std::string channel; // empty: found by itself
    PartChoice part;
};
MapEncoding parse_encoding(const JsonValue& value);

// An image of depth, or of positions.
struct DepthFile {
    JsonValue name;
    bool positions = false;
};

// The map that a file stands for, of what `camera` sees: the file's frame, neither more nor less. A pinhole takes the image's pixel aspect.
DepthMap load_depth(const DepthFile& file, const MapEncoding& encoding, CameraSpec& camera, const Resources& resources,
                    std::vector<std::string>& warnings);

// All that a file holds, beyond its frame as well, with the camera that sees that. A light's camera needs all its parts.
struct SeenDepth {
    DepthMap map;
    Camera camera;
};
SeenDepth load_whole_depth(const DepthFile& file, const MapEncoding& encoding, const JsonValue& camera, const Light& light, const Resources& resources,
                           std::vector<std::string>& warnings);

// A warning about an image without a single depth, with what its values look like.
std::string nothing_in(const DepthFile& file, const MapEncoding& encoding, const Resources& resources);

Occluders parse_occluders(const JsonValue& value, const Light& light, const Resources& resources, std::vector<std::string>& warnings);
Receivers parse_receivers(const JsonValue& value, const Light& light, const Resources& resources, std::vector<std::string>& warnings);

// Technique and output (scene_file.cpp).
TechniqueRequest parse_technique(const JsonValue& value);
TechniqueRequest default_technique(const JsonObject& root); // of a scene that names none
OutputFormat parse_output(const JsonValue& value);

// Objects (scene_objects.cpp).
Object parse_object(const JsonValue& value, const Light& light, const Resources& resources, std::vector<std::string>& warnings);

// What `name` stands for; errors name the key.
Bytes load_bytes(const JsonValue& name, const Resources& resources);

} // namespace penumbra
