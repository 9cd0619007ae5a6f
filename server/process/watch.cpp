#include "process/watch.hpp"

#include <algorithm>
#include <utility>

namespace penumbra::server {

Watch::Guard::Guard(Watch& watch, Time end) : watch_(watch), scope_(stop_)
{
    const std::scoped_lock lock(watch_.mutex_);
    watch_.watched_.emplace(&stop_, end);
    watch_.changed_.notify_one();
}

Watch::Guard::~Guard()
{
    const std::scoped_lock lock(watch_.mutex_);
    watch_.watched_.erase(&stop_);
}

Watch::Watch(std::function<void()> deaf) : deaf_(std::move(deaf)), thread_([this] { run(); }) {}

Watch::~Watch()
{
    {
        const std::scoped_lock lock(mutex_);
        over_ = true;
    }
    changed_.notify_one();
    thread_.join();
}

void Watch::end_all(Time end)
{
    const std::scoped_lock lock(mutex_);
    end_ = end;
    changed_.notify_one();
}

bool Watch::ended() const
{
    const std::scoped_lock lock(mutex_);
    return Deadline::Clock::now() >= end_;
}

void Watch::run()
{
    std::unique_lock lock(mutex_);
    while (!over_) {
        const Time now = Deadline::Clock::now();
        Time next = Time::max();
        for (auto at = watched_.begin(); at != watched_.end();) {
            const Time end = std::min(at->second, end_);
            if (end <= now) {
                at->first->ask();
                if (at->first->deaf()) deaf_();
                at = watched_.erase(at);
            } else {
                next = std::min(next, end);
                ++at;
            }
        }
        // A time that is never would overflow in the wait.
        if (next == Time::max())
            changed_.wait(lock);
        else
            changed_.wait_until(lock, next);
    }
}

} // namespace penumbra::server
