#include "process/own_memory.hpp"

#include <fstream>

#include <malloc.h>
#include <unistd.h>

namespace penumbra::server {

std::uint64_t data_bytes()
{
    std::ifstream file("/proc/self/statm");
    std::uint64_t pages = 0;
    for (int field = 0; field < 6; ++field) file >> pages;
    return file ? pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) : 0;
}

void give_back_large_blocks()
{
    constexpr int large = 4 << 20; // a mask of 1024 x 1024. To fault in smaller ones again and again would cost more than they are worth
    mallopt(M_MMAP_THRESHOLD, large);
}

bool Retention::too_much(std::uint64_t kept)
{
    constexpr std::uint64_t much = std::uint64_t{32} << 20; // below, giving back is not worth its time
    std::uint64_t now = data_bytes();
    if (now > last_ + much) {
        malloc_trim(0);
        now = data_bytes();
        last_ = now;
    }
    return limit_ > warm_ && now > warm_ + kept && now - warm_ - kept > (limit_ - warm_) / 4;
}

} // namespace penumbra::server
