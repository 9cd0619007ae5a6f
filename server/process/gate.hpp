// Admission: how many requests are in the house, and how many of them compute.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <list>
#include <mutex>
#include <string_view>
#include <utility>

#include "process/problem.hpp"

namespace penumbra::server {

// When a request's time is up.
class Deadline {
public:
    using Clock = std::chrono::steady_clock;
    explicit Deadline(Clock::duration time, Clock::time_point begin = Clock::now()) : limit_(time), end_(begin + time) {}

    Clock::time_point end() const { return end_; }
    bool passed() const { return Clock::now() >= end_; }
    // Throws Problem 504 when it has passed; `next` is what would have come now.
    void check(std::string_view next) const;
    // The Problem 504 of what was stopped on its way.
    Problem over() const;

private:
    Clock::duration limit_;
    Clock::time_point end_;
};

inline double seconds_since(Deadline::Clock::time_point begin)
{
    return std::chrono::duration<double>(Deadline::Clock::now() - begin).count();
}

// `slots` requests compute; `queue` more may upload or wait, first come first served. Safe to use from several threads at once.
class Gate {
public:
    Gate(std::size_t slots, std::size_t queue) : slots_(slots), places_(slots + queue) {}

    // Leaves when it goes out of scope.
    class Guard {
    public:
        Guard(Gate& gate, void (Gate::*leave)()) : gate_(&gate), leave_(leave) {}
        Guard(Guard&& other) noexcept : gate_(std::exchange(other.gate_, nullptr)), leave_(other.leave_) {}
        Guard& operator=(Guard&&) = delete;
        ~Guard()
        {
            if (gate_) (gate_->*leave_)();
        }

    private:
        Gate* gate_;
        void (Gate::*leave_)();
    };

    bool full() const;
    [[nodiscard]] Guard admit();                         // a place in the house; throws Problem 503 when there is none
    [[nodiscard]] Guard enter(const Deadline& deadline); // a slot; waits; throws Problem 504 when the deadline passes first

    struct Counts {
        std::size_t admitted, waiting, computing;
    };
    Counts counts() const;

private:
    void leave_house();
    void leave_slot();

    const std::size_t slots_, places_;
    mutable std::mutex mutex_;
    std::condition_variable turn_;
    std::size_t admitted_ = 0, computing_ = 0;
    std::list<int> waiting_; // in order of arrival; an entry's address tells whose it is
};

} // namespace penumbra::server
