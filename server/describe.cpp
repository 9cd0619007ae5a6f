#include "describe.hpp"

#include <nlohmann/json.hpp>

#include "technique/table.hpp"

namespace penumbra::server {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* dialect = "https://json-schema.org/draft/2020-12/schema";

std::string text_of(const Json& json) { return json.dump(2, ' ', true, Json::error_handler_t::replace) + "\n"; }

struct DomainSchema {
    Json& schema;
    void operator()(const Flag&) const { schema["type"] = "boolean"; }
    void operator()(const IntegerRange& range) const
    {
        schema.update({{"type", "integer"}, {"minimum", range.low}, {"maximum", range.high}});
    }
    void operator()(const RealRange& range) const { schema.update({{"type", "number"}, {"minimum", range.low}, {"maximum", range.high}}); }
    void operator()(const Choices& choices) const { schema.update({{"type", "string"}, {"enum", choices.names}}); }
};

// The `technique` section of a scene.
Json schema_of(const TechniqueRow& row)
{
    Json properties = {{"kind", {{"const", row.kind}}}};
    for (const SettingKey& key : row.keys) {
        Json schema = Json::object();
        std::visit(DomainSchema{schema}, key.domain);
        schema["default"] = std::visit([](const auto& value) { return Json(value); }, key.get(row.defaults));
        schema["description"] = key.meaning;
        if (!key.unit.empty()) schema["x-unit"] = key.unit;
        properties[std::string(key.name)] = schema;
    }
    return {{"$schema", dialect},           {"type", "object"},         {"title", row.kind},
            {"description", row.summary},   {"properties", properties}, {"required", {"kind"}},
            {"additionalProperties", false}};
}

} // namespace

std::string techniques_json()
{
    Json list = Json::array();
    for (const TechniqueRow& row : technique_table())
        list.push_back({{"kind", row.kind},
                        {"summary", row.summary},
                        {"source", row.source},
                        {"lights", row.lights},
                        {"textured_lights", row.textured_lights},
                        {"inputs", row.inputs},
                        {"schema", schema_of(row)}});
    return text_of({{"techniques", list}});
}

std::string devices_json(const std::vector<DeviceInfo>& devices, int selected)
{
    Json list = Json::array();
    for (const DeviceInfo& device : devices)
        list.push_back({{"index", device.index},
                        {"name", device.name},
                        {"vendor", device.vendor},
                        {"driver", device.driver},
                        {"version", device.version},
                        {"platform", device.platform},
                        {"type", device.type},
                        {"compute_units", device.compute_units},
                        {"global_bytes", device.global_bytes},
                        {"max_allocation_bytes", device.max_allocation_bytes},
                        {"local_bytes", device.local_bytes},
                        {"max_work_group", device.max_work_group},
                        {"lanes", device.lanes},
                        {"selected", device.index == selected}});
    return text_of({{"version", version()}, {"devices", list}});
}

} // namespace penumbra::server
