#include "io/scene_schema.hpp"

#include <cmath>

#include "io/scene_description.hpp"
#include "technique/table.hpp"

namespace penumbra {

using namespace scene_file;
using Json = nlohmann::ordered_json;

namespace {

// "occluder_depth" is OccluderDepth.
std::string schema_name(std::string_view name)
{
    std::string result;
    bool up = true;
    for (const char c : name) {
        if (c != '_') result += up ? static_cast<char>(c - 'a' + 'A') : c;
        up = c == '_';
    }
    return result;
}

Json array_of(Json items, std::size_t low, std::size_t high)
{
    Json schema = {{"type", "array"}, {"items", std::move(items)}};
    if (low > 0) schema["minItems"] = low;
    if (high < any_number) schema["maxItems"] = high;
    return schema;
}

// What a value may be.
struct TypeSchema {
    std::string_view prefix;

    Json reference(std::string_view name) const { return {{"$ref", std::string(prefix) + schema_name(name)}}; }

    Json operator()(const Constant& constant) const
    {
        return {{"const", std::visit([](const auto& value) { return Json(value); }, constant.value)}};
    }
    Json operator()(const Number& range) const
    {
        Json schema = {{"type", "number"}};
        if (std::isfinite(range.low)) schema[range.above_low ? "exclusiveMinimum" : "minimum"] = range.low;
        if (std::isfinite(range.high)) schema[range.below_high ? "exclusiveMaximum" : "maximum"] = range.high;
        return schema;
    }
    Json operator()(const OneOfIntegers& integers) const { return {{"type", "integer"}, {"enum", integers.values}}; }
    Json operator()(const Boolean&) const { return Json::object({{"type", "boolean"}}); }
    Json operator()(const Text& text) const
    {
        Json schema = {{"type", "string"}, {"minLength", 1}};
        if (!text.pattern.empty()) schema["pattern"] = text.pattern;
        return schema;
    }
    Json operator()(const File&) const { return {{"type", "string"}, {"minLength", 1}, {"x-file", true}}; }
    Json operator()(const Files& files) const
    {
        Json list = array_of((*this)(File{}), files.low, files.high);
        return files.or_one ? Json{{"anyOf", {(*this)(File{}), list}}} : list;
    }
    Json operator()(const FileTable&) const { return {{"type", "object"}, {"additionalProperties", (*this)(File{})}}; }
    Json operator()(const Numbers& numbers) const { return array_of((*this)(Number{}), numbers.count, numbers.count); }
    Json operator()(const LengthOrAuto&) const
    {
        return {{"anyOf", {(*this)(Number{.low = 0, .above_low = true}), Json{{"const", "auto"}}}}};
    }
    Json operator()(const NameOrNumber&) const { return {{"anyOf", {(*this)(Text{}), Json{{"type", "integer"}, {"minimum", 0}}}}}; }
    Json operator()(const Pair&) const
    {
        const Json above = (*this)(Number{.low = 0, .above_low = true});
        return {{"anyOf", {array_of(above, 2, 2), above}}};
    }
    Json operator()(const Size& size) const { return array_of({{"type", "integer"}, {"minimum", size.low}, {"maximum", size.high}}, 2, 2); }
    Json operator()(const One& one) const { return reference(one.object().name); }
    Json operator()(const List& list) const { return array_of(reference(list.object().name), list.low, list.high); }
    Json operator()(const TechniqueKeys&) const { return reference("technique"); }
};

Json schema_of(const Key& key, std::string_view prefix)
{
    Json schema = std::visit(TypeSchema{prefix}, key.type);
    schema["description"] = key.meaning;
    if (!key.unit.empty()) schema["x-unit"] = key.unit;
    if (!key.fallback.empty()) schema["default"] = Json::parse(key.fallback);
    if (!key.otherwise.empty()) schema["x-default"] = key.otherwise;
    if (!key.example.empty()) schema["examples"] = Json::array({Json::parse(key.example)});
    return schema;
}

Json schema_of(const Form& form, std::string_view prefix)
{
    Json schema = {{"type", "object"}, {"title", form.name}};
    if (!form.meaning.empty()) schema["description"] = form.meaning;
    Json required = Json::array();
    for (const Key& key : form.keys) {
        schema["properties"][std::string(key.name)] = schema_of(key, prefix);
        if (key.required) required.push_back(key.name);
    }
    if (!required.empty()) schema["required"] = required;
    schema["additionalProperties"] = false;
    for (const std::string_view key : form.exactly_one) schema["oneOf"].push_back({{"required", {key}}});
    return schema;
}

Json schema_of(const scene_file::Object& object, std::string_view prefix)
{
    Json schema = Json::object();
    if (object.forms.size() == 1) schema = schema_of(object.forms.front(), prefix);
    schema["description"] = object.meaning;
    if (object.forms.size() > 1)
        for (const Form& form : object.forms) schema["anyOf"].push_back(schema_of(form, prefix));
    return schema;
}

// What a technique's setting may be.
struct SettingSchema {
    Json operator()(const Flag&) const { return TypeSchema{}(Boolean{}); }
    Json operator()(const IntegerRange& range) const { return {{"type", "integer"}, {"minimum", range.low}, {"maximum", range.high}}; }
    Json operator()(const RealRange& range) const { return TypeSchema{}(Number{.low = range.low, .high = range.high}); }
    Json operator()(const Choices& choices) const { return {{"type", "string"}, {"enum", choices.names}}; }
};

Json schema_of(const TechniqueRow& row)
{
    Json properties = {{"kind", {{"const", row.kind}}}};
    for (const SettingKey& key : row.keys) {
        Json schema = std::visit(SettingSchema{}, key.domain);
        schema["default"] = std::visit([](const auto& value) { return Json(value); }, key.get(row.defaults));
        schema["description"] = key.meaning;
        if (!key.unit.empty()) schema["x-unit"] = key.unit;
        properties[std::string(key.name)] = schema;
    }
    return {{"type", "object"},         {"title", row.kind},    {"description", row.summary},
            {"properties", properties}, {"required", {"kind"}}, {"additionalProperties", false}};
}

} // namespace

Json scene_definitions(std::string_view prefix)
{
    Json definitions = Json::object();
    for (const scene_file::Object* object : objects()) definitions[schema_name(object->name)] = schema_of(*object, prefix);
    Json technique = {{"description", "How the mask is computed. `kind` decides the other keys."}};
    for (const TechniqueRow& row : technique_table()) technique["anyOf"].push_back(schema_of(row));
    definitions["Technique"] = technique;
    return definitions;
}

std::string scene_schema_json()
{
    const Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                         {"title", "A scene of penumbra, version 1"},
                         {"$ref", "#/$defs/Scene"},
                         {"$defs", scene_definitions("#/$defs/")}};
    return schema.dump(2) + "\n";
}

} // namespace penumbra
