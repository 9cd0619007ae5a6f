// GET /openapi.json, from the routes.
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <penumbra/engine.hpp>
#include <penumbra/scene_file.hpp>

#include "http/describe.hpp"
#include "http/route.hpp"
#include "masks/depth_view.hpp"
#include "masks/mask_format.hpp"
#include "process/problem.hpp"

namespace penumbra::server {
namespace {

using Json = nlohmann::ordered_json;

const Json text_schema = {{"type", "string"}};
const Json object_schema = {{"type", "object"}};
const Json binary_schema = {{"type", "string"}, {"format", "binary"}};

Json reference(const char* name) { return {{"$ref", std::string("#/components/schemas/") + name}}; }

Json content(std::string_view media_type, const Json& schema) { return {{std::string(media_type), {{"schema", schema}}}}; }

void add_problems(Json& responses, const std::vector<int>& statuses)
{
    for (const int status : statuses)
        responses[std::to_string(status)] = {{"description", title_of(status)}, {"content", content(problem_type, reference("Problem"))}};
}

Json header(const char* meaning) { return {{"description", meaning}, {"schema", text_schema}}; }

// The form of a scene with its images, or of a patch with further ones.
Json form(const Json& scene, const Options& options, bool scene_needed)
{
    Json schema = {{"type", "object"},
                   {"description", "Every image that part `scene` names is a part of that name, an EXR, PNG, TIFF or PFM."},
                   {"properties", {{"scene", scene}}},
                   {"additionalProperties", binary_schema},
                   {"maxProperties", options.parts}};
    if (scene_needed) schema["required"] = {"scene"};
    return schema;
}

Json body_of(const Route& route, const Options& options)
{
    if (!route.path.ends_with("{id}/masks"))
        return {{"required", true}, {"content", content("multipart/form-data", form(reference("Scene"), options, true))}};
    Json types = content("application/json", reference("ScenePatch"));
    types.update(content("application/merge-patch+json", reference("ScenePatch")));
    types.update(content("multipart/form-data", form(reference("ScenePatch"), options, false)));
    return {{"required", false}, {"content", types}};
}

Json mask_answer()
{
    Json formats = Json::object();
    for (const MaskFormat& format : mask_formats()) formats.update(content(format.media_type, binary_schema));
    return {{"description", "the mask: visibility, linear, 1 fully lit; with image=bound an EXR with the channels low and high"},
            {"headers",
             {{"ETag", header("a strong entity tag")},
              {"Server-Timing", header("stages with milliseconds")},
              {"X-Request-Id", header("the request's id")},
              {"Penumbra-Error-Estimate", header("JSON object with mean, p99, pixels and by, as in the command line's report; with error_estimate=true, absent where there is none")},
              {"Penumbra-Warnings", header("JSON array of what was assumed or looks wrong; absent when there is nothing")}}},
            {"content", formats}};
}

Json responses_of(const Route& route)
{
    Json responses = Json::object();
    const bool post = route.method == "POST";
    switch (route.answer) {
    case Answer::mask:
        responses["200"] = mask_answer();
        responses["304"] = {{"description", "If-None-Match names the mask's entity tag"}};
        break;
    case Answer::scene:
        responses["200"] = {{"description", "the scene is kept"}, {"content", content("application/json", reference("KeptScene"))}};
        if (post) {
            responses["201"] = responses["200"];
            responses["201"]["headers"] = {{"Location", header("the path of the kept scene")}};
        }
        break;
    case Answer::depth:
        responses["200"] = {{"description", "planar depth, infinite where nothing is: every so many pixels of the image"},
                            {"headers", {{"Penumbra-Size", header("width and height of the image itself, as 640x480")}}},
                            {"content", content("image/x-portable-floatmap", binary_schema)}};
        break;
    case Answer::nothing:
        responses["204"] = {{"description", "done"}};
        break;
    case Answer::json:
        responses["200"] = {{"description", "as asked"}, {"content", content("application/json", object_schema)}};
        break;
    case Answer::page:
        responses["200"] = {{"description", "as asked"}, {"content", content("text/html", text_schema)}};
        break;
    case Answer::text:
        responses["200"] = {{"description", "as asked"}, {"content", content("text/plain", text_schema)}};
        break;
    }
    if (!route.open) add_problems(responses, {401});
    add_problems(responses, {403});
    if (route.path.find("{id}") != std::string_view::npos) add_problems(responses, {404});
    if (route.answer == Answer::mask) add_problems(responses, {406});
    if (post) add_problems(responses, {400, 408, 411, 413, 415, 422, 431, 500, 503, 504});
    if (route.path == "/readyz") add_problems(responses, {503});
    return responses;
}

Json operation_of(const Route& route, const Options& options)
{
    Json operation = {{"summary", route.summary}};
    Json parameters = Json::array();
    if (route.path.find("{id}") != std::string_view::npos)
        parameters.push_back(
            {{"name", "id"}, {"in", "path"}, {"required", true}, {"schema", {{"type", "string"}, {"pattern", "^[0-9a-f]{64}$"}}}});
    if (route.answer == Answer::mask) {
        parameters.push_back({{"name", "light"},
                              {"in", "query"},
                              {"description", "of a scene with `lights`, the name of one; without it the mask of all together"},
                              {"schema", {{"type", "string"}, {"pattern", "^[A-Za-z0-9_-]{1,64}$"}}}});
        parameters.push_back({{"name", "frame"},
                              {"in", "query"},
                              {"description", "of a scene with a sequence of emission images, the number of one, from 1; needed there"},
                              {"schema", {{"type", "integer"}, {"minimum", 1}, {"maximum", max_frames}}}});
        parameters.push_back(
            {{"name", "image"},
             {"in", "query"},
             {"description", "`bound`: instead of the mask, the lowest and the highest visibility that each pixel can have, "
                             "channels low and high, as image/x-exr; of a technique whose `bounds` is true"},
             {"schema", {{"type", "string"}, {"enum", {"mask", "bound"}}, {"default", "mask"}}}});
        parameters.push_back({{"name", "error_estimate"},
                              {"in", "query"},
                              {"description", "true: the header Penumbra-Error-Estimate says how far the mask is off, measured at some of its pixels"},
                              {"schema", {{"type", "boolean"}, {"default", false}}}});
    }
    if (route.answer == Answer::depth)
        parameters.push_back(
            {{"name", "side"},
             {"in", "query"},
             {"description", "the most pixels that the answer is wide or high"},
             {"schema", {{"type", "integer"}, {"minimum", 1}, {"maximum", max_depth_side}, {"default", default_depth_side}}}});
    if (!parameters.empty()) operation["parameters"] = parameters;
    if (route.method == "POST") operation["requestBody"] = body_of(route, options);
    operation["responses"] = responses_of(route);
    if (route.open || options.token.empty()) operation["security"] = Json::array();
    return operation;
}

// What is in a section is judged when it has been merged.
Json patch_schema()
{
    Json schema = {{"type", "object"},
                   {"description", "a JSON Merge Patch (RFC 7396) of a scene: members replace those of the same name, null takes one away"},
                   {"properties", Json::object()},
                   {"additionalProperties", false}};
    for (const std::string_view section : patched_sections())
        schema["properties"][std::string(section)] = {{"type", {section == "lights" ? "array" : "object", "null"}}};
    return schema;
}

Json schemas()
{
    Json all = Json::parse(scene_definitions_json("#/components/schemas/"));
    const Json whole = {{"type", "integer"}};
    const Json texts = {{"type", "array"}, {"items", text_schema}};
    all.update({{"Problem",
                 {{"type", "object"},
                  {"properties",
                   {{"type", text_schema},
                    {"title", text_schema},
                    {"status", whole},
                    {"detail", text_schema},
                    {"path", text_schema},
                    {"reason", text_schema},
                    {"retry_after", whole},
                    {"request_id", text_schema}}},
                  {"required", {"type", "title", "status", "detail", "reason"}}}},
                {"KeptScene",
                 {{"type", "object"},
                  {"properties", {{"id", text_schema}, {"expires_s", whole}, {"bytes", whole}, {"warnings", texts}}},
                  {"required", {"id", "expires_s", "bytes", "warnings"}}}},
                {"ScenePatch", patch_schema()}});
    return all;
}

} // namespace

std::string openapi_json(const Options& options)
{
    Json paths = Json::object();
    for (const Route& route : routes()) {
        std::string method;
        for (const char c : route.method) method += static_cast<char>(c - 'A' + 'a');
        paths[std::string(route.path)][method] = operation_of(route, options);
    }
    const Json document = {
        {"openapi", "3.1.0"},
        {"info", {{"title", "penumbra"}, {"version", version()}, {"description", "Soft-shadow masks from depth maps."}}},
        {"paths", paths},
        {"components", {{"schemas", schemas()}, {"securitySchemes", {{"bearer", {{"type", "http"}, {"scheme", "bearer"}}}}}}},
        {"security", Json::array({{{"bearer", Json::array()}}})}};
    return document.dump(2) + "\n";
}

} // namespace penumbra::server
