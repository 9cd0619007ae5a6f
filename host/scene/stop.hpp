// Where long work looks whether it is to end (penumbra/stop.hpp).
#pragma once

#include <memory>
#include <utility>

#include <penumbra/stop.hpp>

namespace penumbra {

// Of the innermost scope of this thread; null outside of any.
const std::shared_ptr<StopWord>& current_stop();

// Throws Stopped when the word says so.
void check_stop(const StopWord* word);
inline void check_stop() { check_stop(current_stop().get()); }

// Around a call that nothing can stop. Throws Stopped when it is not to begin: who asks for the stop either sees it, or has stopped it.
class Deaf {
public:
    explicit Deaf(std::shared_ptr<StopWord> word) : word_(std::move(word))
    {
        if (!word_) return;
        ++word_->deaf;
        if (word_->asked == 0) return;
        end();
        throw Stopped();
    }
    ~Deaf() { end(); }
    Deaf(const Deaf&) = delete;
    Deaf& operator=(const Deaf&) = delete;

    // The call has come to where it can be stopped again. From any thread.
    void end() noexcept
    {
        if (word_ && !over_.exchange(true)) --word_->deaf;
    }

private:
    std::shared_ptr<StopWord> word_;
    std::atomic<bool> over_ = false;
};

} // namespace penumbra
