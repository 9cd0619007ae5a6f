// What this process may still allocate, where its data is limited (RLIMIT_DATA), as a worker's of the service is.
#pragma once

#include <cstdint>
#include <string_view>

namespace penumbra {

// Bytes up to that limit; the largest number where there is none. The kernel keeps the account: nothing is counted twice or forgotten.
std::uint64_t memory_left();

// To be asked before much is allocated: throws Error too_large, with both numbers, when `bytes` are more than is left. `what` needs them.
void require_memory(double bytes, std::string_view what);

} // namespace penumbra
