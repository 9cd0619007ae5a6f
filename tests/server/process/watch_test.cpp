// What is told, and when, of work whose time is up.
#include <atomic>
#include <thread>

#include <gtest/gtest.h>

#include "process/watch.hpp"
#include "scene/stop.hpp"

namespace penumbra::server {
namespace {

using namespace std::chrono_literals;

TEST(Watch, StopsWorkWhoseTimeIsUp)
{
    std::atomic<int> told = 0;
    Watch watch([&] { ++told; });
    const auto guard = watch.until(Deadline(20ms));
    while (current_stop()->asked == 0) std::this_thread::yield();
    EXPECT_THROW(check_stop(), Stopped);
    EXPECT_THROW(const Deaf refused(current_stop()), Stopped);
    EXPECT_EQ(told, 0);
}

TEST(Watch, TellsOfACallThatNothingCanStop)
{
    std::atomic<int> told = 0;
    Watch watch([&] { ++told; });
    const auto guard = watch.until(Deadline(20ms));
    {
        const Deaf compiling(current_stop());
        EXPECT_EQ(told, 0);
        while (told == 0) std::this_thread::yield();
    }
    EXPECT_EQ(told, 1);
    EXPECT_EQ(current_stop()->deaf, 0);
    EXPECT_THROW(check_stop(), Stopped);
}

} // namespace
} // namespace penumbra::server
