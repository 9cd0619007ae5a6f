// Scene files as `penumbra mask` reads them: names relative to the file become parts of the request.
#pragma once

#include <algorithm>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <penumbra/client/file_places.hpp>
#include <penumbra/client/images.hpp>

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
    } else if (place.starts_with("[]")) {
        place.remove_prefix(place.starts_with("[].") ? 3 : 2);
        if (!value.is_array()) return;
        for (nlohmann::json& element : value) find_files(element, place, found);
    } else {
        const std::size_t end = std::min(place.find_first_of(".["), place.size());
        const auto member = value.is_object() ? value.find(std::string(place.substr(0, end))) : value.end();
        if (member == value.end()) return;
        place.remove_prefix(end);
        if (place.starts_with('.')) place.remove_prefix(1);
        find_files(*member, place, found);
    }
}

// A name for a part that is not taken: the file's own, with what the service does not allow replaced by _. At most 120 characters, so that
// a number still fits into the 128 that the service allows; the end stays, as it decides a mesh's format.
inline std::string free_name(const std::filesystem::path& file, const Images& taken)
{
    std::string base = file.filename().string();
    for (char& c : base)
        if (!is_part_name(std::string("a") + c)) c = '_';
    if (base.size() > 120) base.erase(0, base.size() - 120);
    base.erase(0, base.find_first_not_of('.'));
    if (base.empty()) base = "image";
    const std::filesystem::path name(base);
    for (int number = 2; taken.contains(base) || base == "scene"; ++number)
        base = name.stem().string() + "-" + std::to_string(number) + name.extension().string();
    return base;
}

} // namespace detail

// Reads every file that the scene names, relative to `folder`, and renames them in the scene to what they are called in the request: their
// last component; of two files that would get one name, the second becomes name-2.exr. A mesh is one file: companions of glTF (.bin) and
// OBJ (.mtl) do not travel. Throws std::system_error naming the file.
inline Images take_files(nlohmann::json& scene, const std::filesystem::path& folder)
{
    Images images;
    std::map<std::string, std::string> names; // by the file's real path
    std::vector<nlohmann::json*> found;
    for (const std::string_view place : detail::file_places) detail::find_files(scene, place, found);
    for (nlohmann::json* value : found) {
        const std::filesystem::path file = folder / value->get<std::string>();
        std::error_code ignored;
        std::string& name = names[std::filesystem::weakly_canonical(file, ignored).string()];
        if (name.empty()) {
            std::string bytes = file_bytes(file);
            name = detail::free_name(file, images);
            images.emplace(name, std::move(bytes));
        }
        *value = name;
    }
    return images;
}

// Throws std::invalid_argument for what is not JSON or has a key twice in one object, std::system_error for files that cannot be read.
inline SceneFile load_scene_file(const std::filesystem::path& path)
{
    std::vector<std::set<std::string>> open; // keys of the objects around the value that is read
    const auto unique = [&](int, nlohmann::json::parse_event_t event, nlohmann::json& value) {
        using Event = nlohmann::json::parse_event_t;
        if (event == Event::object_start) open.emplace_back();
        if (event == Event::object_end) open.pop_back();
        if (event == Event::key && !open.back().insert(value.get<std::string>()).second)
            throw std::invalid_argument(path.string() + ": the key " + value.dump() + " stands twice in one object");
        return true;
    };
    SceneFile file;
    try {
        file.scene = nlohmann::json::parse(file_bytes(path), unique);
    } catch (const nlohmann::json::exception& error) {
        throw std::invalid_argument(path.string() + ": " + error.what());
    }
    file.images = take_files(file.scene, path.parent_path());
    return file;
}

} // namespace penumbra::client
