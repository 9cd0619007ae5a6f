// What this process holds on to from one request to the next.
#pragma once

#include <cstdint>

namespace penumbra::server {

// Bytes that are private and can be written: what limit_memory counts.
std::uint64_t data_bytes();

// From now on large blocks are given back when they are freed, not kept for the next one of their size.
void give_back_large_blocks();

// Of a worker. Libraries keep some of what they took; what they keep is missing to the next request.
class Retention {
public:
    // `limit`: what the process may take in all. From what it has now, warm, nothing is ever given back.
    explicit Retention(std::uint64_t limit) : limit_(limit), warm_(data_bytes()), last_(warm_) {}
    // Gives back to the system what is free, where much has come since the last time. True: beside the `kept` bytes a quarter of what requests may
    // take is held.
    bool too_much(std::uint64_t kept);

private:
    std::uint64_t limit_, warm_, last_;
};

} // namespace penumbra::server
