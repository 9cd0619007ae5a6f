#include "http/describe.hpp"

#include <nlohmann/json.hpp>

#include "engine/report.hpp"

namespace penumbra::server {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* dialect = "https://json-schema.org/draft/2020-12/schema";

std::string text_of(const Json& json) { return json.dump(2, ' ', true, Json::error_handler_t::replace) + "\n"; }

// The `technique` section of a scene.
Json schema_of(const TechniqueRow& row)
{
    Json properties = {{"kind", {{"const", row.kind}}}};
    for (const SettingKey& key : row.keys) {
        Json schema = domain_json(key);
        schema["default"] = default_json(key, row);
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
    for (const TechniqueRow& row : technique_table()) {
        list.push_back(json_of(row));
        list.back()["schema"] = schema_of(row);
    }
    return text_of({{"techniques", list}});
}

std::string devices_json(const std::vector<DeviceInfo>& devices, int selected)
{
    Json list = Json::array();
    for (const DeviceInfo& device : devices) list.push_back(json_of(device, device.index == selected));
    return text_of({{"version", version()}, {"devices", list}});
}

} // namespace penumbra::server
