#include "scene/memory.hpp"

#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

#include <sys/resource.h>
#include <unistd.h>

#include <penumbra/error.hpp>

namespace penumbra {
namespace {

// Bytes that count against the limit, and the stack's: the sixth number of statm, in pages.
std::uint64_t data_in_use()
{
    std::ifstream file("/proc/self/statm");
    std::uint64_t pages = 0;
    for (int i = 0; i < 6; ++i) file >> pages;
    return file ? pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) : 0;
}

std::string mib(double bytes)
{
    char text[48];
    std::snprintf(text, sizeof(text), "%.0f MiB", bytes / (1 << 20));
    return text;
}

} // namespace

std::uint64_t memory_left()
{
    rlimit limit{};
    if (getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return std::numeric_limits<std::uint64_t>::max();
    const std::uint64_t used = data_in_use();
    return used < limit.rlim_cur ? limit.rlim_cur - used : 0;
}

void require_memory(double bytes, std::string_view what)
{
    // Less is lost in what allocators keep, and not worth a look.
    constexpr double least = 1 << 20;
    if (bytes < least) return;
    const auto left = static_cast<double>(memory_left());
    if (bytes > left)
        throw Error(ErrorCode::too_large, std::string(what) + ": " + mib(bytes) + " of memory are needed, " + mib(left) + " are left",
                    "expected smaller images, fewer of them, or a process that may use more");
}

} // namespace penumbra
