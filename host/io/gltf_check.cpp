#include "io/gltf_check.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <string>

#include <nlohmann/json.hpp>

#include "io/polygon_soup.hpp"

namespace penumbra {

namespace {

using Json = nlohmann::json;

enum class Kind { index, size, number, text, flag, object, indices, numbers, objects, index_map };

bool is_index(const Json& value)
{
    return value.is_number_unsigned() && value.get<std::uint64_t>() <= static_cast<std::uint64_t>(std::numeric_limits<int>::max());
}

bool is_of(const Json& value, Kind kind)
{
    const auto all = [&](const auto& test) { return std::ranges::all_of(value, test); };
    switch (kind) {
    case Kind::index:
        return is_index(value);
    case Kind::size:
        return value.is_number_unsigned();
    case Kind::number:
        return value.is_number();
    case Kind::text:
        return value.is_string();
    case Kind::flag:
        return value.is_boolean();
    case Kind::object:
        return value.is_object();
    case Kind::indices:
        return value.is_array() && all(is_index);
    case Kind::numbers:
        return value.is_array() && all([](const Json& entry) { return entry.is_number(); });
    case Kind::objects:
        return value.is_array() && all([](const Json& entry) { return entry.is_object(); });
    case Kind::index_map:
        return value.is_object() && all(is_index);
    }
    return false;
}

std::string_view name_of(Kind kind)
{
    constexpr std::array<std::string_view, 10> names{"a number from 0",   "a number from 0",     "a number",          "a text",
                                                     "true or false",     "an object",           "a list of indices", "a list of numbers",
                                                     "a list of objects", "an object of indices"};
    return names[static_cast<std::size_t>(kind)];
}

struct Rule {
    std::string_view key;
    Kind kind;
};

template <std::size_t count>
void check(const Json& object, const std::array<Rule, count>& rules, const std::string& place, std::string_view where)
{
    for (const Rule& rule : rules) {
        const auto found = object.find(rule.key);
        if (found == object.end() || is_of(*found, rule.kind)) continue;
        throw broken_mesh(where, "has " + place + std::string(rule.key) + " that is not " + std::string(name_of(rule.kind)));
    }
}

constexpr std::array root_rules{Rule{"scene", Kind::index},         Rule{"scenes", Kind::objects},    Rule{"nodes", Kind::objects},
                                Rule{"meshes", Kind::objects},      Rule{"skins", Kind::objects},     Rule{"accessors", Kind::objects},
                                Rule{"bufferViews", Kind::objects}, Rule{"materials", Kind::objects}, Rule{"textures", Kind::objects},
                                Rule{"samplers", Kind::objects}};
constexpr std::array scene_rules{Rule{"nodes", Kind::indices}};
constexpr std::array node_rules{Rule{"mesh", Kind::index},          Rule{"skin", Kind::index},      Rule{"children", Kind::indices},
                                Rule{"matrix", Kind::numbers},      Rule{"scale", Kind::numbers},   Rule{"rotation", Kind::numbers},
                                Rule{"translation", Kind::numbers}, Rule{"weights", Kind::numbers}, Rule{"extensions", Kind::object}};
constexpr std::array mesh_rules{Rule{"primitives", Kind::objects}, Rule{"weights", Kind::numbers}};
constexpr std::array primitive_rules{Rule{"attributes", Kind::index_map}, Rule{"indices", Kind::index}, Rule{"material", Kind::index},
                                     Rule{"mode", Kind::index}, Rule{"targets", Kind::objects}};
constexpr std::array skin_rules{Rule{"joints", Kind::indices}, Rule{"inverseBindMatrices", Kind::index}};
constexpr std::array accessor_rules{Rule{"bufferView", Kind::index}, Rule{"byteOffset", Kind::size}, Rule{"componentType", Kind::index},
                                    Rule{"count", Kind::size},       Rule{"type", Kind::text},       Rule{"normalized", Kind::flag},
                                    Rule{"sparse", Kind::object}};
constexpr std::array sparse_rules{Rule{"count", Kind::index}, Rule{"indices", Kind::object}, Rule{"values", Kind::object}};
constexpr std::array part_rules{Rule{"bufferView", Kind::index}, Rule{"byteOffset", Kind::index}, Rule{"componentType", Kind::index}};
constexpr std::array view_rules{Rule{"buffer", Kind::index}, Rule{"byteOffset", Kind::size}, Rule{"byteLength", Kind::size},
                                Rule{"byteStride", Kind::size}};
constexpr std::array material_rules{Rule{"alphaMode", Kind::text}, Rule{"alphaCutoff", Kind::number},
                                    Rule{"pbrMetallicRoughness", Kind::object}};
constexpr std::array texture_rules{Rule{"source", Kind::index}, Rule{"sampler", Kind::index}};
constexpr std::array sampler_rules{Rule{"wrapS", Kind::index}, Rule{"wrapT", Kind::index}, Rule{"magFilter", Kind::index}};

// Calls then(entry, "nodes[3].") for each entry of a list, once its keys are right.
template <std::size_t count, class Then> void check_list(const Json& holder, std::string_view list, const std::array<Rule, count>& rules,
                                                         const std::string& place, std::string_view where, const Then& then)
{
    const auto found = holder.find(list);
    if (found == holder.end()) return;
    for (std::size_t i = 0; i < found->size(); ++i) {
        const std::string at = place + std::string(list) + "[" + std::to_string(i) + "].";
        check((*found)[i], rules, at, where);
        then((*found)[i], at);
    }
}

void check_sparse(const Json& accessor, const std::string& place, std::string_view where)
{
    const auto sparse = accessor.find("sparse");
    if (sparse == accessor.end()) return;
    check(*sparse, sparse_rules, place + "sparse.", where);
    for (const char* part : {"indices", "values"})
        if (sparse->contains(part)) check((*sparse)[part], part_rules, place + "sparse." + part + ".", where);
}

void check_targets(const Json& primitive, const std::string& place, std::string_view where)
{
    constexpr std::array rules{Rule{"POSITION", Kind::index}};
    check_list(primitive, "targets", rules, place, where, [](const Json&, const std::string&) {});
}

} // namespace

void check_gltf_types(const Json& document, std::string_view where)
{
    const auto nothing_more = [](const Json&, const std::string&) {};
    check(document, root_rules, "", where);
    check_list(document, "scenes", scene_rules, "", where, nothing_more);
    check_list(document, "nodes", node_rules, "", where, nothing_more);
    check_list(document, "meshes", mesh_rules, "", where, [&](const Json& mesh, const std::string& place) {
        check_list(mesh, "primitives", primitive_rules, place, where,
                   [&](const Json& primitive, const std::string& at) { check_targets(primitive, at, where); });
    });
    check_list(document, "skins", skin_rules, "", where, nothing_more);
    check_list(document, "accessors", accessor_rules, "", where,
               [&](const Json& accessor, const std::string& place) { check_sparse(accessor, place, where); });
    check_list(document, "bufferViews", view_rules, "", where, nothing_more);
    check_list(document, "materials", material_rules, "", where, nothing_more);
    check_list(document, "textures", texture_rules, "", where, nothing_more);
    check_list(document, "samplers", sampler_rules, "", where, nothing_more);
}

} // namespace penumbra
