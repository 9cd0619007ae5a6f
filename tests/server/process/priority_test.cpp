// Priorities of other processes' threads, and memory that is held on to.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "process/own_memory.hpp"
#include "process/priority.hpp"

namespace penumbra::test {
namespace {

// Of each of its threads.
std::vector<int> priorities_of(pid_t process)
{
    std::vector<int> all;
    for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task"))
        all.push_back(getpriority(PRIO_PROCESS, static_cast<id_t>(std::stoi(thread.path().filename().string()))));
    return all;
}

TEST(Priority, IsThatOfAllThreads)
{
    const pid_t child = fork();
    if (child == 0) {
        std::vector<std::thread> threads;
        for (int i = 0; i < 3; ++i) threads.emplace_back([] { pause(); });
        pause();
    }
    while (priorities_of(child).size() < 4) usleep(1000);
    const int own = getpriority(PRIO_PROCESS, static_cast<id_t>(getpid()));
    EXPECT_TRUE(server::lower_priority(child, 7));
    EXPECT_EQ(priorities_of(child), std::vector<int>(4, std::min(own + 7, 19)));
    EXPECT_EQ(server::lower_priority(child, 0), server::may_raise_priority() || own == 19);
    if (server::may_raise_priority()) {
        EXPECT_EQ(priorities_of(child), std::vector<int>(4, own));
    }
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    EXPECT_FALSE(server::lower_priority(child, 7)) << "nobody is there";
    EXPECT_EQ(getpriority(PRIO_PROCESS, static_cast<id_t>(getpid())), own) << "to try changes nothing";
}

#ifndef __SANITIZE_ADDRESS__
TEST(Retention, IsTooMuchFromAQuarterOn)
{
    constexpr std::uint64_t mib = std::uint64_t{1} << 20;
    const auto take = [](std::uint64_t bytes) {
        return mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    };
    server::Retention retention(server::data_bytes() + 400 * mib);
    EXPECT_FALSE(retention.too_much(0));
    void* const small = take(80 * mib);
    EXPECT_FALSE(retention.too_much(0));
    void* const more = take(40 * mib);
    EXPECT_TRUE(retention.too_much(0));
    EXPECT_FALSE(retention.too_much(30 * mib)) << "what is kept for good reason does not count";
    munmap(more, 40 * mib);
    EXPECT_FALSE(retention.too_much(0));
    munmap(small, 80 * mib);
}
#endif

} // namespace
} // namespace penumbra::test
