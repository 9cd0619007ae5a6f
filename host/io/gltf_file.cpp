#include "io/gltf_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <nlohmann/json.hpp>

#include "io/gltf_check.hpp"
#include "io/uri.hpp"
#include "io/words.hpp"

namespace penumbra {

namespace {

using Json = nlohmann::json;

// tinygltf calls itself for what lies within extras: deeper ones could end its stack.
constexpr int most_nested = 100;

// What a file may require: the first four are read; the others change how surfaces look and none of their places.
constexpr std::array<std::string_view, 17> known_extensions{
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "KHR_texture_transform",
    "KHR_node_visibility",
    "KHR_lights_punctual",
    "KHR_materials_unlit",
    "KHR_materials_clearcoat",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_anisotropy",
    "KHR_materials_emissive_strength",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_techniques_webgl",
    "KHR_materials_dispersion",
};

struct Parts {
    std::string_view json;
    std::optional<std::span<const std::byte>> binary; // the second chunk of a GLB
};

std::uint32_t little_32(std::span<const std::byte> bytes, std::size_t at)
{
    std::uint32_t number = 0;
    for (std::size_t i = 4; i-- > 0;) number = number << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
    return number;
}

std::string_view text_of(std::span<const std::byte> bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

// A GLB is a header of 12 bytes and chunks, each a length, a type and its bytes: JSON, then perhaps one buffer.
Parts parts_of(std::span<const std::byte> bytes, std::string_view where)
{
    if (!text_of(bytes).starts_with("glTF")) return {without_byte_order_mark(text_of(bytes)), {}};
    if (bytes.size() < 12) throw broken_mesh(where, "is truncated: its GLB header has " + std::to_string(bytes.size()) + " of 12 bytes");
    if (const std::uint32_t version = little_32(bytes, 4); version != 2)
        throw Error(ErrorCode::unsupported, std::string(where) + " is GLB of version " + std::to_string(version), "glTF 2 is read");
    const std::size_t length = little_32(bytes, 8);
    if (length > bytes.size())
        throw broken_mesh(where, "is truncated: its GLB header counts " + std::to_string(length) + " bytes, there are " +
                                     std::to_string(bytes.size()));

    Parts parts;
    for (std::size_t at = 12; at + 8 <= length;) {
        const std::size_t size = little_32(bytes, at);
        const std::uint32_t type = little_32(bytes, at + 4);
        const bool first = at == 12;
        if (size > length - at - 8)
            throw broken_mesh(where, "has a GLB chunk of " + std::to_string(size) + " bytes that reaches beyond the file");
        const std::span<const std::byte> chunk = bytes.subspan(at + 8, size);
        if (first != (type == 0x4e4f534a)) throw broken_mesh(where, "has GLB chunks in another order than JSON, then others");
        if (first) parts.json = text_of(chunk);
        if (type == 0x004e4942 && !parts.binary) parts.binary = chunk;
        at += 8 + size;
    }
    return parts;
}

void require_shallow(std::string_view json, std::string_view where)
{
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (in_string && c == '\\') ++i;
        if (c == '"') in_string = !in_string;
        if (in_string) continue;
        depth += (c == '{' || c == '[') - (c == '}' || c == ']');
        if (depth > most_nested) throw broken_mesh(where, "has JSON nested deeper than " + std::to_string(most_nested));
    }
}

Json parsed(std::string_view text, std::string_view where)
{
    require_shallow(text, where);
    Json json = Json::parse(text, nullptr, false);
    if (!json.is_object()) throw broken_mesh(where, "is not glTF: it is no JSON object");
    const auto asset = json.find("asset");
    const Json version = asset != json.end() && asset->is_object() ? asset->value("version", Json()) : Json();
    if (!version.is_string()) throw broken_mesh(where, "is not glTF 2: it has no asset.version");
    if (!version.get_ref<const std::string&>().starts_with("2."))
        throw Error(ErrorCode::invalid_input, std::string(where) + " is glTF " + in_quotes(version.get_ref<const std::string&>()),
                    "version 2 is read");
    return json;
}

void check_extensions(const Json& json, std::string_view where)
{
    for (const Json& name : json.value("extensionsRequired", Json::array())) {
        const std::string text = name.is_string() ? name.get<std::string>() : name.dump();
        if (std::ranges::find(known_extensions, text) == known_extensions.end())
            throw Error(ErrorCode::unsupported, std::string(where) + " requires the extension " + in_quotes(text) + ", which is not read",
                        "export it without, or as OBJ or PLY");
    }
}

// A list of objects in the file; empty when it has none.
Json take_list(Json& json, const char* name, std::string_view where)
{
    const auto found = json.find(name);
    if (found == json.end()) return Json::array();
    Json list = std::move(*found);
    json.erase(found);
    const bool sound = list.is_array() && std::ranges::all_of(list, [](const Json& entry) { return entry.is_object(); });
    if (!sound) throw broken_mesh(where, std::string("has ") + name + " that is no list of objects");
    return list;
}

std::string uri_of(const Json& entry)
{
    const auto found = entry.find("uri");
    return found != entry.end() && found->is_string() ? found->get<std::string>() : std::string();
}

Bytes bytes_at(const std::string& uri, const std::string& what, const MeshSource& source)
{
    if (is_data_uri(uri)) {
        auto data = data_of(uri);
        if (!data) throw broken_mesh(source.where, "has a broken data URI in " + what);
        return Bytes(std::move(*data));
    }
    return source.open(percent_decoded(uri));
}

Bytes read_buffer(const Json& entry, std::size_t place, const Parts& parts, const MeshSource& source)
{
    const std::string what = "buffers[" + std::to_string(place) + "]", uri = uri_of(entry);
    const auto length = entry.find("byteLength");
    if (length == entry.end() || !length->is_number_unsigned()) throw broken_mesh(source.where, "has " + what + " without byteLength");
    const auto needed = length->get<std::uint64_t>();
    const bool inside = uri.empty() && place == 0 && parts.binary;
    if (uri.empty() && !inside) throw broken_mesh(source.where, "has " + what + " without uri");
    Bytes bytes = inside ? Bytes(*parts.binary) : bytes_at(uri, what, source);
    const std::span<const std::byte> all = bytes;
    if (all.size() < needed)
        throw broken_mesh(source.where,
                          "is truncated: " + what + " has " + std::to_string(all.size()) + " bytes, expected " + std::to_string(needed));
    return bytes;
}

// What shadows have nothing to do with goes before tinygltf looks at it.
void drop_unused(Json& json)
{
    for (const char* name : {"animations", "cameras", "extras", "extensionsUsed", "extensions"}) json.erase(name);
}

} // namespace

GltfFile open_gltf(std::span<const std::byte> bytes, const MeshSource& source)
{
    const Parts parts = parts_of(bytes, source.where);
    Json json = parsed(parts.json, source.where);
    check_extensions(json, source.where);
    check_gltf_types(json, source.where);

    GltfFile file{.source = source, .model = {}, .buffers = {}, .images = {}};
    const Json buffers = take_list(json, "buffers", source.where);
    for (std::size_t i = 0; i < buffers.size(); ++i) file.buffers.push_back(read_buffer(buffers[i], i, parts, source));
    for (const Json& image : take_list(json, "images", source.where)) {
        const auto view = image.find("bufferView");
        file.images.push_back({uri_of(image), view != image.end() && view->is_number_integer() ? view->get<int>() : -1});
    }

    drop_unused(json);
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    tinygltf::TinyGLTF reader;
    std::string error, warning;
    if (!reader.LoadASCIIFromString(&file.model, &error, &warning, text.data(), static_cast<unsigned>(text.size()), "")) {
        error.resize(std::min(error.find('\n'), error.size()));
        throw file.broken("cannot be read as glTF: " + one_line(std::move(error)));
    }
    return file;
}

std::span<const std::byte> view_bytes(const GltfFile& file, int index)
{
    const tinygltf::BufferView& view = file.entry(file.model.bufferViews, index, "bufferViews");
    const std::span<const std::byte> buffer = file.entry(file.buffers, view.buffer, "buffers");
    if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset)
        throw file.broken("has bufferViews[" + std::to_string(index) + "] of " + std::to_string(view.byteLength) + " bytes from " +
                          std::to_string(view.byteOffset) + " in a buffer of " + std::to_string(buffer.size()));
    return buffer.subspan(view.byteOffset, view.byteLength);
}

Bytes image_bytes(const GltfFile& file, int index)
{
    const GltfFile::Image& image = file.entry(file.images, index, "images");
    if (image.uri.empty()) return Bytes(view_bytes(file, image.buffer_view));
    return bytes_at(image.uri, "images[" + std::to_string(index) + "]", file.source);
}

} // namespace penumbra
