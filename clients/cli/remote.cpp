#include "remote.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <system_error>

#include <nlohmann/json.hpp>

#include <penumbra/client.hpp>

#include "files.hpp"
#include "io/image_format.hpp"
#include "io/image_io.hpp"
#include "io/json_value.hpp"
#include "io/scene_parts.hpp"
#include "preview.hpp"
#include "progress.hpp"
#include "streams.hpp"

namespace penumbra::cli {
namespace {

// No service computes longer: an hour is the most that its --deadline-s takes.
constexpr std::chrono::hours timeout{1};

client::Format format_of_mask(const std::string& path)
{
    switch (format_of(format_for(path, {}, "-o"))) {
    case ImageFormat::exr:
        return client::Format::exr;
    case ImageFormat::tiff:
        return client::Format::tiff;
    case ImageFormat::png:
        return client::Format::png;
    case ImageFormat::pfm:
        return client::Format::pfm;
    default:
        throw Error(ErrorCode::usage, "-o " + path + ": is a format that services do not send", "expected .exr, .tif, .png or .pfm");
    }
}

// The scene's technique with the flags applied; without flags it stays as it is, for the service to judge.
void apply_flags(nlohmann::json& scene, const TechniqueFlags& flags)
{
    if (flags.kind.empty() && flags.settings.empty()) return;
    TechniqueRequest request;
    if (const auto technique = JsonObject(JsonValue(scene, {})).find("technique")) request = parse_technique(*technique);
    request = apply(std::move(request), flags);
    nlohmann::json& technique = scene["technique"] = {{"kind", request.kind}};
    for (const auto& setting : request.settings) std::visit([&](const auto& held) { technique[setting.first] = held; }, setting.second);
}

client::SceneFile read_for_upload(const RemoteScene& asked)
{
    return in_scene(asked.scene, [&] {
        const std::vector<std::byte> bytes = read_file(asked.scene, asked.scene);
        client::SceneFile file{parse_json({reinterpret_cast<const char*>(bytes.data()), bytes.size()}), {}};
        apply_flags(file.scene, asked.technique);
        try {
            file.images = client::take_files(file.scene, std::filesystem::path(asked.scene).parent_path());
        } catch (const std::system_error& error) {
            throw Error(ErrorCode::not_found, error.what());
        }
        return file;
    });
}

// What the service said about the scene is about the scene; the rest is about the service.
Error translated(const client::Error& error, const RemoteScene& asked)
{
    const client::Problem& problem = error.problem();
    const std::string service = "--server " + asked.server + ": ";
    switch (problem.status) {
    case 422:
        return Error(ErrorCode::invalid_input, problem.detail).within(asked.scene);
    case 413:
        return Error(ErrorCode::too_large, problem.detail).within(asked.scene);
    case 401:
        return Error(ErrorCode::usage, service + problem.detail, "the token goes into PENUMBRA_SERVER_TOKEN");
    case 408:
        return Error(ErrorCode::device, service + problem.detail);
    default:
        if (problem.status >= 400 && problem.status < 500) return Error(ErrorCode::usage, service + error.what());
        return Error(ErrorCode::device, service + (problem.status == 0 ? problem.detail : error.what()));
    }
}

nlohmann::ordered_json report_of(const client::Mask& mask, const client::Client& service, const nlohmann::json& scene,
                                 const RemoteScene& asked, const MaskFile& file, double round_trip_ms)
{
    nlohmann::ordered_json report;
    const nlohmann::json technique = scene.value("technique", nlohmann::json{{"kind", TechniqueRequest().kind}});
    report["technique"] = technique.at("kind");
    report["settings"] = technique;
    report["settings"].erase("kind");
    const nlohmann::json devices = service.devices().value("devices", nlohmann::json::array());
    for (const nlohmann::json& device : devices)
        if (device.value("selected", false))
            report["device"] = {{"name", device.value("name", "")}, {"driver", device.value("driver", "")}};
    const Image image = decode_image(std::as_bytes(std::span(mask.bytes)), file.file);
    report["resolution"] = {image.width, image.height};
    report["stages"] = nlohmann::ordered_json::array();
    for (const auto& [name, ms] : mask.stages_ms) report["stages"].push_back({{"name", name}, {"ms", ms}});
    report["warnings"] = mask.warnings;
    report["server"] = asked.server;
    report["request_id"] = mask.request_id;
    report["round_trip_ms"] = round_trip_ms;
    return report;
}

// A connection that broke may have been one that the service gave up as it ended: asked once more. To ask for a mask changes nothing.
client::Mask mask_of(const client::Client& service, const client::SceneFile& scene, const client::MaskOptions& options)
{
    try {
        return service.mask(scene.scene, scene.images, options);
    } catch (const client::ConnectionFailed& error) {
        if (error.problem().reason != "broke") throw;
    }
    return service.mask(scene.scene, scene.images, options);
}

// One mask with its bound and its preview, written; its report.
nlohmann::ordered_json fetch(const client::Client& service, const client::SceneFile& scene, const RemoteScene& asked, const MaskFile& file,
                             bool with_report, std::vector<std::string>& warnings)
{
    // The bound first: a technique may have none.
    client::Mask bound;
    if (!file.bound.empty())
        bound = mask_of(service, scene,
                        {.format = client::Format::exr, .light = file.light, .frame = file.frame, .image = client::MaskImage::bound});
    const auto begun = std::chrono::steady_clock::now();
    const client::Mask mask = mask_of(service, scene, {.format = format_of_mask(file.file), .light = file.light, .frame = file.frame});
    const double round_trip_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count();
    Image preview;
    if (!file.preview.empty())
        preview = under_light(asked.picture, decode_image(std::as_bytes(std::span(mask.bytes)), file.file), asked.over);

    write_file(file.file, std::as_bytes(std::span(mask.bytes)));
    if (!file.preview.empty()) write_image(file.preview, preview, preview_format);
    if (!file.bound.empty()) write_file(file.bound, std::as_bytes(std::span(bound.bytes)));
    for (const std::string& warning : mask.warnings)
        if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
    return with_report ? report_of(mask, service, scene.scene, asked, file, round_trip_ms) : nlohmann::ordered_json();
}

} // namespace

std::string masks_on_server(const RemoteScene& asked, const std::vector<MaskFile>& files, bool with_report)
{
    format_of_mask(files.front().file);
    const char* token = std::getenv("PENUMBRA_SERVER_TOKEN");
    Progress progress;
    try {
        const client::Client service(asked.server, {.token = token ? token : "", .timeout = timeout, .traceparent = {}});
        progress.step("reading " + asked.scene);
        const client::SceneFile scene = read_for_upload(asked);

        std::vector<std::string> warnings;
        nlohmann::ordered_json reports = nlohmann::ordered_json::array();
        for (const MaskFile& file : files) {
            progress.step("computing " + file.file + " on " + asked.server);
            nlohmann::ordered_json report = {{"light", file.light.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(file.light)},
                                             {"frame", file.frame == 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(file.frame)},
                                             {"file", file.file}};
            nlohmann::ordered_json one = fetch(service, scene, asked, file, with_report, warnings);
            if (!with_report) continue;
            if (files.size() == 1) report = nlohmann::ordered_json::object();
            report.update(one);
            reports.push_back(std::move(report));
        }
        progress.end();
        print_warnings(warnings);
        if (!with_report) return {};
        return (files.size() == 1 ? reports[0] : nlohmann::ordered_json{{"masks", reports}}).dump(2) + "\n";
    } catch (const client::Error& error) {
        throw translated(error, asked);
    } catch (const std::invalid_argument& error) {
        throw Error(ErrorCode::usage, std::string("--server: ") + error.what());
    }
}

} // namespace penumbra::cli
