// penumbra batch: many scenes, one process, one device.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <iomanip>
#include <memory>
#include <new>
#include <optional>
#include <sstream>

#include <nlohmann/json.hpp>

#include <penumbra/describe.hpp>
#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>
#include <penumbra/image.hpp>
#include <penumbra/scene.hpp>

#include "batch_list.hpp"
#include "files.hpp"
#include "io/image_format.hpp"
#include "mask_files.hpp"
#include "streams.hpp"
#include "technique/table.hpp"
#include "technique_flags.hpp"
#include "verbs.hpp"

namespace penumbra::cli {
namespace {

using Clock = std::chrono::steady_clock;

struct Flags {
    std::string source, folder, shard, format, device;
    TechniqueFlags technique;
    bool resume = false, verbose = false;
};

constexpr const char* notes = R"(
DIR: every *.json in it. LIST: a text file with a scene's path a line, relative to the list; # starts a comment.
Each mask gets its scene's name, with the format as extension; those of several lights and of a sequence as `penumbra mask` names them. A scene that fails does not stop the others: its error goes to standard error,
and the exit code is 1 at the end (2 when wrong input was the only reason). --resume leaves out what is there already and not older than its
scene file; outputs are renamed into place when whole, so what is there is whole. --shard I/N takes every N-th scene, starting at the I-th.
OUT/manifest.jsonl (with --shard manifest-I-of-N.jsonl) says for each scene: done, skipped, failed or pending, milliseconds, error.
An interrupt (SIGINT, SIGTERM) lets the running scene finish and writes the manifest; a second one ends at once.

Examples:
  penumbra batch scenes --out masks --resume
  penumbra batch list.txt --out masks --format png --shard 1/4)";

volatile std::sig_atomic_t interrupt_signal = 0;

extern "C" void note_interrupt(int number) { interrupt_signal = number; }

// SA_RESETHAND: the second signal has its usual effect.
void watch_interrupts()
{
    struct sigaction action = {};
    action.sa_handler = note_interrupt;
    action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

enum class Status { pending, skipped, done, failed };

struct Outcome {
    Status status = Status::pending;
    double ms = 0;
    std::string error;
    int exit_code = 0;
};

std::string manifest_line(const BatchItem& item, const Outcome& outcome)
{
    constexpr const char* names[] = {"pending", "skipped", "done", "failed"};
    nlohmann::ordered_json json = {{"scene", item.scene},
                                   {"output", item.output},
                                   {"status", names[static_cast<int>(outcome.status)]},
                                   {"ms", outcome.ms},
                                   {"error", outcome.error}};
    if (item.outputs.size() > 1) json["outputs"] = item.outputs;
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

// "[#####.....]  50 %  5/10  2.1/s  3 s left  name", counting only scenes that were computed.
std::string bar(std::size_t finished, std::size_t count, std::size_t computed, double seconds, const std::string& name)
{
    constexpr std::size_t width = 20;
    const std::size_t filled = finished * width / count;
    std::ostringstream out;
    out << "[" << std::string(filled, '#') << std::string(width - filled, '.') << "] " << std::setw(3) << finished * 100 / count << " %  "
        << finished << "/" << count;
    if (computed > 0 && seconds > 0) {
        const double rate = static_cast<double>(computed) / seconds;
        out << std::setprecision(3) << "  " << rate << "/s  " << std::llround(std::ceil(static_cast<double>(count - finished) / rate))
            << " s left";
    }
    out << "  " << name;
    return out.str();
}

class Batch {
public:
    Batch(const Flags& flags, std::string manifest, std::vector<BatchItem> items)
        : flags_(flags), manifest_(std::move(manifest)), items_(std::move(items)), outcomes_(items_.size())
    {
    }

    int run()
    {
        for (std::size_t i = 0; i < items_.size(); ++i)
            if (flags_.resume && up_to_date(items_[i])) {
                outcomes_[i].status = Status::skipped;
                ++finished_;
            }
        if (finished_ < items_.size()) open_device();

        watch_interrupts();
        start_ = Clock::now();
        for (std::size_t i = 0; i < items_.size() && interrupt_signal == 0; ++i)
            if (outcomes_[i].status == Status::pending) run_one(items_[i], outcomes_[i]);
        draw_line("");
        return finish();
    }

private:
    // Without a device no scene can be done that needs one: that is one error, not one a scene.
    void open_device()
    {
        engine_.emplace(open_engine(flags_.device));
        try {
            print_warnings(environment_warnings(engine_->device()));
        } catch (const Error&) {
            for (std::size_t i = 0; i < items_.size(); ++i)
                if (outcomes_[i].status == Status::pending && needs_device(items_[i])) throw;
        }
    }

    bool needs_device(const BatchItem& item) const
    {
        if (!flags_.device.empty()) return true;
        try {
            const nlohmann::json scene = json_in(item.scene);
            const std::string kind = !flags_.technique.kind.empty() ? flags_.technique.kind : scene.at("technique").at("kind").get<std::string>();
            return !row_of(kind).on_host;
        } catch (const std::exception&) {
            return true; // the default technique; or nothing that can be computed
        }
    }

    void run_one(const BatchItem& item, Outcome& outcome)
    {
        show(item);
        const auto started = Clock::now();
        try {
            compute(item);
            outcome.status = Status::done;
        } catch (const Error& error) {
            fail(outcome, error.within(item.scene));
        } catch (const std::bad_alloc&) {
            fail(outcome, Error(ErrorCode::too_large, item.scene + ": out of memory"));
        } catch (const std::exception& error) {
            fail(outcome, Error(ErrorCode::internal, item.scene + ": " + error.what()));
        }
        outcome.ms = std::chrono::duration<double, std::milli>(Clock::now() - started).count();
        ++finished_;
        ++computed_;
        show(item);
        if (flags_.verbose && !on_terminal())
            print_error((outcome.status == Status::done ? "done " : "failed ") + std::to_string(finished_) + "/" +
                        std::to_string(items_.size()) + " " + item.output);
    }

    void compute(const BatchItem& item)
    {
        require_not_named_in(item.scene, json_in(item.scene), item.outputs, "--out");
        Scene scene = load_scene(item.scene);
        const OutputFormat format = format_for(item.output, scene.output, "--out");
        scene.technique = apply(scene.technique, flags_.technique);
        std::vector<std::string> warnings;
        engine_->masks(scene, technique_from(scene.technique), [&](NamedMask&& named) {
            write_image(mask_file(item.output, named.light, named.frame), named.mask.visibility, format);
            if (!named.light.empty()) return; // its warnings come again from all lights together
            for (const std::string& warning : named.mask.report.warnings)
                if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
        });
        print_warnings(warnings, item.scene);
    }

    void fail(Outcome& outcome, const Error& error)
    {
        outcome.status = Status::failed;
        outcome.error = error.what();
        outcome.exit_code = exit_code(error.code());
        print_error(outcome.error);
    }

    void show(const BatchItem& item) const
    {
        const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
        draw_line(bar(finished_, items_.size(), computed_, seconds, std::filesystem::path(item.scene).filename().string()));
    }

    // Writes the manifest; the exit code.
    int finish() const
    {
        std::string lines;
        std::size_t failed = 0;
        bool work_failed = false;
        for (std::size_t i = 0; i < items_.size(); ++i) {
            lines += manifest_line(items_[i], outcomes_[i]);
            failed += outcomes_[i].status == Status::failed ? 1 : 0;
            work_failed = work_failed || outcomes_[i].exit_code == 1;
        }
        write_text(manifest_, lines);

        if (failed > 0) print_error(std::to_string(failed) + " of " + std::to_string(items_.size()) + " scenes failed, see " + manifest_);
        if (interrupt_signal != 0 && finished_ < items_.size()) {
            print_error("interrupted after " + std::to_string(finished_) + " of " + std::to_string(items_.size()) +
                        " scenes (--resume goes on)");
            return 128 + static_cast<int>(interrupt_signal);
        }
        return failed == 0 ? 0 : work_failed ? 1 : 2;
    }

    const Flags& flags_;
    std::string manifest_;
    std::vector<BatchItem> items_;
    std::vector<Outcome> outcomes_;
    std::optional<Engine> engine_;
    Clock::time_point start_ = Clock::now();
    std::size_t finished_ = 0, computed_ = 0; // skipped ones are finished, not computed
};

int run(const Flags& flags)
{
    const std::string format = flags.format.empty() ? std::string() : checked({flags.format, 0}, "--format " + flags.format).format;
    const Shard shard = parse_shard(flags.shard);
    if (!flags.technique.kind.empty()) apply({}, flags.technique);
    const std::vector<BatchItem> items = items_of(shard, batch_items(flags.source, flags.folder, format));
    make_folder(flags.folder, "--out");
    const std::string part = flags.shard.empty() ? "" : "-" + std::to_string(shard.number) + "-of-" + std::to_string(shard.count);
    return Batch(flags, (std::filesystem::path(flags.folder) / ("manifest" + part + ".jsonl")).string(), items).run();
}

} // namespace

Verb batch_verb(CLI::App& program)
{
    const auto flags = std::make_shared<Flags>();
    CLI::App* app = add_verb(program, "batch", "Compute the masks of many scenes.", "batch DIR|LIST --out OUT [options]");
    app->add_option("DIR|LIST", flags->source, "a folder of scenes, or a list of them")->option_text(" ")->required();
    app->add_option("--out", flags->folder, "the folder for the masks; made when it is not there")->option_text("OUT")->required();
    app->add_flag("--resume", flags->resume, "leave out masks that are there and not older than their scene");
    app->add_option("--shard", flags->shard, "part I of N, I from 1 to N")->option_text("I/N");
    app->add_option("--format", flags->format, "exr, tif, png, pfm or hdr, instead of the scenes' own")->option_text("FORMAT");
    add_technique_flags(*app, flags->technique);
    add_device_flag(*app, flags->device);
    app->add_flag("--verbose", flags->verbose, "without a terminal: a line a scene on standard error");
    app->footer(notes);
    return {app, [flags] { return run(*flags); }};
}

} // namespace penumbra::cli
