// On a terminal, one line that says what has been going on for more than a second. Otherwise nothing.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace penumbra::cli {

class Progress {
public:
    Progress();
    ~Progress(); // ends
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    // What comes next: "reading scene.json". Its time counts from here.
    void step(std::string what);
    // Clears the line; nothing is shown from here on.
    void end();

private:
    void watch(const std::stop_token& stop);

    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::string what_;
    std::chrono::steady_clock::time_point since_;
    std::jthread watcher_; // last: it uses what stands above
};

} // namespace penumbra::cli
