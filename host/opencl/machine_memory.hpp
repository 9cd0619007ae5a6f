// How much memory this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace penumbra::opencl {

// The smallest of the machine's memory, what the process's control groups allow (version 1 or 2, its own group and those above it), and the
// process's own limit of data (RLIMIT_DATA); bytes. `root`: where /proc and /sys lie, for tests.
std::uint64_t machine_memory(const std::string& root = "");

} // namespace penumbra::opencl
