#include "opencl/ledger.hpp"

#include <array>
#include <utility>

namespace penumbra::opencl {
namespace {

// No byte repeats within a float4, and none is what kernels write often (0, 0xff, a float's 0x3f or 0x80).
std::array<unsigned char, canary_bytes> canary_pattern()
{
    std::array<unsigned char, canary_bytes> pattern = {};
    for (std::size_t i = 0; i < pattern.size(); ++i) pattern[i] = static_cast<unsigned char>(0xa0 + i % 29);
    return pattern;
}

} // namespace

void plant_canary(const cl::CommandQueue& queue, const GuardedBuffer& buffer)
{
    if (buffer.bytes > 0) queue.enqueueFillBuffer(buffer.memory, cl_uchar{0xff}, 0, buffer.bytes);
    const auto pattern = canary_pattern();
    queue.enqueueWriteBuffer(buffer.memory, CL_TRUE, buffer.bytes, pattern.size(), pattern.data());
}

std::optional<std::string> canary_violation(const cl::CommandQueue& queue, const GuardedBuffer& buffer)
{
    const auto pattern = canary_pattern();
    std::array<unsigned char, canary_bytes> tail = {};
    queue.enqueueReadBuffer(buffer.memory, CL_TRUE, buffer.bytes, tail.size(), tail.data());

    std::size_t changed = 0, first = 0;
    for (std::size_t i = 0; i < tail.size(); ++i) {
        if (tail[i] != pattern[i] && changed++ == 0) first = i;
    }
    if (changed == 0) return std::nullopt;
    return "a kernel wrote past the end of the buffer " + buffer.what + " (" + std::to_string(buffer.bytes) +
           " bytes): " + std::to_string(changed) + " of the " + std::to_string(canary_bytes) +
           " bytes after it have changed, the first at +" + std::to_string(first);
}

bool Ledger::take(std::uint64_t bytes, std::uint64_t limit)
{
    const std::lock_guard lock(mutex_);
    if (live_ > limit || bytes > limit - live_) return false;
    live_ += bytes;
    return true;
}

void Ledger::give_back(std::uint64_t bytes)
{
    const std::lock_guard lock(mutex_);
    live_ -= bytes;
}

std::uint64_t Ledger::live() const
{
    const std::lock_guard lock(mutex_);
    return live_;
}

void Ledger::watch(const MemoryMeter* owner, GuardedBuffer buffer)
{
    const std::lock_guard lock(mutex_);
    cl_mem key = buffer.memory();
    watched_.insert_or_assign(key, Watched{owner, std::move(buffer)});
}

void Ledger::unwatch(const cl::Buffer& memory)
{
    const std::lock_guard lock(mutex_);
    watched_.erase(memory());
}

std::optional<GuardedBuffer> Ledger::watched(const cl::Buffer& memory) const
{
    const std::lock_guard lock(mutex_);
    const auto at = watched_.find(memory());
    return at == watched_.end() ? std::nullopt : std::optional(at->second.buffer);
}

std::vector<GuardedBuffer> Ledger::watched_by(const MemoryMeter* owner) const
{
    const std::lock_guard lock(mutex_);
    std::vector<GuardedBuffer> buffers;
    for (const auto& [memory, watched] : watched_) {
        if (watched.owner == owner) buffers.push_back(watched.buffer);
    }
    return buffers;
}

void Ledger::record_violation(std::string violation)
{
    const std::lock_guard lock(mutex_);
    if (!violation_) violation_ = std::move(violation);
}

std::optional<std::string> Ledger::take_violation()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(violation_, std::nullopt);
}

} // namespace penumbra::opencl
