// penumbra mask: one scene, one mask.
#include <future>
#include <memory>

#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>
#include <penumbra/image.hpp>
#include <penumbra/scene.hpp>

#include "files.hpp"
#include "opencl/quirks.hpp"
#include "progress.hpp"
#include "remote.hpp"
#include "streams.hpp"
#include "technique_flags.hpp"
#include "verbs.hpp"

namespace penumbra::cli {
namespace {

struct Flags {
    std::string scene, mask, report, device, server;
    TechniqueFlags technique;
};

constexpr const char* examples = R"(
Examples:
  penumbra mask scene.json -o mask.exr
  penumbra mask scene.json -o mask.png --technique soft_shadow_map --set sides=both
  penumbra mask scene.json -o mask.exr --report report.json --device 0
  penumbra mask scene.json -o mask.exr --server http://127.0.0.1:8080

Masks are visibility: 1 fully lit, 0 umbra, linear. Warnings go to standard error.
A server that asks for a token gets the one in PENUMBRA_SERVER_TOKEN.)";

void write_report(const Flags& flags, const std::string& report)
{
    try {
        write_text(flags.report, report);
    } catch (const Error& error) {
        throw Error(error.code(), flags.mask + " is written, but its report is not: " + error.message(), error.hint());
    }
}

int run_on_server(const Flags& flags)
{
    if (!flags.device.empty()) throw Error(ErrorCode::usage, "--device " + flags.device + ": with --server, the server has the device");
    const std::string report = mask_on_server({flags.server, flags.scene, flags.mask, flags.technique}, !flags.report.empty());
    if (!flags.report.empty()) write_report(flags, report);
    return 0;
}

int run(const Flags& flags)
{
    // Refuse in order of cost: names, then the scene, then the device, then the work.
    require_place_for(flags.mask, "-o");
    require_different(flags.mask, "-o", flags.scene, "SCENE.json");
    format_for(flags.mask, {}, "-o");
    if (!flags.report.empty()) {
        require_place_for(flags.report, "--report");
        require_different(flags.report, "--report", flags.scene, "SCENE.json");
        require_different(flags.report, "--report", flags.mask, "-o");
    }

    require_not_named_in(flags.scene, flags.mask, "-o");
    if (!flags.server.empty()) return run_on_server(flags);

    // The device opens while the scene is read, which hides most of the drivers' start; its errors come after the scene's. The environment
    // is set first: nothing may read it meanwhile.
    opencl::prepare_environment();
    std::future<Engine> opening = std::async(std::launch::async, [&] { return open_engine(flags.device); });

    Progress progress;
    progress.step("reading " + flags.scene);
    Scene scene = read_scene(flags.scene);
    const OutputFormat format = format_for(flags.mask, scene.output, "-o");
    scene.technique = in_scene(flags.scene, [&] { return apply(scene.technique, flags.technique); });

    progress.step("opening the device");
    const Engine engine = opening.get();

    progress.step("computing the mask by " + scene.technique.kind);
    const Mask mask = in_scene(flags.scene, [&] { return engine.mask(scene); });

    progress.step("writing " + flags.mask);
    write_image(flags.mask, mask.visibility, format);
    progress.end();
    print_warnings(mask.report.warnings);
    if (!flags.report.empty()) write_report(flags, report_json(mask.report));
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
    add_device_flag(*app, flags->device);
    app->add_option("--server", flags->server, "let a service compute it; the scene's files are sent along")->option_text("URL");
    app->footer([] { return technique_help() + examples; });
    return {app, [flags] { return run(*flags); }};
}

} // namespace penumbra::cli
