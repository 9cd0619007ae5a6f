// Ends what takes too long: work is stopped at its request's deadline, and when the service ends.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <unordered_map>

#include <penumbra/stop.hpp>

#include "process/gate.hpp"

namespace penumbra::server {

// The exit code of a worker whose time is up where nothing can stop it but its end: its driver compiles.
constexpr int ended_at_deadline = 75;

// Safe to use from several threads at once.
class Watch {
public:
    using Time = Deadline::Clock::time_point;
    // `deaf` is called, from a thread of this, when the time of work is up that is in a call that nothing can stop.
    explicit Watch(std::function<void()> deaf = [] {});
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    // As long as it lives, work of the thread that made it throws Stopped once its time is up.
    class Guard {
    public:
        Guard(Watch& watch, Time end);
        ~Guard();
        Guard(const Guard&) = delete;
        Guard& operator=(const Guard&) = delete;

    private:
        Watch& watch_;
        Stop stop_;
        StopScope scope_;
    };
    [[nodiscard]] Guard until(const Deadline& deadline) { return {*this, deadline.end()}; }

    // All work ends then, whenever it began; for good.
    void end_all(Time end);
    bool ended() const; // whether that time is over

private:
    void run();

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::unordered_map<Stop*, Time> watched_; // that were not asked to stop yet
    Time end_ = Time::max();                  // of all
    bool over_ = false;
    const std::function<void()> deaf_;
    std::thread thread_;
};

} // namespace penumbra::server
