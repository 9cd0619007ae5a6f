#include "http/connection.hpp"

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

#include "process/wait.hpp"

namespace penumbra::server {
namespace {

thread_local Connection* served = nullptr;

constexpr std::size_t read_bytes = 65536; // at a time
constexpr std::chrono::milliseconds turn{100};

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

Connection::Connection(Lobby& lobby, Arrival arrival, Deadline request)
    : begun(arrival.begun), lobby_(lobby), socket_(arrival.socket), request_(request), timed_out_(arrival.timed_out), ended_(arrival.ended),
      buffer_(std::move(arrival.bytes))
{
    const int on = 1;
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    // A request line without an end is none; a line that cannot be read has the library answer, and headers_too_large() say what.
    if (buffer_.find('\n') == std::string::npos) {
        line_too_long_ = true;
        buffer_ = "\r\n";
    }
    served = this;
}

Connection::~Connection()
{
    served = nullptr;
    // A socket that is closed with unread data sends a reset, which takes the answer from under a client that is still sending.
    const bool unread = !ended_ && !timed_out_ && (in_body_ ? body_left_ > buffer_.size() - from_ : headers_too_large());
    lobby_.leave(socket_, std::move(rest_), unread);
}

Connection& Connection::current() { return *served; }

bool Connection::late()
{
    // A drip-feeding client has bytes every time one looks: the deadlines count, not the pause.
    const auto slow = lobby_.limits().transfer_end(body_begun_, body_bytes_);
    const auto ends = std::min(request_.end(), lobby_.end());
    if (Deadline::Clock::now() < std::min(slow, ends)) return false;
    timed_out_ = true;
    too_slow_ = slow < ends;
    return true;
}

std::size_t Connection::receive(char* to, std::size_t size)
{
    for (;;) {
        if (ended_ || late()) return 0;
        const ssize_t got = ::recv(socket_, to, size, MSG_DONTWAIT);
        if (got > 0) return static_cast<std::size_t>(got);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
            // In short turns: the service may have been told to end.
            wait_for(socket_, POLLIN, std::min({lobby_.limits().transfer_end(body_begun_, body_bytes_), request_.end(), Deadline::Clock::now() + turn}));
        else
            ended_ = true;
    }
}

bool Connection::fill()
{
    from_ = 0;
    buffer_.clear();
    // The headers are all here: what is missing of them does not come.
    if (ended_ || !in_body_) return false;
    buffer_.resize(read_bytes);
    buffer_.resize(receive(buffer_.data(), buffer_.size()));
    return !buffer_.empty();
}

ssize_t Connection::read(char* to, size_t size)
{
    if (from_ == buffer_.size() && !fill()) return ended_ ? 0 : -1;
    if (in_body_ && late()) return -1;
    const std::size_t count = take_buffered(to, size);
    if (in_body_) {
        count_body(count);
    } else {
        header_bytes_ += count;
        if (header_bytes_ > lobby_.limits().header_bytes) return -1;
    }
    return static_cast<ssize_t>(count);
}

std::size_t Connection::read_body(char* to, std::size_t size)
{
    std::size_t done = take_buffered(to, size);
    count_body(done);
    while (done < size) {
        const std::size_t got = receive(to + done, size - done);
        if (got == 0) break;
        count_body(got);
        done += got;
    }
    return done;
}

std::size_t Connection::take_buffered(char* to, std::size_t size)
{
    const std::size_t count = std::min(size, buffer_.size() - from_);
    std::memcpy(to, buffer_.data() + from_, count);
    from_ += count;
    return count;
}

void Connection::count_body(std::size_t count)
{
    body_left_ -= std::min<std::uint64_t>(body_left_, count);
    body_bytes_ += count;
}

ssize_t Connection::write(const char* from, size_t size)
{
    std::size_t done = 0;
    while (rest_.empty() && done < size) {
        const ssize_t sent = ::send(socket_, from + done, size - done, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0)
            done += static_cast<std::size_t>(sent);
        else if (sent < 0 && errno == EINTR)
            continue;
        else if (sent < 0 && errno != EAGAIN && errno != EWOULDBLOCK)
            return -1;
        else
            break;
    }
    rest_.append(from + done, size - done);
    return static_cast<ssize_t>(size);
}

void Connection::get_remote_ip_and_port(std::string& ip, int& port) const { name_of(socket_, &::getpeername, ip, port); }
void Connection::get_local_ip_and_port(std::string& ip, int& port) const { name_of(socket_, &::getsockname, ip, port); }

void Connection::begin_body(std::uint64_t expected)
{
    in_body_ = true;
    body_left_ = expected;
    body_begun_ = Deadline::Clock::now();
}

} // namespace penumbra::server
