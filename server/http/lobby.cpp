#include "http/lobby.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <vector>

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <penumbra/error.hpp>

namespace penumbra::server {
namespace {

// How long what a refused client still sends is read.
constexpr std::chrono::seconds forget_time{2};

// How long headers may take when somebody else needs the place.
constexpr std::chrono::seconds patience{1};

constexpr std::chrono::milliseconds tick{50}; // how late a deadline may be noticed

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

Lobby::Lobby(const LobbyLimits& limits, Serve serve) : limits_(limits), serve_(std::move(serve)), events_(epoll_create1(EPOLL_CLOEXEC))
{
    if (events_ < 0) throw Error(ErrorCode::internal, "no epoll descriptor", "expected fewer open files");
    thread_ = std::thread([this] { run(); });
}

Lobby::~Lobby()
{
    wait_for_leaving();
    {
        const std::scoped_lock lock(mutex_);
        ending_ = true;
    }
    thread_.join();
    ::close(events_);
}

void Lobby::arrive(int socket)
{
    std::unique_lock lock(mutex_);
    while (guests_.size() + served_ >= limits_.connections && !make_room()) {
        lock.unlock();
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        lock.lock();
    }
    Guest guest;
    guest.begun = guest.phase_begun = Clock::now();
    guests_.emplace(socket, std::move(guest));
    watch(socket, Phase::headers, false);
}

void Lobby::leave(int socket, std::string rest, bool unread)
{
    const std::scoped_lock lock(mutex_);
    --served_;
    if (rest.empty() && !unread) {
        ::close(socket);
        return;
    }
    Guest guest;
    guest.phase = Phase::sending;
    guest.begun = guest.phase_begun = Clock::now();
    guest.bytes = std::move(rest);
    guest.unread = unread;
    waiting_bytes_ += guest.bytes.size();
    const auto entered = guests_.emplace(socket, std::move(guest)).first;
    watch(socket, Phase::sending, false);
    if (entered->second.bytes.empty()) begin_forgetting(entered);
}

void Lobby::wait_for_arrivals()
{
    for (;;) {
        {
            const std::scoped_lock lock(mutex_);
            if (!any(Phase::headers)) return;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
}

void Lobby::wait_for_leaving()
{
    for (;;) {
        if (connections() == 0) return;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
}

std::size_t Lobby::connections() const
{
    const std::scoped_lock lock(mutex_);
    return guests_.size() + served_;
}

bool Lobby::any(Phase phase) const
{
    return std::ranges::any_of(guests_, [&](const auto& entry) { return entry.second.phase == phase; });
}

void Lobby::run()
{
    std::array<epoll_event, 64> ready{};
    auto looked = Clock::now();
    for (;;) {
        const int count = epoll_wait(events_, ready.data(), static_cast<int>(ready.size()), static_cast<int>(tick.count()));
        const std::scoped_lock lock(mutex_);
        for (int i = 0; i < count; ++i)
            if (const auto guest = guests_.find(ready[static_cast<std::size_t>(i)].data.fd); guest != guests_.end()) move_on(guest);
        if (const auto now = Clock::now(); now - looked >= tick) {
            looked = now;
            end_late(now);
        }
        if (ending_) return;
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
    guest.phase = Phase::forgetting;
    guest.phase_begun = Clock::now();
    watch(entry->first, Phase::forgetting, true);
}

void Lobby::forget(Guests::iterator guest)
{
    std::array<char, 65536> buffer;
    const ssize_t got = ::recv(guest->first, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
    if (got <= 0 || (guest->second.done += static_cast<std::size_t>(got)) > limits_.forget_bytes) close(guest);
}

void Lobby::hand_over(Guests::iterator guest, bool timed_out, bool ended)
{
    Arrival arrival{guest->first, guest->second.begun, std::move(guest->second.bytes), timed_out, ended};
    // Who has not even said a line gets no answer: there is no request.
    if ((timed_out || ended) && arrival.bytes.find('\n') == std::string::npos) return close(guest);
    epoll_ctl(events_, EPOLL_CTL_DEL, guest->first, nullptr);
    guests_.erase(guest);
    ++served_;
    serve_(std::move(arrival));
}

void Lobby::end_late(Clock::time_point now)
{
    std::vector<int> late;
    for (const auto& [socket, guest] : guests_) {
        const bool over = guest.phase == Phase::headers   ? now - guest.phase_begun >= limits_.header_time
                          : guest.phase == Phase::sending ? now >= limits_.transfer_end(guest.phase_begun, guest.done)
                                                          : now - guest.phase_begun >= forget_time;
        if (over) late.push_back(socket);
    }
    for (const int socket : late) {
        const auto guest = guests_.find(socket);
        if (guest->second.phase == Phase::headers)
            hand_over(guest, true, false);
        else
            close(guest);
    }
    while (waiting_bytes_ > limits_.answer_bytes) give_up_an_answer();
}

bool Lobby::make_room()
{
    // Clients that mean it send their headers at once, so the oldest that does not is the least loss.
    const auto now = Clock::now();
    auto oldest = guests_.end();
    for (auto guest = guests_.begin(); guest != guests_.end(); ++guest) {
        const bool may_go = guest->second.phase == Phase::forgetting ||
                            (guest->second.phase == Phase::headers && now - guest->second.phase_begun >= patience);
        if (may_go && (oldest == guests_.end() || guest->second.phase_begun < oldest->second.phase_begun)) oldest = guest;
    }
    if (oldest == guests_.end()) return false;
    close(oldest);
    return true;
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
}

void Lobby::watch(int socket, Phase phase, bool already)
{
    epoll_event event{};
    event.events = phase == Phase::sending ? EPOLLOUT : EPOLLIN;
    event.data.fd = socket;
    epoll_ctl(events_, already ? EPOLL_CTL_MOD : EPOLL_CTL_ADD, socket, &event);
}

} // namespace penumbra::server
