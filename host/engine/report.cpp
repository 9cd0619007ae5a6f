// The report as JSON, and what it has in common with descriptions: devices, techniques, settings.
#include "engine/report.hpp"

#include <nlohmann/json.hpp>

namespace penumbra {

using Json = nlohmann::ordered_json;

namespace {

struct DomainJson {
    Json operator()(const Flag&) const { return Json::object({{"type", "boolean"}}); }
    Json operator()(const IntegerRange& range) const
    {
        return Json::object({{"type", "integer"}, {"minimum", range.low}, {"maximum", range.high}});
    }
    Json operator()(const RealRange& range) const
    {
        return Json::object({{"type", "number"}, {"minimum", range.low}, {"maximum", range.high}});
    }
    Json operator()(const Choices& choices) const { return Json::object({{"type", "string"}, {"enum", choices.names}}); }
};

Json json_of(const SettingValue& value)
{
    return std::visit([](const auto& held) { return Json(held); }, value);
}

} // namespace

Json json_of(const DeviceInfo& device, bool selected)
{
    return {{"index", device.index},
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
            {"selected", selected}};
}

Json json_of(const TechniqueRow& row)
{
    return {{"kind", row.kind},
            {"summary", row.summary},
            {"source", row.source},
            {"lights", row.lights},
            {"textured_lights", row.textured_lights},
            {"inputs", row.inputs},
            {"bounds", row.bounds}};
}

Json domain_json(const SettingKey& setting) { return std::visit(DomainJson{}, setting.domain); }

Json default_json(const SettingKey& setting, const TechniqueRow& row) { return json_of(setting.get(row.defaults)); }

// Scripts read the keys in this order; `pairs` came later and is left out when it means nothing.
std::string report_json(const Report& report)
{
    Json settings = Json::object();
    for (const auto& [key, value] : report.settings) settings[key] = json_of(value);

    Json stages = Json::array();
    for (const Stage& stage : report.stages)
        stages.push_back({{"name", stage.name}, {"ms", stage.ms}, {"device_ms", stage.device_ms}, {"bytes", stage.bytes}});

    Json json = {
        {"technique", report.technique},
        {"settings", settings},
        {"device", {{"name", report.device_name}, {"driver", report.device_driver}}},
        {"resolution", {report.width, report.height}},
        {"prepare_ms", report.prepare_ms},
        {"shade_ms", report.shade_ms},
        {"total_ms", report.total_ms},
        {"stages", stages},
        {"peak_device_bytes", report.peak_device_bytes},
    };
    if (report.pairs > 0) json["pairs"] = report.pairs;
    if (report.receivers > 0) {
        json["receivers"] = report.receivers;
        json["receivers_shaded"] = report.receivers_shaded;
    }
    if (const auto& estimate = report.error_estimate)
        json["error_estimate"] = {{"mean", estimate->mean}, {"p99", estimate->p99}, {"pixels", estimate->pixels}, {"by", estimate->by}};
    json["warnings"] = report.warnings;
    if (!report.notes.empty()) json["notes"] = report.notes;

    // Drivers and file names may hold bytes that are no UTF-8; those become U+FFFD rather than an error.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace penumbra
