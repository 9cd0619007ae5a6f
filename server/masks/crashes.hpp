// Requests that ended their worker: what did it twice, and never came through between, is not tried again for a while.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <list>
#include <mutex>
#include <string>

namespace penumbra::server {

// Safe to use from several threads at once.
class Crashes {
public:
    using Clock = std::chrono::steady_clock;
    using Now = std::function<Clock::time_point()>;
    static constexpr int most_deaths = 2;
    static constexpr std::size_t most_requests = 1024; // that are remembered; the oldest goes first
    static constexpr std::chrono::minutes time{10};

    explicit Crashes(Now now = Clock::now) : now_(std::move(now)) {}
    bool any() const { return any_; } // whether a request's digest is worth making
    void note(const std::string& digest);
    // It came through: its worker had been ended by something else.
    void absolve(const std::string& digest);
    // Throws Problem 422 for one that ended most_deaths workers within `time`.
    void check(const std::string& digest);

private:
    struct Entry {
        std::string digest;
        int deaths = 0;
        Clock::time_point last;
    };
    std::list<Entry>::iterator at(const std::string& digest);
    void tidy();
    const Now now_;
    std::atomic<bool> any_ = false;
    std::mutex mutex_;
    std::list<Entry> entries_; // the last in front
};

} // namespace penumbra::server
