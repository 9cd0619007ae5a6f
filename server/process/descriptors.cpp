#include "process/descriptors.hpp"

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include <sys/resource.h>

#include <penumbra/error.hpp>

namespace penumbra::server {

std::string ensure_descriptors(std::uint64_t needed)
{
    rlimit limit{};
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0)
        return std::string("RLIMIT_NOFILE: cannot be read: ") + std::strerror(errno) + " (expected at least " + std::to_string(needed) +
               ")";
    if (limit.rlim_cur >= needed) return {}; // RLIM_INFINITY is the largest number

    // No further than needed: with a billion, as some containers have it, programs that close what they inherit would take minutes.
    const rlim_t soft = std::exchange(limit.rlim_cur, needed);
    const bool raised = limit.rlim_max >= needed && setrlimit(RLIMIT_NOFILE, &limit) == 0;
    if (!raised)
        throw Error(ErrorCode::usage,
                    "RLIMIT_NOFILE: " + std::to_string(soft) + " open files are allowed, and " + std::to_string(limit.rlim_max) +
                        " at most",
                    "expected at least " + std::to_string(needed) + ": ulimit -Hn, or LimitNOFILE= of systemd");
    return {};
}

} // namespace penumbra::server
