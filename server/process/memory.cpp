#include "process/memory.hpp"

#include <algorithm>

#include <penumbra/describe.hpp>

namespace penumbra::server {

std::uint64_t memory_limit(const Options& options)
{
    const std::uint64_t machine = machine_memory();
    return options.memory > 0 ? std::min(machine, static_cast<std::uint64_t>(options.memory)) : machine;
}

namespace {

// A quarter, less what the process takes by itself and for answers on their way from worker to client.
std::uint64_t shared_memory(const Options& options)
{
    constexpr std::uint64_t own = std::uint64_t{64} << 20;
    const std::uint64_t quarter = memory_limit(options) / 4;
    return quarter - std::min(own, quarter / 2);
}

} // namespace

std::uint64_t uploads_memory(const Options& options) { return shared_memory(options) / 3 * 2; }

std::uint64_t answers_memory(const Options& options)
{
    return std::min(static_cast<std::uint64_t>(options.answer_bytes), shared_memory(options) / 3);
}

std::size_t spare_workers(const Options& options)
{
    constexpr std::uint64_t least_share = std::uint64_t{384} << 20;
    const std::uint64_t all = memory_limit(options) / 4 * 3 / least_share, slots = static_cast<std::uint64_t>(options.slots);
    return static_cast<std::size_t>(all <= slots ? 0 : std::min(all - slots, static_cast<std::uint64_t>(options.spares)));
}

std::uint64_t worker_memory(const Options& options)
{
    return memory_limit(options) / 4 * 3 / (static_cast<std::uint64_t>(options.slots) + spare_workers(options));
}

} // namespace penumbra::server
