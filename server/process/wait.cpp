#include "process/wait.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>

#include <poll.h>

namespace penumbra::server {

using Clock = std::chrono::steady_clock;

int milliseconds_until(Clock::time_point end)
{
    if (end == Clock::time_point::max()) return -1;
    const std::int64_t left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, 1 << 30));
}

bool wait_for(int descriptor, short events, Clock::time_point end)
{
    for (;;) {
        const int left = milliseconds_until(end);
        if (left == 0) return false;
        pollfd entry{descriptor, events, 0};
        const int ready = ::poll(&entry, 1, left);
        if (ready > 0) return true;
        if (ready < 0 && errno != EINTR) return false;
    }
}

} // namespace penumbra::server
