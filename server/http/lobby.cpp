#include "http/lobby.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <vector>

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <penumbra/error.hpp>

#include "process/wait.hpp"

namespace penumbra::server {
namespace {

// How long what a refused client still sends is read.
constexpr std::chrono::seconds forget_time{2};

// How long headers may take when somebody else needs the place.
constexpr std::chrono::seconds patience{1};

// The end of the headers: the first line that is only CR LF, as the HTTP library's parser sees it (it skips lines that end in LF alone).
bool has_headers(const std::string& bytes, std::size_t searched)
{
    return bytes.find("\n\r\n", searched < 2 ? 0 : searched - 2) != std::string::npos;
}

} // namespace

std::chrono::steady_clock::time_point LobbyLimits::transfer_end(std::chrono::steady_clock::time_point begin, std::uint64_t bytes) const
{
    return begin + transfer_grace + std::chrono::milliseconds(bytes * 1000 / slowest_transfer);
}

Lobby::Lobby(const LobbyLimits& limits, Serve serve)
    : limits_(limits), serve_(std::move(serve)), events_(epoll_create1(EPOLL_CLOEXEC)), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK))
{
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = wake_;
    if (events_ < 0 || wake_ < 0 || epoll_ctl(events_, EPOLL_CTL_ADD, wake_, &event) != 0) {
        for (const int made : {events_, wake_})
            if (made >= 0) ::close(made);
        throw Error(ErrorCode::internal, "no descriptors to wait for connections with", "expected fewer open files");
    }
    thread_ = std::thread([this] { run(); });
}

Lobby::~Lobby()
{
    wait_for_leaving();
    {
        const std::scoped_lock lock(mutex_);
        ending_ = true;
    }
    wake();
    thread_.join();
    ::close(wake_);
    ::close(events_);
}

void Lobby::arrive(int socket)
{
    std::unique_lock lock(mutex_);
    while (guests_.size() + served_ >= limits_.connections && !make_room()) changed_.wait_until(lock, next_room());
    const auto guest = guests_.emplace(socket, Guest{}).first;
    guest->second.begun = Clock::now();
    begin_phase(guest, Phase::headers, false);
}

void Lobby::leave(int socket, std::string rest, bool unread)
{
    const std::scoped_lock lock(mutex_);
    --served_;
    if (rest.empty() && !unread) {
        ::close(socket);
        changed_.notify_all();
        return;
    }
    const auto guest = guests_.emplace(socket, Guest{}).first;
    guest->second.bytes = std::move(rest);
    guest->second.unread = unread;
    waiting_bytes_ += guest->second.bytes.size();
    begin_phase(guest, Phase::sending, false);
    if (guest->second.bytes.empty()) begin_forgetting(guest);
    while (waiting_bytes_ > limits_.answer_bytes) give_up_an_answer();
}

void Lobby::wait_for_arrivals()
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock,
                  [this] { return std::ranges::none_of(guests_, [](const auto& entry) { return entry.second.phase == Phase::headers; }); });
}

void Lobby::wait_for_leaving()
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return guests_.empty() && served_ == 0; });
}

void Lobby::end_by(Clock::time_point end)
{
    const std::scoped_lock lock(mutex_);
    end_ = end;
    next_end_ = std::min(next_end_, end);
    wake();
}

std::size_t Lobby::connections() const
{
    const std::scoped_lock lock(mutex_);
    return guests_.size() + served_;
}

void Lobby::run()
{
    std::array<epoll_event, 64> ready{};
    for (;;) {
        // Wait for a guest, or until somebody's time is up. Who brings that moment forward wakes.
        int timeout = 0;
        {
            const std::scoped_lock lock(mutex_);
            if (ending_) return;
            timeout = milliseconds_until(next_end_);
        }
        const int count = epoll_wait(events_, ready.data(), static_cast<int>(ready.size()), timeout);

        const std::scoped_lock lock(mutex_);
        for (int i = 0; i < count; ++i) {
            const int descriptor = ready[static_cast<std::size_t>(i)].data.fd;
            eventfd_t ignored = 0;
            if (descriptor == wake_)
                eventfd_read(wake_, &ignored);
            else if (const auto guest = guests_.find(descriptor); guest != guests_.end())
                move_on(guest);
        }
        if (const auto now = Clock::now(); now >= next_end_) end_late(now);
    }
}

void Lobby::wake() const { eventfd_write(wake_, 1); }

Lobby::Clock::time_point Lobby::end_of(const Guest& guest) const { return std::min(end_.load(), end_of_phase(guest)); }

Lobby::Clock::time_point Lobby::end_of_phase(const Guest& guest) const
{
    switch (guest.phase) {
    case Phase::headers:
        return guest.phase_begun + limits_.header_time;
    case Phase::sending:
        return limits_.transfer_end(guest.phase_begun, guest.done);
    case Phase::forgetting:
        return guest.phase_begun + forget_time;
    }
    return Clock::time_point::max();
}

// `watched`: whether epoll knows the socket already.
void Lobby::begin_phase(Guests::iterator entry, Phase phase, bool watched)
{
    Guest& guest = entry->second;
    guest.phase = phase;
    guest.phase_begun = Clock::now();
    watch(entry->first, phase, watched);
    changed_.notify_all();
    if (const auto end = end_of(guest); end < next_end_) {
        next_end_ = end;
        wake();
    }
}

