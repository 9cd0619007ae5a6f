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
    // The same, where kernels for it were compiled.
    Problem over_compiling() const;

private:
    Clock::duration limit_;
    Clock::time_point end_;
};

inline double seconds_since(Deadline::Clock::time_point begin)
{
    return std::chrono::duration<double>(Deadline::Clock::now() - begin).count();
}

// `slots` requests compute; `queue` more may upload or wait, first come first served. What takes long may go on beside them, up to `spares`
// requests. Safe to use from several threads at once.
class Gate {
public:
    Gate(std::size_t slots, std::size_t queue, std::size_t spares = 0) : slots_(slots), places_(slots + queue), spares_(spares) {}

    // Leaves when it goes out of scope.
    class Guard {
    public:
        explicit Guard(Gate& gate) : gate_(&gate) {}
        Guard(Guard&& other) noexcept : gate_(std::exchange(other.gate_, nullptr)) {}
        Guard& operator=(Guard&&) = delete;
        ~Guard()
        {
            if (gate_) gate_->leave_house();
        }

    private:
        Gate* gate_;
    };
    // The same, of a request that computes.
    class Slot {
    public:
        explicit Slot(Gate& gate) : gate_(&gate) {}
        Slot(Slot&& other) noexcept : gate_(std::exchange(other.gate_, nullptr)), beside_(other.beside_) {}
        Slot& operator=(Slot&&) = delete;
        ~Slot()
        {
            if (gate_) gate_->leave_slot(beside_);
        }
        // Goes on beside the slots, so that the next one may compute. False while as many as may do so already do.
        bool step_aside() { return beside_ = beside_ || gate_->step_aside(); }

    private:
        Gate* gate_;
        bool beside_ = false;
    };

    bool full() const;
    [[nodiscard]] Guard admit();                        // a place in the house; throws Problem 503 when there is none
    [[nodiscard]] Slot enter(const Deadline& deadline); // waits; throws Problem 504 when the deadline passes first

    struct Counts {
        std::size_t admitted, waiting, computing; // computing: those beside the slots too
    };
    Counts counts() const;

private:
    void leave_house();
    void leave_slot(bool beside);
    bool step_aside();

    const std::size_t slots_, places_, spares_;
    mutable std::mutex mutex_;
    std::condition_variable turn_;
    std::size_t admitted_ = 0, computing_ = 0, beside_ = 0; // computing: in the slots
    std::list<int> waiting_; // in order of arrival; an entry's address tells whose it is
};

} // namespace penumbra::server
