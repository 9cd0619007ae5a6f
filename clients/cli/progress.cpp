#include "progress.hpp"

#include "streams.hpp"

namespace penumbra::cli {

using Clock = std::chrono::steady_clock;

Progress::Progress() : since_(Clock::now())
{
    if (on_terminal()) watcher_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

Progress::~Progress() { end(); }

void Progress::end()
{
    if (!watcher_.joinable()) return;
    watcher_.request_stop();
    watcher_.join();
    draw_line("");
}

void Progress::step(std::string what)
{
    const std::lock_guard lock(mutex_);
    what_ = std::move(what);
    since_ = Clock::now();
}

void Progress::watch(const std::stop_token& stop)
{
    std::unique_lock lock(mutex_);
    std::string drawn;
    while (!stop.stop_requested()) {
        changed_.wait_for(lock, stop, std::chrono::milliseconds(250), [] { return false; });
        const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - since_).count();
        const std::string line = what_ + ", " + std::to_string(seconds) + " s";
        if (stop.stop_requested() || seconds < 1 || what_.empty() || line == drawn) continue;
        draw_line(line);
        drawn = line;
    }
}

} // namespace penumbra::cli
