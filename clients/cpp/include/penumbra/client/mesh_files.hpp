// The files that meshes name, as parts of the request beside them.
#pragma once

#include <cctype>
#include <cerrno>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <penumbra/client/gltf_files.hpp>
#include <penumbra/client/obj_files.hpp>
#include <penumbra/client/parts.hpp>

namespace penumbra::client::detail {

// A mesh in the scene that says nothing about its files.
struct MeshObject {
    nlohmann::json* object;
    std::filesystem::path file;
};

inline std::vector<MeshObject> meshes_of(nlohmann::json& scene, const std::filesystem::path& folder)
{
    std::vector<MeshObject> meshes;
    const auto objects = scene.is_object() ? scene.find("objects") : scene.end();
    if (objects == scene.end() || !objects->is_array()) return meshes;
    for (nlohmann::json& object : *objects) {
        const nlohmann::json& mesh = at(object, "mesh");
        if (mesh.is_string() && !object.contains("files")) meshes.push_back({&object, folder / mesh.get<std::string>()});
    }
    return meshes;
}

// JSON has no other names.
inline bool is_utf_8(const std::string& name)
{
    try {
        (void)nlohmann::json(name).dump();
    } catch (const nlohmann::json::exception&) {
        return false;
    }
    return true;
}

// The part that holds a file beside the mesh.
inline std::optional<std::string> part_of(const std::filesystem::path& mesh, const std::string& name, Parts& parts)
{
    return is_utf_8(name) ? parts.find(mesh.parent_path() / name) : std::nullopt;
}

inline std::vector<NamedFile> files_named_by(const std::filesystem::path& mesh, Parts& parts)
{
    std::string extension = mesh.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    const auto find = [&](const std::string& name) -> std::optional<std::string_view> {
        const auto part = part_of(mesh, name, parts);
        if (!part) return {};
        return parts.bytes(*part);
    };
    if (extension == ".obj") return files_of_obj(parts.bytes(parts.part_of(mesh)), find);
    if (extension == ".gltf" || extension == ".glb") return files_of_gltf(parts.bytes(parts.part_of(mesh)));
    return {};
}

[[noreturn]] inline void fail_for_missing(const std::filesystem::path& mesh, const std::string& name)
{
    const std::string quoted = nlohmann::json(name).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    throw std::system_error(is_utf_8(name) ? ENOENT : EILSEQ, std::generic_category(), mesh.string() + " names " + quoted);
}

// What a mesh's `files` have to say: parts by the names that the mesh has for them. Null where each name is the part's own, and a missing
// file's name is no part's, so that the service finds the same without. Throws std::system_error naming the mesh and a missing file.
inline nlohmann::json file_table(const std::filesystem::path& mesh, Parts& parts)
{
    nlohmann::json table = nlohmann::json::object();
    bool plain = true;
    for (const NamedFile& named : files_named_by(mesh, parts)) {
        const auto part = part_of(mesh, named.name, parts);
        if (!part && named.needed) fail_for_missing(mesh, named.name);
        if (part) table[named.name] = *part;
        const bool same = part ? *part == named.name : parts.keep_free(named.name);
        plain = plain && same;
    }
    return plain ? nlohmann::json() : table;
}

inline void add_mesh_files(const std::vector<MeshObject>& meshes, Parts& parts)
{
    std::map<std::filesystem::path, nlohmann::json> tables; // one mesh may stand in many places
    for (const MeshObject& mesh : meshes) {
        auto known = tables.find(mesh.file);
        if (known == tables.end()) known = tables.emplace(mesh.file, file_table(mesh.file, parts)).first;
        if (!known->second.is_null()) (*mesh.object)["files"] = known->second;
    }
}

} // namespace penumbra::client::detail
