// The reports of several masks as one JSON.
#include <penumbra/engine.hpp>

#include <nlohmann/json.hpp>

namespace penumbra {

using Json = nlohmann::ordered_json;

std::string reports_json(const std::vector<FileReport>& reports)
{
    Json masks = Json::array();
    for (const FileReport& each : reports) {
        Json mask = {{"light", each.light.empty() ? Json() : Json(each.light)},
                     {"frame", each.frame == 0 ? Json() : Json(each.frame)},
                     {"file", each.file}};
        mask.update(Json::parse(report_json(each.report)));
        masks.push_back(std::move(mask));
    }
    const Json json = {{"masks", std::move(masks)}};
    // As in report_json: bytes of file names that are no UTF-8 become U+FFFD.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace penumbra
