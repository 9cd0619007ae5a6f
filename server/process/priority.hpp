// How much of the processors a worker gets beside others.
#pragma once

#include <sys/types.h>

namespace penumbra::server {

// Sets all threads of the process that far below this process's own priority, in steps of nice(2): 0, the same, to 19. False where a thread
// could not be set; threads that ended meanwhile do not count.
bool lower_priority(pid_t process, int steps);

// Whether this process may give back the priority that it took (CAP_SYS_NICE, or a limit RLIMIT_NICE that allows its own; systemd: LimitNICE).
bool may_raise_priority();

} // namespace penumbra::server
