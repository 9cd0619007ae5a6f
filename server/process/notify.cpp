#include "process/notify.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <penumbra/error.hpp>

#include "process/wait.hpp"

namespace penumbra::server {
namespace {

using Clock = std::chrono::steady_clock;

std::string value_of(const Environment& environment, const char* name)
{
    const char* value = environment(name);
    return value ? value : "";
}

std::uint64_t number_of(const std::string& text, const char* name)
{
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || value == 0)
        throw Error(ErrorCode::usage, std::string(name) + ": \"" + text + "\" is no number", "expected 1 or more, as systemd sets it");
    return value;
}

// The watchdog's time, when it is meant for this process.
std::optional<std::chrono::microseconds> watchdog_from(const Environment& environment)
{
    const std::string time = value_of(environment, "WATCHDOG_USEC"), process = value_of(environment, "WATCHDOG_PID");
    if (time.empty()) return {};
    if (!process.empty() && number_of(process, "WATCHDOG_PID") != static_cast<std::uint64_t>(getpid())) return {};
    // What does not fit a count of microseconds is longer than any process lives.
    const std::uint64_t longest = static_cast<std::uint64_t>(std::chrono::microseconds(std::chrono::years(100)).count());
    return std::chrono::microseconds(std::min(number_of(time, "WATCHDOG_USEC"), longest));
}

// The address of a socket's name; an abstract one begins with a zero byte and has none at its end.
socklen_t address_of(const std::string& name, sockaddr_un& address)
{
    address = {};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name.data(), name.size());
    const bool abstract = name.front() == '@';
    if (abstract) address.sun_path[0] = '\0';
    return static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size() + (abstract ? 0 : 1));
}

// --- The health check --------------------------------------------------------------------------------------------------------------

bool connects(int socket, const addrinfo& to, Clock::time_point end)
{
    if (::connect(socket, to.ai_addr, to.ai_addrlen) == 0) return true;
    if (errno != EINPROGRESS || !wait_for(socket, POLLOUT, end)) return false;
    int error = 0;
    socklen_t size = sizeof(error);
    return ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) == 0 && error == 0;
}

// The whole answer has to come: a status line alone may be all that a server that hangs still sends.
bool is_answered(int socket, Clock::time_point end)
{
    // So short that a new connection takes it whole. Every service answers to localhost, whatever its names are.
    constexpr std::string_view request = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    if (::send(socket, request.data(), request.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(request.size())) return false;
    std::string answer;
    char buffer[4096];
    while (wait_for(socket, POLLIN, end)) {
        const ssize_t got = ::recv(socket, buffer, sizeof(buffer), 0);
        if (got < 0 && (errno == EAGAIN || errno == EINTR)) continue;
        if (got <= 0) return got == 0 && answer.starts_with("HTTP/1.1 200 ");
        answer.append(buffer, static_cast<std::size_t>(got));
        if (answer.size() > 65536) return false; // not ours
    }
    return false;
}

} // namespace

Notifier::Notifier(const Environment& environment) : name_(value_of(environment, "NOTIFY_SOCKET")), watchdog_(watchdog_from(environment))
{
    if (name_.empty()) {
        watchdog_.reset();
        return;
    }
    // An abstract name may fill sun_path, a path leaves room for its zero.
    const std::size_t room = sizeof(sockaddr_un::sun_path) - (name_.front() == '@' ? 0 : 1);
    if ((name_.front() != '/' && name_.front() != '@') || name_.size() < 2 || name_.size() > room)
        throw Error(ErrorCode::usage, "NOTIFY_SOCKET: \"" + name_ + "\" is no name of a socket",
                    "expected a path from / or an abstract name from @, 2 to " + std::to_string(room) + " bytes");
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket_ < 0) throw Error(ErrorCode::internal, std::string("NOTIFY_SOCKET: no socket can be had: ") + std::strerror(errno));
}

Notifier::~Notifier()
{
    if (socket_ >= 0) ::close(socket_);
}

std::string Notifier::tell(std::string_view state) const
{
    if (socket_ < 0) return {};
    sockaddr_un address;
    const socklen_t size = address_of(name_, address);
    const auto* plain = reinterpret_cast<const sockaddr*>(&address);
    const ssize_t sent = ::sendto(socket_, state.data(), state.size(), MSG_NOSIGNAL | MSG_DONTWAIT, plain, size);
    if (sent == static_cast<ssize_t>(state.size())) return {};
    return "NOTIFY_SOCKET: " + name_ + " did not take \"" + std::string(state) + "\": " + std::strerror(errno);
}

Watchdog::Watchdog(const Notifier& notifier, Healthy healthy, Say say)
    : notifier_(notifier), healthy_(std::move(healthy)), say_(std::move(say))
{
    if (const auto time = notifier.watchdog()) thread_ = std::thread([this, half = *time / 2] { run(half); });
}

Watchdog::~Watchdog()
{
    if (!thread_.joinable()) return;
    {
        const std::scoped_lock lock(mutex_);
        ending_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void Watchdog::run(std::chrono::microseconds half)
{
    bool good = true;
    auto next = Clock::now();
    for (;;) {
        const bool now_good = healthy_(half / 2);
        if (now_good) {
            // A mark that does not get through is as one that was not made: the supervisor will act.
            if (const std::string wrong = notifier_.tell("WATCHDOG=1"); !wrong.empty()) say_("warning: " + wrong);
        }
        if (good != now_good)
            say_(now_good ? "the service answers its health check again"
                          : "warning: the service does not answer its health check; the watchdog is not told that it lives");
        good = now_good;

        // On a fixed grid, so that slow checks do not add up; after a pause of the whole machine it begins anew.
        next = std::max(next + half, Clock::now());
        std::unique_lock lock(mutex_);
        if (changed_.wait_until(lock, next, [this] { return ending_; })) return;
    }
}

bool answers_health(const std::string& host, int port, std::chrono::microseconds within)
{
    const Clock::time_point end = Clock::now() + within;
    const std::string target = host == "0.0.0.0" ? "127.0.0.1" : host == "::" ? "::1" : host;
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (::getaddrinfo(target.c_str(), std::to_string(port).c_str(), &hints, &found) != 0) return false;
    bool answered = false;
    for (const addrinfo* to = found; to && !answered; to = to->ai_next) {
        const int socket = ::socket(to->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
        if (socket < 0) continue;
        answered = connects(socket, *to, end) && is_answered(socket, end);
        ::close(socket);
    }
    ::freeaddrinfo(found);
    return answered;
}

} // namespace penumbra::server
