// Which files a glTF names that count for shadows: its buffers, and the images that cut out what it draws.
#pragma once

#include <charconv>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <penumbra/client/obj_files.hpp>

namespace penumbra::client::detail {

// The member or element there; null where there is none. What a file has wrong is left to the service to refuse.
inline const nlohmann::json& at(const nlohmann::json& value, const char* key)
{
    static const nlohmann::json none;
    const auto found = value.find(key);
    return value.is_object() && found != value.end() ? *found : none;
}
inline const nlohmann::json& at(const nlohmann::json& value, const nlohmann::json& index)
{
    static const nlohmann::json none;
    if (!value.is_array() || !index.is_number_unsigned() || index.get<std::uint64_t>() >= value.size()) return none;
    return value[index.get<std::size_t>()];
}

// The JSON of a glTF: all of it, or the first chunk of a GLB, behind 12 bytes and the chunk's own 8.
inline std::string_view gltf_json(std::string_view bytes)
{
    if (!bytes.starts_with("glTF")) return without_mark(bytes);
    if (bytes.size() < 20) return {};
    std::size_t size = 0;
    for (std::size_t i = 4; i-- > 0;) size = size << 8 | static_cast<unsigned char>(bytes[12 + i]);
    return bytes.substr(20, size);
}

inline std::string percent_decoded(std::string_view uri)
{
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        unsigned char c = 0;
        const bool coded = uri[i] == '%' && i + 2 < uri.size() &&
                           std::from_chars(uri.data() + i + 1, uri.data() + i + 3, c, 16).ptr == uri.data() + i + 3;
        text.push_back(coded ? static_cast<char>(c) : uri[i]);
        if (coded) i += 2;
    }
    return text;
}

inline void add_uri(const nlohmann::json& holder, std::vector<NamedFile>& files)
{
    const nlohmann::json& uri = at(holder, "uri");
    if (!uri.is_string()) return;
    const auto& text = uri.get_ref<const std::string&>();
    if (!text.empty() && !text.starts_with("data:")) files.push_back({percent_decoded(text), true});
}

// The materials that primitives have.
inline std::set<nlohmann::json> materials_in_use(const nlohmann::json& gltf)
{
    std::set<nlohmann::json> used;
    for (const nlohmann::json& mesh : at(gltf, "meshes"))
        for (const nlohmann::json& primitive : at(mesh, "primitives")) used.insert(at(primitive, "material"));
    return used;
}

inline std::vector<NamedFile> files_of_gltf(std::string_view bytes)
{
    const nlohmann::json gltf = nlohmann::json::parse(gltf_json(bytes), nullptr, false);
    std::vector<NamedFile> files;
    for (const nlohmann::json& buffer : at(gltf, "buffers")) add_uri(buffer, files);
    for (const nlohmann::json& index : materials_in_use(gltf)) {
        const nlohmann::json& material = at(at(gltf, "materials"), index);
        if (at(material, "alphaMode") != "MASK") continue;
        const nlohmann::json& texture = at(at(gltf, "textures"), at(at(at(material, "pbrMetallicRoughness"), "baseColorTexture"), "index"));
        add_uri(at(at(gltf, "images"), at(texture, "source")), files);
    }
    return files;
}

} // namespace penumbra::client::detail
