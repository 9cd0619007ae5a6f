#include "process/memory.hpp"

#include <algorithm>

#include <penumbra/describe.hpp>

namespace penumbra::server {

std::uint64_t memory_limit(const Options& options)
{
    const std::uint64_t machine = machine_memory();
    return options.memory > 0 ? std::min(machine, static_cast<std::uint64_t>(options.memory)) : machine;
}

std::uint64_t worker_memory(const Options& options)
{
    return memory_limit(options) / 4 * 3 / static_cast<std::uint64_t>(options.slots);
}

} // namespace penumbra::server
