// How many files and connections the process may have open.
#pragma once

#include <cstdint>
#include <string>

namespace penumbra::server {

// Beside connections: the device and its compiler's files, each slot's temporary files, sockets that wait to be accepted. With the 512
// connections of the default that is 1024, the usual soft limit, so mostly there is nothing to raise.
constexpr std::uint64_t descriptors_beside = 512;

// Raises this process's soft limit to `needed` when it is lower; never lowers it. Gives a warning when a filter of system calls hides the
// limit. Throws usage when the limit is too low and stays so: a flood of connections would then keep the device's compiler from its files,
// and requests would fail for no reason that they show.
[[nodiscard]] std::string ensure_descriptors(std::uint64_t needed);

} // namespace penumbra::server
