// Ends work from another thread.
//
//     penumbra::Stop stop;
//     // the thread that works                      // any other
//     const penumbra::StopScope scope(stop);
//     penumbra::Mask mask = engine.mask(scene);     stop.ask();
//
// What a thread does within the scope then throws Stopped, in milliseconds as a rule: loops on the host look between rows, kernels between
// tiles. Kernels look where the device works in the host's own memory (PoCL); elsewhere a launch that runs comes to its end first. A driver that
// compiles cannot be stopped: deaf() tells.
#pragma once

#include <atomic>
#include <exception>
#include <memory>

#include <penumbra/export.hpp>

namespace penumbra {

// The work was stopped before it was done. No Error: it is what somebody asked for.
class PENUMBRA_API Stopped : public std::exception {
public:
    const char* what() const noexcept override { return "the work was stopped before it was done"; }
};

// What loops and kernels look at. Alone on its cache line, as drivers want memory that they share.
struct alignas(128) StopWord {
    std::atomic<int> asked = 0;
    std::atomic<int> deaf = 0; // calls that nothing can stop
};

// Safe to use from several threads at once.
class PENUMBRA_API Stop {
public:
    Stop() : word_(std::make_shared<StopWord>()) {}
    void ask() noexcept { word_->asked = 1; }
    bool asked() const noexcept { return word_->asked != 0; }
    // Whether the work is in a call that nothing can stop: a driver compiles, for seconds perhaps. Once it was asked to stop it begins none.
    bool deaf() const noexcept { return word_->deaf != 0; }
    const std::shared_ptr<StopWord>& word() const { return word_; }

private:
    std::shared_ptr<StopWord> word_;
};

// As long as it lives, work of this thread ends when the stop is asked for. Scopes nest: the inner one counts.
class PENUMBRA_API StopScope {
public:
    explicit StopScope(const Stop& stop) : StopScope(stop.word()) {}
    explicit StopScope(std::shared_ptr<StopWord> word);
    ~StopScope();
    StopScope(const StopScope&) = delete;
    StopScope& operator=(const StopScope&) = delete;

private:
    std::shared_ptr<StopWord> before_;
};

} // namespace penumbra
