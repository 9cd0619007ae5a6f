// What this build and its devices can do, as JSON and as values: for those who list, check or warm all of it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <penumbra/engine.hpp>

namespace penumbra {

// {"techniques": [...]}: each technique with what it takes and a JSON Schema of its keys.
PENUMBRA_API std::string techniques_json();

// {"version", "devices": [...]}; `selected`: the index of the one in use.
PENUMBRA_API std::string devices_json(const std::vector<DeviceInfo>& devices, int selected);

// Each technique with its defaults, and with every other value of one of its flags and choices: what has kernels of its own.
PENUMBRA_API std::vector<Technique> technique_choices();

// What those prepared states hold on the device, what they share counted once.
PENUMBRA_API std::uint64_t device_bytes(std::span<const Prepared> prepared);

// Sets what PoCL reads from the environment, where the user has not set it: threads from the processors that this process may use, a
// private cache folder, no handler of arithmetic signals. For programs, before their first engine; a library's user decides for himself.
PENUMBRA_API void prepare_environment();

// What that found out for this device, for programs to say once: that a folder for compiled kernels cannot be used, why, and which one is
// used instead.
PENUMBRA_API std::vector<std::string> environment_warnings(const DeviceInfo& device);

// Bytes that this process may use: the smallest of the machine's memory, what its control groups allow, and its own limit of data.
PENUMBRA_API std::uint64_t machine_memory();

} // namespace penumbra
