#include "describe.hpp"

#include <array>

#include <nlohmann/json.hpp>

#include "masks.hpp"
#include "problem.hpp"
#include "technique/table.hpp"

namespace penumbra::server {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* dialect = "https://json-schema.org/draft/2020-12/schema";

constexpr std::array route_list{
    Route{"POST", "/v1/masks", "Compute the mask of a scene.", "", false},
    Route{"GET", "/v1/techniques", "Each technique with its keys as JSON Schema, its lights and what it needs.", "application/json", false},
    Route{"GET", "/v1/devices", "The OpenCL devices of the machine; `selected` is the one that computes.", "application/json", false},
    Route{"GET", "/healthz", "The process answers.", "text/plain", true},
    Route{"GET", "/readyz", "A known mask was computed and compared, every technique is warm, and the service is not about to end.",
          "text/plain", true},
    Route{"GET", "/metrics", "Prometheus metrics.", "text/plain", false},
    Route{"GET", "/openapi.json", "This description.", "application/json", false},
};

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

Json problem_answer(int status)
{
    return {{"description", title_of(status)}, {"content", {{problem_type, {{"schema", {{"$ref", "#/components/schemas/Problem"}}}}}}}};
}

Json mask_operation(const Route& route, const Options& options)
{
    const Json binary = {{"type", "string"}, {"format", "binary"}};
    const Json form = {
        {"type", "object"},
        {"description", "Part `scene` is the scene's JSON; every image that it names is a part of that name, an EXR, PNG, TIFF or PFM."},
        {"properties", {{"scene", {{"type", "object"}, {"description", "a scene file, version 1"}}}}},
        {"additionalProperties", binary},
        {"required", {"scene"}},
        {"maxProperties", options.parts}};
    Json content = Json::object(), responses = Json::object();
    for (const MaskFormat& format : mask_formats()) content[std::string(format.media_type)] = {{"schema", binary}};
    const auto header = [](const char* meaning) { return Json{{"description", meaning}, {"schema", {{"type", "string"}}}}; };
    responses["200"] = {{"description", "the mask: visibility, linear, 1 fully lit"},
                        {"headers",
                         {{"Server-Timing", header("stages with milliseconds")},
                          {"X-Request-Id", header("the request's id")},
                          {"Penumbra-Warnings", header("JSON array of what was assumed or looks wrong; absent when there is nothing")}}},
                        {"content", content}};
    for (const int status : {400, 401, 406, 408, 411, 413, 415, 422, 431, 500, 503, 504})
        responses[std::to_string(status)] = problem_answer(status);
    return {{"summary", route.summary},
            {"requestBody", {{"required", true}, {"content", {{"multipart/form-data", {{"schema", form}}}}}}},
            {"responses", responses}};
}

Json operation_of(const Route& route, const Options& options)
{
    Json operation;
    if (route.media_type.empty()) {
        operation = mask_operation(route, options);
    } else {
        const Json schema = route.media_type == "application/json" ? Json{{"type", "object"}} : Json{{"type", "string"}};
        operation = {
            {"summary", route.summary},
            {"responses", {{"200", {{"description", "as asked"}, {"content", {{std::string(route.media_type), {{"schema", schema}}}}}}}}}};
        if (!route.open) operation["responses"]["401"] = problem_answer(401);
        if (route.path == "/readyz") operation["responses"]["503"] = problem_answer(503);
    }
    if (route.open || options.token.empty()) operation["security"] = Json::array();
    return operation;
}

} // namespace

std::span<const Route> routes() { return route_list; }

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

std::string openapi_json(const Options& options)
{
    Json paths = Json::object();
    for (const Route& route : routes())
        paths[std::string(route.path)][route.method == "GET" ? "get" : "post"] = operation_of(route, options);
    const Json problem = {{"type", "object"},
                          {"properties",
                           {{"type", {{"type", "string"}}},
                            {"title", {{"type", "string"}}},
                            {"status", {{"type", "integer"}}},
                            {"detail", {{"type", "string"}}},
                            {"reason", {{"type", "string"}}},
                            {"retry_after", {{"type", "integer"}}},
                            {"request_id", {{"type", "string"}}}}},
                          {"required", {"type", "title", "status", "detail", "reason"}}};
    return text_of(
        {{"openapi", "3.1.0"},
         {"info", {{"title", "penumbra"}, {"version", version()}, {"description", "Soft-shadow masks from depth maps."}}},
         {"paths", paths},
         {"components", {{"schemas", {{"Problem", problem}}}, {"securitySchemes", {{"bearer", {{"type", "http"}, {"scheme", "bearer"}}}}}}},
         {"security", Json::array({{{"bearer", Json::array()}}})}});
}

} // namespace penumbra::server
