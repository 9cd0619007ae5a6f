#include "process/gate.hpp"

#include <string>

namespace penumbra::server {

void Deadline::check(std::string_view next) const
{
    if (!passed()) return;
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limit_).count();
    throw Problem(504, "deadline", "the request's " + std::to_string(seconds) + " s were over before it came to: " + std::string(next), 1);
}

Problem Deadline::over() const
{
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limit_).count();
    return Problem(504, "deadline", "the request's " + std::to_string(seconds) + " s were over while it was computed; expected less work: fewer samples, smaller maps, a smaller mask");
}

Problem Deadline::over_compiling() const
{
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limit_).count();
    return Problem(504, "deadline", "the request's " + std::to_string(seconds) + " s were over while kernels for its settings were compiled; expected a service that has less to do, or settings closer to a preset", 1);
}

bool Gate::full() const
{
    const std::scoped_lock lock(mutex_);
    return admitted_ >= places_;
}

Gate::Guard Gate::admit()
{
    const std::scoped_lock lock(mutex_);
    if (admitted_ >= places_) throw Problem(503, "queue_full", "all " + std::to_string(places_) + " places are taken; try again", 1);
    ++admitted_;
    return Guard(*this);
}

Gate::Slot Gate::enter(const Deadline& deadline)
{
    std::unique_lock lock(mutex_);
    const auto self = waiting_.insert(waiting_.end(), 0);
    const bool mine = turn_.wait_until(lock, deadline.end(), [&] { return computing_ < slots_ && self == waiting_.begin(); });
    waiting_.erase(self);
    // Who was behind is in front now, whether this one computes or gives up.
    turn_.notify_all();
    if (!mine) {
        lock.unlock();
        deadline.check("a free compute slot");
        throw Problem(504, "deadline", "no compute slot was free in time", 1);
    }
    ++computing_;
    return Slot(*this);
}

Gate::Counts Gate::counts() const
{
    const std::scoped_lock lock(mutex_);
    return {admitted_, waiting_.size(), computing_ + beside_};
}

void Gate::leave_house()
{
    const std::scoped_lock lock(mutex_);
    --admitted_;
}

void Gate::leave_slot(bool beside)
{
    {
        const std::scoped_lock lock(mutex_);
        --(beside ? beside_ : computing_);
    }
    turn_.notify_all();
}

bool Gate::step_aside()
{
    {
        const std::scoped_lock lock(mutex_);
        if (beside_ >= spares_) return false;
        ++beside_;
        --computing_;
    }
    turn_.notify_all();
    return true;
}

} // namespace penumbra::server
