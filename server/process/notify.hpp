// What a supervisor is told, by systemd's protocol (sd_notify(3)) without its library: datagrams to the socket that NOTIFY_SOCKET names.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "process/options.hpp"

namespace penumbra::server {

class Notifier {
public:
    // Without NOTIFY_SOCKET nobody is told and nothing fails. Throws usage when it is neither a path nor an abstract name (`@` first), or
    // is longer than a socket's name can be; and when WATCHDOG_USEC is no time.
    explicit Notifier(const Environment& environment);
    ~Notifier();
    Notifier(const Notifier&) = delete;
    Notifier& operator=(const Notifier&) = delete;

    // Sends `state`, lines such as READY=1; never waits. Gives what went wrong, or nothing.
    std::string tell(std::string_view state) const;

    // Within what time WATCHDOG=1 is expected each time; nothing when no watchdog was asked for, or it is another process's (WATCHDOG_PID).
    std::optional<std::chrono::microseconds> watchdog() const { return watchdog_; }

private:
    std::string name_; // as in the environment
    int socket_ = -1;
    std::optional<std::chrono::microseconds> watchdog_;
};

// While it lives, a thread tells WATCHDOG=1 each half of the time that the watchdog gives, after `healthy` said yes; it says no when it is
// not. `healthy` gets the time that it may take, half of a half, so that marks are never further apart than three quarters of the
// watchdog's time. Without a watchdog it does nothing.
class Watchdog {
public:
    using Healthy = std::function<bool(std::chrono::microseconds within)>;
    using Say = std::function<void(std::string_view line)>;
    Watchdog(const Notifier& notifier, Healthy healthy, Say say);
    ~Watchdog();
    Watchdog(const Watchdog&) = delete;
    Watchdog& operator=(const Watchdog&) = delete;

private:
    void run(std::chrono::microseconds half);

    const Notifier& notifier_;
    const Healthy healthy_;
    const Say say_;
    std::mutex mutex_;
    std::condition_variable changed_;
    bool ending_ = false;
    std::thread thread_;
};

// Whether GET /healthz at that address gives 200 in that time. An address that means all of them (0.0.0.0, ::) is asked on loopback.
bool answers_health(const std::string& host, int port, std::chrono::microseconds within);

} // namespace penumbra::server
