#include "process/priority.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <thread>

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

namespace penumbra::server {
namespace {

constexpr int lowest = 19;

int own_priority() { return getpriority(PRIO_PROCESS, static_cast<id_t>(getpid())); }

} // namespace

bool lower_priority(pid_t process, int steps)
{
    const int wanted = std::min(own_priority() + steps, lowest);
    // Linux keeps it for each thread. A thread takes it from the one that makes it; one that was made meanwhile is in the second list.
    bool all = true;
    for (int round = 0; round < 2; ++round) {
        std::error_code gone;
        for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task", gone)) {
            const auto number = static_cast<id_t>(std::atol(thread.path().filename().c_str()));
            if (setpriority(PRIO_PROCESS, number, wanted) != 0 && errno != ESRCH) all = false;
        }
        if (gone) return false;
    }
    return all;
}

std::chrono::nanoseconds processor_time(pid_t process)
{
    clockid_t clock{};
    timespec used{};
    if (process <= 0 || clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &used) != 0) return {};
    return (std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec)) / std::max(std::thread::hardware_concurrency(), 1U);
}

bool may_raise_priority()
{
    const int own = own_priority();
    if (own >= lowest) return true; // there is nothing to take
    bool may = false;
    // A thread that ends, in case it may not.
    std::thread([&] {
        const auto self = static_cast<id_t>(gettid());
        may = setpriority(PRIO_PROCESS, self, own + 1) == 0 && setpriority(PRIO_PROCESS, self, own) == 0;
    }).join();
    return may;
}

} // namespace penumbra::server
