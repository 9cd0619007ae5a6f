#include <penumbra/describe.hpp>

#include <set>

#include <nlohmann/json.hpp>

#include "engine/report.hpp"
#include "engine/state.hpp"
#include "opencl/machine_memory.hpp"
#include "opencl/quirks.hpp"

namespace penumbra {
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

// The values of a flag or choice but the default.
std::vector<SettingValue> other_values(const SettingKey& key, const Technique& defaults)
{
    const SettingValue usual = key.get(defaults);
    if (std::holds_alternative<Flag>(key.domain)) return {SettingValue{!std::get<bool>(usual)}};
    std::vector<SettingValue> values;
    if (const auto* choices = std::get_if<Choices>(&key.domain))
        for (const std::string_view name : choices->names)
            if (SettingValue value{std::string(name)}; value != usual) values.push_back(std::move(value));
    return values;
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

namespace {

bool go_together(const Technique& technique)
{
    try {
        check_together_of(technique);
        return true;
    } catch (const Error&) {
        return false;
    }
}

// The technique, with another value of one more of its keys where it has to have one.
Technique with_what_goes_along(const TechniqueRow& row, const SettingKey& chosen, const Technique& technique)
{
    if (go_together(technique)) return technique;
    for (const SettingKey& key : row.keys) {
        if (key.name == chosen.name) continue;
        for (const SettingValue& value : other_values(key, row.defaults)) {
            Technique changed = technique;
            key.set(changed, value);
            if (go_together(changed)) return changed;
        }
    }
    throw Error(ErrorCode::internal, std::string(row.kind) + "." + std::string(chosen.name) + " goes together with nothing");
}

} // namespace

std::vector<Technique> technique_choices()
{
    std::vector<Technique> all;
    for (const TechniqueRow& row : technique_table()) {
        all.push_back(row.defaults);
        for (const SettingKey& key : row.keys)
            for (const SettingValue& value : other_values(key, row.defaults)) {
                Technique technique = row.defaults;
                key.set(technique, value);
                all.push_back(with_what_goes_along(row, key, technique));
            }
    }
    return all;
}

std::uint64_t device_bytes(std::span<const Prepared> prepared)
{
    // Frames of a sequence share some of what they hold.
    std::set<const opencl::MemoryMeter*> meters;
    for (const Prepared& one : prepared) meters.insert({one.state().memory.get(), one.state().shared.get()});
    std::uint64_t bytes = 0;
    for (const opencl::MemoryMeter* meter : meters)
        if (meter) bytes += meter->live;
    return bytes;
}

void prepare_environment() { opencl::prepare_environment(); }

std::uint64_t machine_memory() { return opencl::machine_memory(); }

std::vector<std::string> environment_warnings(const DeviceInfo& device)
{
    return opencl::is_pocl(device.platform) ? opencl::environment_warnings() : std::vector<std::string>();
}

} // namespace penumbra
