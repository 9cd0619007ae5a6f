// Waiting for descriptors up to a moment, where the system calls take milliseconds from now.
#pragma once

#include <chrono>

namespace penumbra::server {

// As poll(2) and epoll_wait(2) take it: rounded up, so that `end` has come when the time is over; 0 when it has come already; -1, for
// ever, for time_point::max(). At most some days: who waits looks again.
int milliseconds_until(std::chrono::steady_clock::time_point end);

// Waits until the descriptor is ready for `events` of poll(2). False: `end` came first, or the descriptor cannot be waited for.
bool wait_for(int descriptor, short events, std::chrono::steady_clock::time_point end);

} // namespace penumbra::server
