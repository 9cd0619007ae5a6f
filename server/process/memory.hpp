// How much memory the service may use, and what of it is a worker's.
#pragma once

#include <cstdint>

#include "process/options.hpp"

namespace penumbra::server {

// The smaller of --memory, the control group's limit and the machine's memory, in bytes.
std::uint64_t memory_limit(const Options& options);
// How many workers are kept warm beside those of the slots: as many as asked for, fewer where all shares would be too small for common requests.
std::size_t spare_workers(const Options& options);
// Three quarters of the limit are the workers', in even shares.
std::uint64_t worker_memory(const Options& options);
// The last quarter is the service's own: bodies with the scenes that are kept, answers that wait for their clients, and its code.
std::uint64_t uploads_memory(const Options& options);
std::uint64_t answers_memory(const Options& options);

} // namespace penumbra::server
