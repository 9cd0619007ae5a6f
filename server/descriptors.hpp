// How many files and connections the process may have open.
#pragma once

#include <cstdint>
#include <string>

namespace penumbra::server {

// 512 connections at most (service.cpp), and as many for all else: the device and its compiler's files, each slot's temporary files,
// sockets that wait to be accepted. Soft limits of 1024 are usual, so mostly there is nothing to raise.
constexpr std::uint64_t descriptors_needed = 1024;

// Raises this process's soft limit to `needed` when it is lower; never lowers it. Gives a warning when a filter of system calls hides the
// limit. Throws usage when the limit is too low and stays so: a flood of connections would then keep the device's compiler from its files,
// and requests would fail for no reason that they show.
[[nodiscard]] std::string ensure_descriptors(std::uint64_t needed = descriptors_needed);

} // namespace penumbra::server
