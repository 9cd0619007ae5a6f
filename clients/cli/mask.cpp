// penumbra mask: one scene; one mask, or those of its lights and frames.
#include <algorithm>
#include <future>
#include <memory>

#include <penumbra/describe.hpp>
#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>
#include <penumbra/image.hpp>
#include <penumbra/mask_job.hpp>
#include <penumbra/scene.hpp>

#include "files.hpp"
#include "mask_files.hpp"
#include "preview.hpp"
#include "opencl/quirks.hpp"
#include "technique/table.hpp"
#include "progress.hpp"
#include "remote.hpp"
#include "scene/lights.hpp"
#include "streams.hpp"
#include "technique_flags.hpp"
#include "verbs.hpp"

namespace penumbra::cli {
namespace {

struct Flags {
    std::string scene, mask, report, bound, over, preview, device, server;
    MaskChoice choice;
    TechniqueFlags technique;
};

const OutputFormat bound_format{.format = "exr", .bits = 32, .channels = {"low", "high"}};

constexpr const char* examples = R"(
Examples:
  penumbra mask scene.json -o mask.exr
  penumbra mask scene.json -o mask.png --technique soft_shadow_map --set sides=both
  penumbra mask scene.json -o mask.exr --report report.json --device 0
  penumbra mask scene.json -o mask.exr --server http://127.0.0.1:8080

Of several lights MASK is that of all together, and mask.NAME.exr of each; of a sequence of emission images every frame has its own,
mask.0001.exr, mask.NAME.0001.exr. --light and --frame choose one, which goes to MASK.

Masks are visibility: 1 fully lit, 0 umbra, linear. Warnings go to standard error.
A server that asks for a token gets the one in PENUMBRA_SERVER_TOKEN.)";

void write_report(const Flags& flags, const std::string& report)
{
    try {
        write_text(flags.report, report);
    } catch (const Error& error) {
        throw error.within(flags.mask + " is written, but its report is not");
    }
}

int run_on_server(const Flags& flags, const std::vector<MaskFile>& files)
{
    if (!flags.device.empty()) throw Error(ErrorCode::usage, "--device " + flags.device + ": with --server, the server has the device");
    RemoteScene asked{.server = flags.server, .scene = flags.scene, .technique = flags.technique, .over = flags.over, .picture = {}};
    if (!flags.over.empty()) asked.picture = read_picture(flags.over);
    const std::string report = masks_on_server(asked, files, !flags.report.empty());
    if (!flags.report.empty()) write_report(flags, report);
    return 0;
}

// The other files that are written, of each mask: none may replace another, or what is read.
void add_further_files(const Flags& flags, const nlohmann::json& json, std::vector<MaskFile>& masks)
{
    std::vector<std::pair<std::string, const char*>> written;
    const auto add = [&](const std::string& name, const char* flag, std::string MaskFile::*member) {
        if (name.empty()) return;
        const std::vector<MaskFile> named = mask_files(name, json, flags.choice);
        std::vector<std::string> files;
        for (std::size_t i = 0; i < masks.size(); ++i) files.push_back(masks[i].*member = named[i].file);
        require_not_named_in(flags.scene, json, files, flag);
        for (const std::string& file : files) written.emplace_back(file, flag);
    };
    add(flags.bound, "--bound", &MaskFile::bound);
    add(flags.preview, "--preview", &MaskFile::preview);
    for (const MaskFile& mask : masks) {
        if (!flags.over.empty()) require_different(mask.file, "-o", flags.over, "--over");
        for (const auto& [file, flag] : written) require_different(file, flag, mask.file, "-o");
    }
    if (!flags.report.empty() && !flags.over.empty()) require_different(flags.report, "--report", flags.over, "--over");
    for (std::size_t i = 0; i < written.size(); ++i) {
        const auto& [file, flag] = written[i];
        require_different(file, flag, flags.scene, "SCENE.json");
        if (!flags.over.empty()) require_different(file, flag, flags.over, "--over");
        if (!flags.report.empty()) require_different(flags.report, "--report", file, flag);
        for (std::size_t j = i + 1; j < written.size(); ++j) require_different(file, flag, written[j].first, written[j].second);
    }
}

// Refuses what the names of files say before anything is read or computed; gives the files to come.
std::vector<MaskFile> check_files(const Flags& flags)
{
    require_place_for(flags.mask, "-o");
    require_different(flags.mask, "-o", flags.scene, "SCENE.json");
    format_for(flags.mask, {}, "-o");
    if (!flags.report.empty()) {
        require_place_for(flags.report, "--report");
        require_different(flags.report, "--report", flags.scene, "SCENE.json");
    }
    if (flags.over.empty() != flags.preview.empty())
        throw Error(ErrorCode::usage, flags.over.empty() ? "--preview: is given without --over" : "--over: is given without --preview",
                    "expected both: --over PICTURE --preview OUT.png");
    if (!flags.preview.empty()) {
        require_place_for(flags.preview, "--preview");
        if (format_for(flags.preview, {}, "--preview").format != "png")
            throw Error(ErrorCode::usage, "--preview " + flags.preview + ": is no PNG file", "expected a name that ends in .png");
    }
    if (!flags.bound.empty()) {
        require_place_for(flags.bound, "--bound");
        if (format_for(flags.bound, {}, "--bound").format != "exr")
            throw Error(ErrorCode::usage, "--bound " + flags.bound + ": is no EXR file", "expected a name that ends in .exr: it has two channels, low and high");
    }
    const nlohmann::json json = json_in(flags.scene);
    std::vector<MaskFile> files = mask_files(flags.mask, json, flags.choice);
    std::vector<std::string> paths;
    for (const MaskFile& file : files) {
        paths.push_back(file.file);
        if (file.file != flags.mask) require_different(file.file, "-o", flags.scene, "SCENE.json");
        if (!flags.report.empty()) require_different(flags.report, "--report", file.file, "-o");
    }
    require_not_named_in(flags.scene, json, paths, "-o");
    add_further_files(flags, json, files);
    return files;
}

// The reports of all masks: as it always was for one, a list for more.
std::string report_text(const std::vector<FileReport>& reports)
{
    const FileReport& first = reports.front();
    return reports.size() == 1 && first.light.empty() && first.frame == 0 ? report_json(first.report) : reports_json(reports);
}

int run(const Flags& flags)
{
    // Refuse in order of cost: names, then the scene, then the device, then the work.
    const std::vector<MaskFile> files = check_files(flags);
    if (!flags.server.empty()) return run_on_server(flags, files);

    // The device opens while the scene is read, which hides most of the drivers' start; its errors come after the scene's. The environment
    // is set first: nothing may read it meanwhile.
    opencl::prepare_environment();
    const Engine engine = open_engine(flags.device);
    std::future<DeviceInfo> opening = std::async(std::launch::async, [&] { return engine.device(); });

    Progress progress;
    progress.step("reading " + flags.scene);
    Scene scene = read_scene(flags.scene);
    const OutputFormat format = format_for(flags.mask, scene.output, "-o");
    scene = in_scene(flags.scene, [&] { return chosen(std::move(scene), flags.choice); });
    scene.technique = in_scene(flags.scene, [&] { return apply(scene.technique, flags.technique); });
    const Technique technique = technique_from(scene.technique);

    // A device that nothing needs is waited for only where it was asked for.
    if (!row_of(scene.technique.kind).on_host || !flags.device.empty()) {
        progress.step("opening the device");
        print_warnings(environment_warnings(opening.get()));
    }

    Image picture;
    if (!flags.over.empty()) {
        progress.step("reading " + flags.over);
        picture = read_picture(flags.over);
        require_size(picture, scene.receivers.width, scene.receivers.height, flags.over);
    }
    std::vector<FileReport> reports;
    std::vector<std::string> warnings;
    progress.step("computing the mask by " + scene.technique.kind);
    const auto write = [&](NamedMask&& named) {
        const std::string file = mask_file(flags.mask, named.light, named.frame);
        progress.step("writing " + file);
        write_image(file, named.mask.visibility, format);
        if (!flags.preview.empty()) {
            const std::string preview = mask_file(flags.preview, named.light, named.frame);
            progress.step("writing " + preview);
            write_image(preview, under_light(picture, named.mask.visibility, flags.over), preview_format);
        }
        if (!flags.bound.empty()) {
            const std::string bound = mask_file(flags.bound, named.light, named.frame);
            progress.step("writing " + bound);
            write_image(bound, named.mask.bound, bound_format);
        }
        // Those of each light come again, with its name, from all lights together.
        if (named.light.empty())
            for (const std::string& warning : named.mask.report.warnings)
                if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
        reports.push_back({named.light, named.frame, file, std::move(named.mask.report)});
        progress.step("computing the next mask");
    };
    in_scene(flags.scene, [&] {
        MaskJob job = job_of(scene, technique);
        job.bound = !flags.bound.empty();
        job.error_estimate = !flags.report.empty();
        engine.masks(job, {}, write);
    });
    progress.end();
    print_warnings(warnings);
    if (!flags.report.empty()) write_report(flags, report_text(reports));
    return 0;
}

} // namespace

