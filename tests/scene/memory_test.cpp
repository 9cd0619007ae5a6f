// What is left up to a process's limit of data, tried by a process that has one.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>

#include <sys/resource.h>
#include <unistd.h>

#include <penumbra/error.hpp>

#include "scene/memory.hpp"

namespace penumbra::test {
namespace {

constexpr double mib = 1 << 20;

void leave(double bytes)
{
    // What is in use counts against the limit: it is found by a limit that is too large to matter.
    constexpr rlim_t whole = rlim_t{1} << 40;
    rlimit limit{whole, whole};
    setrlimit(RLIMIT_DATA, &limit);
    const std::uint64_t used = whole - memory_left();
    limit = {used + static_cast<rlim_t>(bytes), whole};
    setrlimit(RLIMIT_DATA, &limit);
}

bool refused(double bytes)
{
    try {
        require_memory(bytes, "a table");
        return false;
    } catch (const Error& error) {
        return error.code() == ErrorCode::too_large;
    }
}

#define EXPECT_IN_CHILD(condition) EXPECT_EXIT(_exit((condition) ? 0 : 1), testing::ExitedWithCode(0), "")

class Memory : public testing::Test {
    void SetUp() override { GTEST_FLAG_SET(death_test_style, "fast"); }
};

TEST_F(Memory, WithoutALimitNothingIsRefused)
{
    rlimit limit{};
    ASSERT_EQ(getrlimit(RLIMIT_DATA, &limit), 0);
    if (limit.rlim_cur != RLIM_INFINITY) GTEST_SKIP() << "this process has one";
    EXPECT_EQ(memory_left(), std::numeric_limits<std::uint64_t>::max());
    EXPECT_FALSE(refused(1e15));
}

#ifndef __SANITIZE_ADDRESS__
TEST_F(Memory, WhatIsOverTheLimitIsRefusedWithBothNumbers)
{
    EXPECT_IN_CHILD((leave(64 * mib), refused(96 * mib) && !refused(32 * mib)));
    EXPECT_EXIT(
        {
            leave(64 * mib);
            try {
                require_memory(96 * mib, "a table");
            } catch (const Error& error) {
                fprintf(stderr, "%s", error.what());
            }
            _exit(0);
        },
        testing::ExitedWithCode(0), "a table: 96 MiB of memory are needed, 6[34] MiB are left");
}

TEST_F(Memory, WhatIsAllocatedIsNotLeft)
{
    const auto left_beside = [](std::size_t bytes) {
        const std::unique_ptr<void, decltype(&std::free)> memory(std::malloc(bytes), &std::free);
        return memory ? static_cast<double>(memory_left()) : -1.0;
    };
    EXPECT_IN_CHILD((leave(256 * mib), std::abs(left_beside(128 << 20) - 128 * mib) < 2 * mib));
    EXPECT_IN_CHILD((leave(64 * mib), left_beside(128 << 20) == -1.0));
}
#endif

} // namespace
} // namespace penumbra::test
