// How much of the processors a worker gets beside others.
#pragma once

#include <chrono>

#include <sys/types.h>

namespace penumbra::server {

// Sets all threads of the process that far below this process's own priority, in steps of nice(2): 0, the same, to 19. False where a thread
// could not be set; threads that ended meanwhile do not count.
bool lower_priority(pid_t process, int steps);

// What the process has used of the processors since its start, as if all of them had worked for it alone; zero for one that is gone.
std::chrono::nanoseconds processor_time(pid_t process);

// Whether this process may give back the priority that it took (CAP_SYS_NICE, or a limit RLIMIT_NICE that allows its own; systemd: LimitNICE).
bool may_raise_priority();

} // namespace penumbra::server
