#include "masks/crashes.hpp"

#include <gtest/gtest.h>

#include "process/problem.hpp"

namespace penumbra::test {
namespace {

using namespace std::chrono_literals;
using server::Crashes;

struct Clock {
    Crashes::Clock::time_point now = Crashes::Clock::now();
};

bool refused(Crashes& crashes, const std::string& digest)
{
    try {
        crashes.check(digest);
        return false;
    } catch (const server::Problem& problem) {
        EXPECT_EQ(problem.status, 422);
        EXPECT_EQ(problem.reason, "crashed");
        return true;
    }
}

TEST(Crashes, TwoDeathsAreEnoughForTenMinutes)
{
    Clock clock;
    Crashes crashes([&] { return clock.now; });
    EXPECT_FALSE(crashes.any());
    crashes.note("a");
    EXPECT_TRUE(crashes.any());
    EXPECT_FALSE(refused(crashes, "a"));
    crashes.note("a");
    EXPECT_TRUE(refused(crashes, "a"));
    EXPECT_FALSE(refused(crashes, "b"));
    clock.now += Crashes::time;
    EXPECT_FALSE(refused(crashes, "b"));
    EXPECT_FALSE(crashes.any()) << "what is too old goes, whoever asks";
    EXPECT_FALSE(refused(crashes, "a"));
}

// Workers that are killed from outside take honest requests with them.
TEST(Crashes, WhatCameThroughStartsAnew)
{
    Crashes crashes;
    for (int i = 0; i < 5; ++i) {
        crashes.note("a");
        EXPECT_FALSE(refused(crashes, "a"));
        crashes.absolve("a");
        EXPECT_FALSE(crashes.any());
    }
}

} // namespace
} // namespace penumbra::test
