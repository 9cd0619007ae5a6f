// --isolate: the work in a process of its own, which may die of a file that a library cannot stand.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace penumbra::cli {

// The arguments without --isolate; nothing when it is not among them.
std::optional<std::vector<std::string>> isolated_arguments(int argc, char** argv);

// Runs this program with those arguments, passes signals that end it on, and gives its exit code. Throws Error internal when it dies of a
// signal of its own, with the signal's name.
int run_isolated(const std::vector<std::string>& arguments);

} // namespace penumbra::cli
