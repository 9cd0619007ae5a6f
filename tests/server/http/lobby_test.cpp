// The lobby by itself, on pairs of sockets: who waits there, how long, and who makes room for whom.
#include "http/lobby.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include <sys/socket.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace penumbra::test {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

// A client's end, and the service's, which the lobby closes.
struct Pair {
    std::array<int, 2> ends{};
    Pair() { EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0); }
    ~Pair() { end(); }
    Pair(const Pair&) = delete;
    Pair& operator=(const Pair&) = delete;

    int service() const { return ends[0]; }
    void say(std::string_view text) const { EXPECT_EQ(::send(ends[1], text.data(), text.size(), 0), static_cast<ssize_t>(text.size())); }
    // All until the service's end is closed.
    std::string hear() const
    {
        std::string text;
        std::array<char, 65536> buffer{};
        for (ssize_t count = 0; (count = ::recv(ends[1], buffer.data(), buffer.size(), 0)) > 0;)
            text.append(buffer.data(), static_cast<std::size_t>(count));
        return text;
    }
    void end()
    {
        if (ends[1] >= 0) ::close(ends[1]);
        ends[1] = -1;
    }
};

// A lobby whose arrivals are taken one by one.
class House {
public:
    explicit House(const server::LobbyLimits& limits)
        : lobby(limits, [this](server::Arrival arrival) {
              {
                  const std::scoped_lock lock(mutex_);
                  arrived_.push_back(std::move(arrival));
              }
              came_.notify_one();
          })
    {
    }
    server::Arrival next()
    {
        std::unique_lock lock(mutex_);
        came_.wait(lock, [this] { return !arrived_.empty(); });
        server::Arrival arrival = std::move(arrived_.front());
        arrived_.pop_front();
        return arrival;
    }
    // The pair's headers are here, and served.
    void serve(const Pair& pair)
    {
        lobby.arrive(pair.service());
        pair.say("GET\r\n\r\n");
        EXPECT_EQ(next().socket, pair.service());
    }

private:
    std::mutex mutex_;
    std::condition_variable came_;
    std::deque<server::Arrival> arrived_;

public:
    server::Lobby lobby; // ends first
};

const std::string much(std::size_t{8} << 20, 'x'); // more than sockets take at once

TEST(Lobby, AnswersArriveWholeWhenTheyAreTaken)
{
    const Pair slow, quick;
    House house({.connections = 4});
    house.serve(slow);
    house.serve(quick);
    house.lobby.leave(slow.service(), much + "slow", false);
    house.lobby.leave(quick.service(), much + "quick", false);
    // The slow one has taken nothing yet.
    EXPECT_EQ(quick.hear(), much + "quick");
    EXPECT_EQ(slow.hear(), much + "slow");
}

TEST(Lobby, AnswersThatNobodyTakesAreGivenUp)
{
    const Pair pair;
    const int least = 1; // the kernel takes its own minimum, a few kilobytes
    setsockopt(pair.service(), SOL_SOCKET, SO_SNDBUF, &least, sizeof(least));
    const auto begin = Clock::now();
    {
        House house({.connections = 4, .header_time = 1s});
        house.serve(pair);
        house.lobby.leave(pair.service(), much, false);
        EXPECT_EQ(house.lobby.connections(), 1u);
    }
    // What the kernel took counts as moved: less than 128 KiB, 8 s worth.
    EXPECT_GE(Clock::now() - begin, 5s);
    EXPECT_LT(Clock::now() - begin, 5s + 8s);
}

TEST(Lobby, BeyondTheLimitTheAnswerThatWaitsLongestIsGivenUp)
{
    const Pair first, second;
    House house({.connections = 4, .answer_bytes = much.size() * 3 / 2});
    house.serve(first);
    house.serve(second);
    house.lobby.leave(first.service(), much, false);
    EXPECT_EQ(house.lobby.connections(), 2u);
    house.lobby.leave(second.service(), much, false);
    EXPECT_EQ(house.lobby.connections(), 1u); // at once
    EXPECT_LT(first.hear().size(), much.size());
    EXPECT_EQ(second.hear(), much);
}

TEST(Lobby, HeadersThatDoNotComeEndWithTheirTime)
{
    const Pair lines, none;
    House house({.connections = 4, .header_time = 200ms});
    const auto begin = Clock::now();
    house.lobby.arrive(none.service());
    none.say("GET"); // no line yet: no request, so no answer
    house.lobby.arrive(lines.service());
    lines.say("GET /\r\nHost: a\r\n");
    const server::Arrival arrival = house.next();
    EXPECT_GE(Clock::now() - begin, 200ms);
    EXPECT_EQ(arrival.socket, lines.service());
    EXPECT_TRUE(arrival.timed_out);
    EXPECT_EQ(arrival.bytes, "GET /\r\nHost: a\r\n");
    EXPECT_EQ(none.hear(), "");
    house.lobby.leave(arrival.socket, "408", false);
    EXPECT_EQ(lines.hear(), "408");
}

TEST(Lobby, AFullHouseTakesTheNextWhenOneLeaves)
{
    const Pair first, second;
    House house({.connections = 1});
    house.serve(first);
    std::atomic<bool> left = false;
    std::future<bool> arrived = std::async(std::launch::async, [&] {
        house.lobby.arrive(second.service());
        return left.load();
    });
    left = true;
    house.lobby.leave(first.service(), {}, false);
    EXPECT_TRUE(arrived.get());
    second.say("GET\r\n\r\n");
    house.lobby.leave(house.next().socket, {}, false);
}

TEST(Lobby, WhoSaysNothingForASecondMakesRoom)
{
    const Pair silent;
    Pair next;
    House house({.connections = 1, .header_time = 1h});
    const auto begin = Clock::now();
    house.lobby.arrive(silent.service());
    house.lobby.arrive(next.service());
    EXPECT_GE(Clock::now() - begin, 1s);
    EXPECT_EQ(silent.hear(), "");
    next.end();
}

TEST(Lobby, WhatARefusedClientSendsIsForgottenForTwoSeconds)
{
    const Pair pair;
    const auto begin = Clock::now();
    {
        House house({.connections = 4, .header_time = 1h});
        house.serve(pair);
        house.lobby.leave(pair.service(), "413", true);
        EXPECT_EQ(pair.hear(), "413"); // and the client's own side stays open
        EXPECT_EQ(house.lobby.connections(), 1u);
    }
    EXPECT_GE(Clock::now() - begin, 2s);
}

} // namespace
} // namespace penumbra::test
