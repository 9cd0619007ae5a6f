// --technique, --set and --device: what of a scene's request the command line replaces, and the help on it, made from the table of
// techniques.
#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>

#include <penumbra/engine.hpp>
#include <penumbra/scene.hpp>

namespace penumbra::cli {

struct TechniqueFlags {
    std::string kind;                  // empty: the scene's
    std::vector<std::string> settings; // KEY=VALUE
};

void add_technique_flags(CLI::App& app, TechniqueFlags& flags);
void add_device_flag(CLI::App& app, std::string& selector);

// The scene's request with the flags applied. Another kind drops the scene's settings. Throws the library's errors for unknown kinds, keys
// and values, within the flag that caused them.
TechniqueRequest apply(TechniqueRequest request, const TechniqueFlags& flags);

// The device that `selector` means; empty: the one that the environment selects.
Engine open_engine(const std::string& selector);

// Every technique with its lights, inputs and keys, for people.
std::string technique_help();

} // namespace penumbra::cli
