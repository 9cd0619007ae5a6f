// The report as JSON. Keys and their order are the contract's (section 3); `pairs` is an addition and left out when it means nothing.
#include <penumbra/engine.hpp>

#include <nlohmann/json.hpp>

namespace penumbra {

using Json = nlohmann::ordered_json;

std::string report_json(const Report& report)
{
    Json settings = Json::object();
    for (const auto& [key, value] : report.settings) settings[key] = std::visit([](const auto& held) { return Json(held); }, value);

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
    json["warnings"] = report.warnings;

    // Drivers and file names may hold bytes that are no UTF-8; those become U+FFFD rather than an error.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace penumbra
