// penumbra: soft-shadow masks from depth maps.
//
// Exit codes: 0 done, 1 the work failed, 2 wrong usage or input. Errors are one line on standard error; results go to files or standard
// output.
#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include <CLI/CLI.hpp>

#include <penumbra/engine.hpp>
#include <penumbra/error.hpp>

#include "heap.hpp"
#include "isolate.hpp"
#include "scene/joined.hpp"
#include "streams.hpp"
#include "verbs.hpp"

namespace penumbra::cli {
namespace {

constexpr const char* summary = "Soft-shadow masks from depth maps, on OpenCL.";
constexpr const char* footer = "Exit codes: 0 done, 1 the work failed, 2 wrong usage or input.\n"
                               "`penumbra VERB --help` tells more about a verb; `penumbra info` shows devices and techniques.";

class VerbHelp : public CLI::Formatter {
public:
    explicit VerbHelp(std::string usage) : usage_(std::move(usage))
    {
        column_width(34);
        label("Positionals", "Arguments");
    }
    std::string make_usage(const CLI::App*, std::string) const override { return "\nUsage: penumbra " + usage_ + "\n"; }

private:
    std::string usage_;
};

Error wrong_usage(std::string message, const CLI::App& program)
{
    const auto chosen = program.get_subcommands();
    return Error(ErrorCode::usage, std::move(message),
                 "see penumbra " + (chosen.empty() ? "" : chosen.front()->get_name() + " ") + "--help");
}

int run(int argc, char** argv)
{
    CLI::App program(summary, "penumbra");
    program.formatter(std::make_shared<VerbHelp>("VERB ..."));
    program.set_help_flag("-h,--help", "print this help");
    program.set_version_flag("--version", "penumbra " + version(), "print the version");
    const std::array verbs{mask_verb(program), depth_verb(program), compare_verb(program), batch_verb(program), info_verb(program)};
    program.footer(footer); // after the verbs, which would inherit it

    const std::string names = joined(verbs, [](const Verb& verb) { return verb.app->get_name(); });
    if (argc < 2) throw wrong_usage("no verb given; expected one of " + names, program);
    const bool known = std::ranges::any_of(verbs, [&](const Verb& verb) { return verb.app->get_name() == argv[1]; });
    if (argv[1][0] != '-' && !known) throw wrong_usage("unknown verb \"" + std::string(argv[1]) + "\"; expected one of " + names, program);

    try {
        program.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        print(program.help());
        return 0;
    } catch (const CLI::CallForVersion& version_text) {
        print(std::string(version_text.what()) + "\n");
        return 0;
    } catch (const CLI::ParseError& error) {
        throw wrong_usage(error.what(), program);
    }

    for (const Verb& verb : verbs)
        if (verb.app->parsed()) return verb.run();
    throw wrong_usage("no verb given; expected one of " + names, program);
}

} // namespace

CLI::App* add_verb(CLI::App& program, const char* name, const char* verb_summary, const char* usage)
{
    CLI::App* app = program.add_subcommand(name, verb_summary)->group("Verbs");
    app->formatter(std::make_shared<VerbHelp>(usage));
    // C++20 makes an array of a number, so that add_flag would not know a description by itself from a count.
    app->add_flag("--isolate")->description("work in a process of its own: a file that crashes a reader costs this command alone, with one clear line");
    return app;
}

} // namespace penumbra::cli

int main(int argc, char** argv)
{
    using namespace penumbra;
    cli::use_huge_pages();
    try {
        if (const auto arguments = cli::isolated_arguments(argc, argv)) return cli::run_isolated(*arguments);
        return cli::run(argc, argv);
    } catch (const Error& error) {
        cli::print_error(error.what());
        return exit_code(error.code());
    } catch (const std::bad_alloc&) {
        cli::print_error("out of memory");
        return exit_code(ErrorCode::internal);
    } catch (const std::exception& error) {
        cli::print_error(error.what());
        return exit_code(ErrorCode::internal);
    }
}
