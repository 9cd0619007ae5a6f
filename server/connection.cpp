#include "connection.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace penumbra::server {
namespace {

thread_local Connection* served = nullptr;

// How long an answer may take to be taken by the client, and how long (and how much of) a refused upload is still read.
constexpr std::chrono::seconds write_time{30}, drain_time{2};
constexpr std::uint64_t drain_bytes = std::uint64_t{4} << 20;

// Waits until the socket can be read or written; false when the time is up.
bool wait_for(socket_t socket, short what, Deadline::Clock::time_point end)
{
    for (;;) {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Deadline::Clock::now()).count();
        if (left <= 0) return false;
        pollfd entry{socket, what, 0};
        const int ready = ::poll(&entry, 1, static_cast<int>(std::min<long>(left, 1 << 30)));
        if (ready > 0) return true;
        if (ready < 0 && errno != EINTR) return false;
    }
}

using NameCall = int (*)(int, sockaddr*, socklen_t*);

void name_of(socket_t socket, NameCall call, std::string& ip, int& port)
{
    sockaddr_storage address{};
    socklen_t size = sizeof(address);
    std::array<char, NI_MAXHOST> host{};
    std::array<char, NI_MAXSERV> service{};
    auto* plain = reinterpret_cast<sockaddr*>(&address);
    if (call(socket, plain, &size) != 0 ||
        getnameinfo(plain, size, host.data(), host.size(), service.data(), service.size(), NI_NUMERICHOST | NI_NUMERICSERV) != 0)
        return;
    ip = host.data();
    port = std::atoi(service.data());
}

} // namespace

Connection::Connection(socket_t socket, Deadline headers, Deadline request) : socket_(socket), headers_(headers), request_(request)
{
    const int on = 1;
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    served = this;
}

Connection::~Connection()
{
    served = nullptr;
    ::shutdown(socket_, SHUT_WR);
    drain();
    ::close(socket_);
}

Connection& Connection::current() { return *served; }

bool Connection::fill()
{
    from_ = to_ = 0;
    if (ended_) return false;
    if (!wait_for(socket_, POLLIN, in_body_ ? request_.end() : headers_.end())) {
        timed_out_ = true;
        return false;
    }
    const ssize_t got = ::recv(socket_, buffer_.data(), buffer_.size(), 0);
    if (got <= 0) {
        ended_ = true;
        return false;
    }
    to_ = static_cast<std::size_t>(got);
    return true;
}

ssize_t Connection::read(char* to, size_t size)
{
    if (from_ == to_ && !fill()) return ended_ ? 0 : -1;
    // A drip-feeding client makes poll succeed every time: the deadline counts, not the pause.
    if ((in_body_ ? request_ : headers_).passed()) {
        timed_out_ = true;
        return -1;
    }
    const std::size_t count = std::min(size, to_ - from_);
    if (in_body_)
        body_left_ -= std::min<std::uint64_t>(body_left_, count);
    else if ((header_bytes_ += count) > max_header_bytes)
        return -1;
    std::memcpy(to, buffer_.data() + from_, count);
    from_ += count;
    return static_cast<ssize_t>(count);
}

ssize_t Connection::write(const char* from, size_t size)
{
    const auto end = Deadline::Clock::now() + write_time;
    std::size_t done = 0;
    while (done < size) {
        const ssize_t sent = ::send(socket_, from + done, size - done, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0)
            done += static_cast<std::size_t>(sent);
        else if (sent < 0 && errno == EINTR)
            continue;
        else if (sent < 0 && errno != EAGAIN && errno != EWOULDBLOCK)
            return -1;
        else if (!wait_for(socket_, POLLOUT, end))
            return -1;
    }
    return static_cast<ssize_t>(size);
}

void Connection::get_remote_ip_and_port(std::string& ip, int& port) const { name_of(socket_, &::getpeername, ip, port); }
void Connection::get_local_ip_and_port(std::string& ip, int& port) const { name_of(socket_, &::getsockname, ip, port); }

void Connection::begin_body(std::uint64_t expected)
{
    in_body_ = true;
    body_left_ = expected;
}

void Connection::drain()
{
    // A socket that is closed with unread data sends a reset, which takes the answer from under a client that is still sending. So a
    // refused upload is read on, for a while, and forgotten.
    const bool unread = in_body_ ? body_left_ > to_ - from_ : headers_too_large();
    if (!unread || ended_ || timed_out_) return;
    const auto end = Deadline::Clock::now() + drain_time;
    for (std::uint64_t drained = 0; drained < drain_bytes && wait_for(socket_, POLLIN, end);) {
        const ssize_t got = ::recv(socket_, buffer_.data(), buffer_.size(), 0);
        if (got <= 0) break;
        drained += static_cast<std::uint64_t>(got);
    }
}

} // namespace penumbra::server
