// penumbra compare: how far a mask is from a reference.
#include <iomanip>
#include <memory>
#include <sstream>

#include <nlohmann/json.hpp>

#include <penumbra/error.hpp>
#include <penumbra/image.hpp>
#include <penumbra/metrics.hpp>

#include "files.hpp"
#include "progress.hpp"
#include "streams.hpp"
#include "verbs.hpp"

namespace penumbra::cli {
namespace {

struct Flags {
    std::string test, reference, picture;
    bool json = false;
    double full_scale = 0.1;
};

constexpr const char* notes = R"(
Differences are TEST - REFERENCE of linear visibility. The shadow figures are over pixels below 0.999 in either image, 0 when there are none.
p99 is the 99th percentile of the absolute difference, interpolated between ranks. The two "off by" figures are shares of shadow pixels.
In the picture blue is darker than the reference, red brighter, white equal.

Examples:
  penumbra compare mask.exr reference.exr
  penumbra compare mask.exr reference.exr --json -o difference.png --full-scale 0.05)";

std::string json_of(const Metrics& m)
{
    const nlohmann::ordered_json json = {
        {"mae_shadow", m.mae_shadow},
        {"rmse_shadow", m.rmse_shadow},
        {"bias_shadow", m.bias_shadow},
        {"mae", m.mae},
        {"rmse", m.rmse},
        {"max", m.max},
        {"p99", m.p99},
        {"pixels_shadow", m.pixels_shadow},
        {"pixels", m.pixels},
        {"p99_shadow", m.p99_shadow},
        {"off_1_255_shadow", m.off_1_255_shadow},
        {"off_0_05_shadow", m.off_0_05_shadow},
    };
    return json.dump() + "\n";
}

std::string table_of(const Metrics& m)
{
    std::ostringstream out;
    const auto row = [&out](const char* name, const auto& shadow, const auto& all) {
        out << std::left << std::setw(24) << name << std::right << std::setw(14) << shadow << std::setw(14) << all << "\n";
    };
    out << std::setprecision(6);
    row("", "shadow", "all");
    row("mean absolute error", m.mae_shadow, m.mae);
    row("root mean square error", m.rmse_shadow, m.rmse);
    row("bias", m.bias_shadow, "");
    row("99th percentile", m.p99_shadow, m.p99);
    row("largest", "", m.max);
    row("off by more than 1/255", m.off_1_255_shadow, "");
    row("off by more than 0.05", m.off_0_05_shadow, "");
    row("pixels", m.pixels_shadow, m.pixels);
    return out.str();
}

int run(const Flags& flags)
{
    OutputFormat format;
    if (!flags.picture.empty()) {
        require_place_for(flags.picture, "-o");
        require_different(flags.picture, "-o", flags.test, "TEST");
        require_different(flags.picture, "-o", flags.reference, "REFERENCE");
        // A picture for the eye: 8 bits where the format has them.
        format = format_for(flags.picture, {}, "-o");
        if (format.format == "png" || format.format == "tif") format.bits = 8;
    }

    Progress progress;
    progress.step("reading " + flags.test);
    const Image test = read_image(flags.test);
    progress.step("reading " + flags.reference);
    const Image reference = read_image(flags.reference);
    progress.step("comparing");
    const std::string subject = flags.test + " and " + flags.reference;
    const Metrics metrics = in_scene(subject, [&] { return compare(test, reference); });

    if (!flags.picture.empty()) write_image(flags.picture, difference_image(test, reference, flags.full_scale), format);
    progress.end();
    print(flags.json ? json_of(metrics) : table_of(metrics));
    return 0;
}

} // namespace

Verb compare_verb(CLI::App& program)
{
    const auto flags = std::make_shared<Flags>();
    CLI::App* app = add_verb(program, "compare", "Compare a mask with a reference.", "compare TEST REFERENCE [options]");
    app->add_option("TEST", flags->test, "the mask")->option_text(" ")->required();
    app->add_option("REFERENCE", flags->reference, "what it should be")->option_text(" ")->required();
    app->add_flag("--json", flags->json, "the figures as JSON");
    app->add_option("-o,--output", flags->picture, "write the difference in false colour")->option_text("DIFF.png");
    app->add_option("--full-scale", flags->full_scale, "the difference of full colour (default 0.1)")->option_text("NUMBER");
    app->footer(notes);
    return {app, [flags] { return run(*flags); }};
}

} // namespace penumbra::cli
