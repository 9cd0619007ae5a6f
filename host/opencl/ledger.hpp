// What lives on one device, over all the work of one context, and the guard tails of its buffers.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "opencl/quirks.hpp"

namespace penumbra::opencl {

struct MemoryMeter;

// A buffer with a guard tail: `bytes` are its user's, `canary_bytes` after them are ours.
struct GuardedBuffer {
    cl::Buffer memory;
    std::uint64_t bytes = 0;
    std::string what;
};

constexpr std::uint64_t canary_bytes = 256;

// Fills the user's bytes with 0xff (NaN as a float: reading what was never written shows) and the tail with its pattern.
void plant_canary(const cl::CommandQueue& queue, const GuardedBuffer& buffer);

// What is wrong with the tail, with the numbers; nothing when it is whole. Waits for the queue. Throws cl::Error.
std::optional<std::string> canary_violation(const cl::CommandQueue& queue, const GuardedBuffer& buffer);

class Ledger {
public:
    // Adds to what lives on the device, unless that comes to more than `limit`: then false, and nothing is added.
    bool take(std::uint64_t bytes, std::uint64_t limit);
    void give_back(std::uint64_t bytes);
    std::uint64_t live() const;

    // Guarded buffers, by the meter of the work that made them.
    void watch(const MemoryMeter* owner, GuardedBuffer buffer);
    void unwatch(const cl::Buffer& memory);
    std::optional<GuardedBuffer> watched(const cl::Buffer& memory) const;
    std::vector<GuardedBuffer> watched_by(const MemoryMeter* owner) const;

    // A violation found where nothing can be thrown; kept until somebody asks.
    void record_violation(std::string violation);
    std::optional<std::string> take_violation();

private:
    struct Watched {
        const MemoryMeter* owner;
        GuardedBuffer buffer;
    };
    mutable std::mutex mutex_;
    std::uint64_t live_ = 0;
    std::map<cl_mem, Watched> watched_;
    std::optional<std::string> violation_;
};

} // namespace penumbra::opencl