void Lobby::move_on(Guests::iterator guest)
{
    switch (guest->second.phase) {
    case Phase::headers:
        return read_headers(guest);
    case Phase::sending:
        return send(guest);
    case Phase::forgetting:
        return forget(guest);
    }
}

void Lobby::read_headers(Guests::iterator guest)
{
    std::array<char, 65536> buffer;
    const ssize_t got = ::recv(guest->first, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
    if (got <= 0) return hand_over(guest, false, true);
    std::string& bytes = guest->second.bytes;
    const std::size_t searched = bytes.size();
    bytes.append(buffer.data(), static_cast<std::size_t>(got));
    if (bytes.size() > limits_.header_bytes || has_headers(bytes, searched)) hand_over(guest, false, false);
}

void Lobby::send(Guests::iterator entry)
{
    Guest& guest = entry->second;
    const ssize_t sent =
        ::send(entry->first, guest.bytes.data() + guest.done, guest.bytes.size() - guest.done, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
    if (sent < 0) return close(entry);
    guest.done += static_cast<std::size_t>(sent);
    if (guest.done == guest.bytes.size()) begin_forgetting(entry);
}

void Lobby::begin_forgetting(Guests::iterator entry)
{
    Guest& guest = entry->second;
    waiting_bytes_ -= guest.bytes.size();
    guest.bytes = {};
    guest.done = 0;
    ::shutdown(entry->first, SHUT_WR);
    if (!guest.unread) return close(entry);
    begin_phase(entry, Phase::forgetting, true);
}

void Lobby::forget(Guests::iterator guest)
{
    std::array<char, 65536> buffer;
    const ssize_t got = ::recv(guest->first, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
    if (got > 0) guest->second.done += static_cast<std::size_t>(got);
    if (got <= 0 || guest->second.done > limits_.forget_bytes) close(guest);
}

void Lobby::hand_over(Guests::iterator guest, bool timed_out, bool ended)
{
    Arrival arrival{guest->first, guest->second.begun, std::move(guest->second.bytes), timed_out, ended};
    // Who has not even said a line gets no answer: there is no request.
    if ((timed_out || ended) && arrival.bytes.find('\n') == std::string::npos) return close(guest);
    epoll_ctl(events_, EPOLL_CTL_DEL, guest->first, nullptr);
    guests_.erase(guest);
    ++served_;
    changed_.notify_all();
    serve_(std::move(arrival));
}

void Lobby::end_late(Clock::time_point now)
{
    std::vector<int> late;
    next_end_ = Clock::time_point::max();
    for (const auto& [socket, guest] : guests_) {
        if (const auto end = end_of(guest); end <= now)
            late.push_back(socket);
        else
            next_end_ = std::min(next_end_, end);
    }
    for (const int socket : late) {
        const auto guest = guests_.find(socket);
        if (guest->second.phase == Phase::headers)
            hand_over(guest, true, false);
        else
            close(guest);
    }
}

// From when on a guest may be pushed out.
Lobby::Clock::time_point Lobby::may_go(const Guest& guest)
{
    switch (guest.phase) {
    case Phase::headers:
        return guest.phase_begun + patience;
    case Phase::sending:
        break;
    case Phase::forgetting:
        return guest.phase_begun;
    }
    return Clock::time_point::max();
}

bool Lobby::make_room()
{
    // Clients that mean it send their headers at once, so the oldest that does not is the least loss.
    const auto now = Clock::now();
    auto oldest = guests_.end();
    for (auto guest = guests_.begin(); guest != guests_.end(); ++guest)
        if (may_go(guest->second) <= now && (oldest == guests_.end() || guest->second.phase_begun < oldest->second.phase_begun))
            oldest = guest;
    if (oldest == guests_.end()) return false;
    close(oldest);
    return true;
}

// When make_room() will find somebody if nobody leaves before.
Lobby::Clock::time_point Lobby::next_room() const
{
    auto next = Clock::time_point::max();
    for (const auto& [socket, guest] : guests_) next = std::min(next, may_go(guest));
    return next;
}

void Lobby::give_up_an_answer()
{
    auto oldest = guests_.end();
    for (auto guest = guests_.begin(); guest != guests_.end(); ++guest)
        if (guest->second.phase == Phase::sending && (oldest == guests_.end() || guest->second.phase_begun < oldest->second.phase_begun))
            oldest = guest;
    close(oldest); // there is one: bytes wait
}

void Lobby::close(Guests::iterator guest)
{
    if (guest->second.phase == Phase::sending) waiting_bytes_ -= guest->second.bytes.size();
    ::close(guest->first); // which takes it out of epoll's set
    guests_.erase(guest);
    changed_.notify_all();
}

void Lobby::watch(int socket, Phase phase, bool watched) const
{
    epoll_event event{};
    event.events = phase == Phase::sending ? EPOLLOUT : EPOLLIN;
    event.data.fd = socket;
    epoll_ctl(events_, watched ? EPOLL_CTL_MOD : EPOLL_CTL_ADD, socket, &event);
}

} // namespace penumbra::server
