#include "masks/call.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace penumbra::server {
namespace {

using Json = nlohmann::json;

constexpr std::size_t longest_detail = 4000, longest_warning = 1000, most_warnings = 64;

std::string cut(std::string text, std::size_t longest)
{
    if (text.size() <= longest) return text;
    text.resize(longest);
    return text + "...";
}

std::vector<std::string> cut(const std::vector<std::string>& warnings)
{
    std::vector<std::string> kept;
    for (std::size_t i = 0; i < std::min(warnings.size(), most_warnings); ++i) kept.push_back(cut(warnings[i], longest_warning));
    if (warnings.size() > most_warnings) kept.push_back("and " + std::to_string(warnings.size() - most_warnings) + " more warnings");
    return kept;
}

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

} // namespace

std::string text_of(const Call& call)
{
    return text_of(Json{{"kind", static_cast<int>(call.kind)},
                        {"form", call.form},
                        {"id", call.id},
                        {"patch_form", call.patch_form},
                        {"light", call.choice.light},
                        {"frame", call.choice.frame},
                        {"bound", call.choice.image == MaskImage::bound},
                        {"error_estimate", call.choice.error_estimate},
                        {"format", call.format},
                        {"side", call.side},
                        {"seconds", call.seconds}});
}

Call call_from(std::string_view text)
{
    const Json json = Json::parse(text);
    return {.kind = static_cast<Call::Kind>(json.at("kind").get<int>()),
            .form = json.at("form"),
            .id = json.at("id"),
            .patch_form = json.at("patch_form"),
            .choice = {.light = json.at("light"),
                       .frame = json.at("frame"),
                       .image = json.at("bound").get<bool>() ? MaskImage::bound : MaskImage::mask,
                       .error_estimate = json.at("error_estimate")},
            .format = json.at("format"),
            .side = json.at("side"),
            .seconds = json.at("seconds")};
}

std::string text_of(const CallReply& answer)
{
    Json json{{"spent", answer.spent}, {"bytes", answer.bytes}};
    if (answer.problem) {
        const Problem& p = *answer.problem;
        json["problem"] = {{"status", p.status},
                           {"reason", p.reason},
                           {"detail", cut(p.detail, longest_detail)},
                           {"path", cut(p.path, longest_detail)},
                           {"retry", p.retry_after_s},
                           {"inside", cut(answer.inside, longest_detail)}};
        return text_of(json);
    }
    const MaskReply& reply = answer.reply;
    Json stages = Json::array();
    for (const StageTime& stage : reply.stages) stages.push_back({stage.name, stage.ms});
    json["mask"] = {{"technique", reply.technique},       {"pixels", reply.pixels},       {"device_bytes", reply.device_bytes},
                    {"stages", std::move(stages)},         {"compute_ms", reply.compute_ms}, {"encode_ms", reply.encode_ms},
                    {"warnings", cut(reply.warnings)}, {"decode_ms", answer.decode_ms},   {"error_estimate", reply.error_estimate}};
    json["size"] = {answer.width, answer.height};
    if (answer.scene)
        json["scene"] = {
            {"bytes", answer.scene->bytes}, {"device_bytes", answer.scene->device_bytes}, {"warnings", cut(answer.scene->warnings)}};
    return text_of(json);
}

CallReply reply_from(std::string_view text)
{
    const Json json = Json::parse(text);
    CallReply answer;
    answer.spent = json.at("spent");
    answer.bytes = json.at("bytes");
    if (json.contains("problem")) {
        const Json& p = json.at("problem");
        answer.problem.emplace(p.at("status").get<int>(), p.at("reason"), p.at("detail"), p.at("retry").get<int>());
        answer.problem->path = p.at("path");
        answer.inside = p.at("inside");
        return answer;
    }
    const Json& mask = json.at("mask");
    answer.decode_ms = mask.at("decode_ms");
    answer.reply = {.bytes = {},
                    .technique = mask.at("technique"),
                    .pixels = mask.at("pixels"),
                    .device_bytes = mask.at("device_bytes"),
                    .stages = {},
                    .compute_ms = mask.at("compute_ms"),
                    .encode_ms = mask.at("encode_ms"),
                    .warnings = mask.at("warnings"),
                    .error_estimate = mask.at("error_estimate")};
    for (const Json& stage : mask.at("stages")) answer.reply.stages.push_back({stage.at(0), stage.at(1)});
    answer.width = json.at("size").at(0);
    answer.height = json.at("size").at(1);
    if (json.contains("scene")) {
        const Json& scene = json.at("scene");
        answer.scene = SceneFacts{.bytes = scene.at("bytes"), .device_bytes = scene.at("device_bytes"), .warnings = scene.at("warnings")};
    }
    return answer;
}

std::string text_of(const Greeting& greeting)
{
    return text_of(Json{{"problem", cut(greeting.problem, longest_detail)},
                        {"code", greeting.code},
                        {"device", greeting.device},
                        {"driver", greeting.driver},
                        {"devices", greeting.devices_json},
                        {"warnings", cut(greeting.warnings)},
                        {"closed", greeting.closed},
                        {"memory", greeting.memory},
                        {"kernels", greeting.kernels}});
}

Greeting greeting_from(std::string_view text)
{
    const Json json = Json::parse(text);
    return {.problem = json.at("problem"),
            .code = json.at("code"),
            .device = json.at("device"),
            .driver = json.at("driver"),
            .devices_json = json.at("devices"),
            .warnings = json.at("warnings"),
            .closed = json.at("closed"),
            .memory = json.at("memory"),
            .kernels = json.at("kernels")};
}

} // namespace penumbra::server
