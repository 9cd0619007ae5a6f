// Scene files as `penumbra mask` reads them: names relative to the file become parts of the request.
#pragma once

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <penumbra/client/file_places.hpp>
#include <penumbra/client/images.hpp>
#include <penumbra/client/json_document.hpp>
#include <penumbra/client/mesh_files.hpp>
#include <penumbra/client/parts.hpp>

namespace penumbra::client {

struct SceneFile {
    nlohmann::json scene;
    Images images;
};

namespace detail {

// The values at a place of file_places in `value`. What is no text where a name belongs is left to the service to refuse.
inline void find_files(nlohmann::json& value, std::string_view place, std::vector<nlohmann::json*>& found)
{
    if (place.empty()) {
        if (value.is_string()) found.push_back(&value);
    } else if (place.starts_with("[]") || place.starts_with("{}")) {
        if (place.starts_with('[') ? !value.is_array() : !value.is_object()) return;
        place.remove_prefix(place.substr(2).starts_with('.') ? 3 : 2);
        for (nlohmann::json& element : value) find_files(element, place, found);
    } else {
        const std::size_t end = std::min(place.find_first_of(".[{"), place.size());
        const auto member = value.is_object() ? value.find(std::string(place.substr(0, end))) : value.end();
        if (member == value.end()) return;
        place.remove_prefix(end);
        if (place.starts_with('.')) place.remove_prefix(1);
        find_files(*member, place, found);
    }
}

} // namespace detail

// Reads every file that the scene names, relative to `folder`, and renames them in the scene to what they are called in the request: their
// last component; of two files that would get one name, the second becomes name-2.exr. The files that meshes name (OBJ's .mtl and what that
// cuts out with, glTF's .bin and cut-outs) go with them; where their parts have other names the mesh's `files` says so. Throws
// std::system_error naming the file.
inline Images take_files(nlohmann::json& scene, const std::filesystem::path& folder)
{
    detail::Parts parts;
    const std::vector<detail::MeshObject> meshes = detail::meshes_of(scene, folder);
    std::vector<nlohmann::json*> found;
    for (const std::string_view place : detail::file_places) detail::find_files(scene, place, found);
    for (nlohmann::json* value : found) *value = parts.part_of(folder / value->get<std::string>());
    detail::add_mesh_files(meshes, parts);
    return parts.take();
}

// Throws std::invalid_argument for what is not JSON or has a key twice in one object, std::system_error for files that cannot be read.
inline SceneFile load_scene_file(const std::filesystem::path& path)
{
    SceneFile file;
    try {
        file.scene = detail::json_document(file_bytes(path));
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(path.string() + ": " + error.what());
    }
    file.images = take_files(file.scene, path.parent_path());
    return file;
}

} // namespace penumbra::client