Verb mask_verb(CLI::App& program)
{
    const auto flags = std::make_shared<Flags>();
    CLI::App* app = add_verb(program, "mask", "Compute the mask of a scene.", "mask SCENE.json -o MASK [options]");
    app->add_option("SCENE.json", flags->scene, "the scene")->option_text(" ")->required();
    app->add_option("-o,--output", flags->mask,
                    "the mask; its extension is the format: .exr .tif .png .pfm .hdr\n(bits as the scene's output says)")
        ->option_text("MASK")
        ->required();
    add_technique_flags(*app, flags->technique);
    app->add_option("--report", flags->report, "stages with milliseconds, bytes, device, warnings")->option_text("REPORT.json");
    app->add_option("--bound", flags->bound,
                    "the lowest and the highest visibility that each pixel can have (channels low, high), where depth\nimages cast and what lies behind them is not known; by depth_trace or ray_traced")
        ->option_text("BOUND.exr");
    app->add_option("--over", flags->over, "a picture of the mask's size and view, for --preview: EXR, TIFF, PNG, HDR or JPEG")->option_text("PICTURE");
    app->add_option("--preview", flags->preview, "that picture under this light alone, to look at: times the mask, in linear light")->option_text("OUT.png");
    app->add_option("--light", flags->choice.light, "of several lights, the mask of this one alone")->option_text("NAME");
    app->add_option("--frame", flags->choice.frame, "of a sequence, the masks of this frame alone, from 1")
        ->option_text("N")
        ->check(CLI::Range(1, static_cast<int>(max_frames)));
    add_device_flag(*app, flags->device);
    app->add_option("--server", flags->server, "let a service compute it; the scene's files are sent along")->option_text("URL");
    app->footer([] { return technique_help() + examples; });
    return {app, [flags] { return run(*flags); }};
}

} // namespace penumbra::cli
