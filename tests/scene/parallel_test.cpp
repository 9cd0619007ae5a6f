#include "scene/parallel.hpp"

#include <atomic>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include <penumbra/error.hpp>

namespace penumbra {
namespace {

class ParallelFor : public ::testing::Test {
protected:
    void TearDown() override { unsetenv("PENUMBRA_THREADS"); }
};

TEST_F(ParallelFor, ThreadCountIsTheSettingOrTheMachine)
{
    unsetenv("PENUMBRA_THREADS");
    const unsigned machine = thread_count();
    EXPECT_GE(machine, 1u);
    for (const auto& [text, count] : {std::pair("1", 1u), std::pair("7", 7u), std::pair("1024", 1024u), std::pair("", machine)}) {
        setenv("PENUMBRA_THREADS", text, 1);
        EXPECT_EQ(thread_count(), count);
    }
}

TEST_F(ParallelFor, RejectsSettingsThatAreNoCount)
{
    for (const char* text : {"0", "-1", "1025", "two", "2x", " 2", "1e3", "99999999999999999999"}) {
        setenv("PENUMBRA_THREADS", text, 1);
        try {
            thread_count();
            FAIL() << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::usage);
            EXPECT_NE(error.message().find(text), std::string::npos);
        }
    }
}

TEST_F(ParallelFor, CallsEachIndexOnce)
{
    for (const char* threads : {"1", "2", "13"}) {
        setenv("PENUMBRA_THREADS", threads, 1);
        for (const int count : {-3, 0, 1, 2, 1000}) {
            std::vector<std::atomic<int>> calls(1000);
            parallel_for(count, [&](int i) { ++calls.at(static_cast<std::size_t>(i)); });
            for (int i = 0; i < 1000; ++i) EXPECT_EQ(calls[static_cast<std::size_t>(i)].load(), i < count ? 1 : 0);
        }
    }
}

TEST_F(ParallelFor, RethrowsAndStops)
{
    for (const char* threads : {"1", "4"}) {
        setenv("PENUMBRA_THREADS", threads, 1);
        std::atomic<int> calls{0};
        EXPECT_THROW(parallel_for(1'000'000,
                                  [&](int i) {
                                      ++calls;
                                      if (i == 3) throw std::runtime_error("three");
                                  }),
                     std::runtime_error);
        EXPECT_LT(calls.load(), 1'000'000);
    }
}

TEST_F(ParallelFor, MayBeNested)
{
    setenv("PENUMBRA_THREADS", "3", 1);
    std::atomic<int> calls{0};
    parallel_for(5, [&](int) { parallel_for(7, [&](int) { ++calls; }); });
    EXPECT_EQ(calls.load(), 35);
}

} // namespace
} // namespace penumbra
