// The verbs of the command. Each adds its subcommand, with its flags and help, to the program and returns what to run when it was chosen.
#pragma once

#include <functional>

#include <CLI/App.hpp>

namespace penumbra::cli {

struct Verb {
    CLI::App* app;
    std::function<int()> run; // the exit code; errors are thrown
};

Verb mask_verb(CLI::App& program);
Verb depth_verb(CLI::App& program);
Verb compare_verb(CLI::App& program);
Verb batch_verb(CLI::App& program);
Verb info_verb(CLI::App& program);

// A subcommand whose help starts with `usage`, a line such as "mask SCENE.json -o MASK".
CLI::App* add_verb(CLI::App& program, const char* name, const char* summary, const char* usage);

} // namespace penumbra::cli
