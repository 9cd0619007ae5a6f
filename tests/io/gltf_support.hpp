// glTF files made in code.
#pragma once

#include <cstring>
#include <initializer_list>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/gltf.hpp"
#include "io/mesh_io.hpp"
#include "io/support.hpp"

namespace penumbra::test {

using nlohmann::json;

// One buffer that grows, and the views and accessors into it.
class Gltf {
public:
    json root = {{"asset", {{"version", "2.0"}}}};

    template <class Number> int view(const std::vector<Number>& numbers, int stride = 0)
    {
        while (bytes_.size() % 4 != 0) bytes_.push_back('\0');
        json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", numbers.size() * sizeof(Number)}};
        if (stride > 0) view["byteStride"] = stride;
        bytes_.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
        return push("bufferViews", view);
    }
    // `count` 0: as many elements as there are numbers for.
    template <class Number> int accessor(const std::vector<Number>& numbers, const char* type, bool normalized = false)
    {
        const std::size_t width = std::string(type) == "SCALAR" ? 1
                                  : std::string(type) == "MAT4" ? 16
                                                                : static_cast<std::size_t>(type[3] - '0');
        json accessor = {
            {"bufferView", view(numbers)}, {"componentType", component<Number>()}, {"count", numbers.size() / width}, {"type", type}};
        if (normalized) accessor["normalized"] = true;
        return push("accessors", accessor);
    }
    int push(const char* list, const json& entry)
    {
        root[list].push_back(entry);
        return static_cast<int>(root[list].size()) - 1;
    }
    // A mesh of one primitive.
    int mesh(const json& primitive) { return push("meshes", {{"primitives", {primitive}}}); }
    // A node of the default scene.
    int node(const json& node)
    {
        const int index = push("nodes", node);
        if (!root.contains("scenes")) root["scenes"] = {{{"nodes", json::array()}}};
        root["scenes"][0]["nodes"].push_back(index);
        return index;
    }

    const std::string& bytes() const { return bytes_; }
    std::string text(const std::string& uri) const
    {
        json whole = root;
        if (!bytes_.empty()) whole["buffers"] = {{{"byteLength", bytes_.size()}, {"uri", uri}}};
        return whole.dump();
    }
    std::string glb() const
    {
        json whole = root;
        whole["buffers"] = {{{"byteLength", bytes_.size()}}};
        std::string head = whole.dump(), tail = bytes_;
        head.resize((head.size() + 3) / 4 * 4, ' ');
        tail.resize((tail.size() + 3) / 4 * 4, '\0');
        const auto number = [](std::size_t n) {
            const auto little = static_cast<std::uint32_t>(n);
            return std::string(reinterpret_cast<const char*>(&little), 4);
        };
        return "glTF" + number(2) + number(12 + 8 + head.size() + 8 + tail.size()) + number(head.size()) + "JSON" + head +
               number(tail.size()) + std::string("BIN\0", 4) + tail;
    }
    // Its polygons, with `more` files beside it.
    PolygonSoup read(std::map<std::string, std::string> more = {}, std::vector<std::string>* warnings = nullptr) const
    {
        more["mesh.bin"] = bytes_;
        MeshSource source{.where = "x.gltf", .companion = {}, .warnings = warnings};
        source.companion = [&](const std::string& name) {
            if (!more.contains(name)) throw Error(ErrorCode::not_found, name + ": no such file");
            return Bytes(bytes_of(more[name]));
        };
        return decode_gltf(bytes_of(text("mesh.bin")), source);
    }

private:
    template <class Number> static int component()
    {
        if constexpr (std::is_same_v<Number, std::int8_t>) return 5120;
        if constexpr (std::is_same_v<Number, std::uint8_t>) return 5121;
        if constexpr (std::is_same_v<Number, std::int16_t>) return 5122;
        if constexpr (std::is_same_v<Number, std::uint16_t>) return 5123;
        if constexpr (std::is_same_v<Number, std::uint32_t>) return 5125;
        if constexpr (std::is_same_v<Number, float>) return 5126;
        return 0;
    }

    std::string bytes_;
};

// (0, 0, 0), (1, 0, 0), (0, 1, 0): faces +z.
inline const std::vector<float> corner_triangle{0, 0, 0, 1, 0, 0, 0, 1, 0};

// The triangle's twice area along z.
inline double turn_z(const PolygonSoup& soup, std::size_t triangle)
{
    const auto at = [&](std::size_t k) { return soup.positions[soup.corners[3 * triangle + k]]; };
    return (at(1) - at(0)).cross(at(2) - at(0)).z;
}

inline Imath::Box3d box_of(const PolygonSoup& soup)
{
    Imath::Box3d box;
    for (const std::uint32_t corner : soup.corners) box.extendBy(soup.positions[corner]);
    return box;
}

} // namespace penumbra::test
