// One connection, one request: the stream that the HTTP library reads and writes, with limits of our own.
//
// Debian's cpp-httplib 0.11.4 limits neither the number of header lines nor their bytes, times each recv instead of the request, gives no
// answer to a client that closed its sending side, and closes sockets with unread data, so that the answer to a refused upload is lost.
// This stream does all of that right; only the library's parser of request line and headers is used. The headers are here before a thread
// is (lobby.hpp), the body is waited for, and what the client does not take at once of its answer is left to the lobby.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <httplib.h>

#include "http/lobby.hpp"
#include "http/trace_context.hpp"
#include "process/gate.hpp"

namespace penumbra::server {

// What a request took, for its log line; 0 where it did not get there.
struct RequestCost {
    std::string technique;
    std::uint64_t bytes_in = 0;
    double upload_ms = 0, queue_ms = 0, decode_ms = 0, compute_ms = 0, encode_ms = 0;
    double worker_ms = 0; // from the call to a worker to its answer's bytes: the last three, and what handing over takes
};

class Connection final : public httplib::Stream {
public:
    // Takes the socket, and gives it back to the lobby when it goes. `lobby` outlives it.
    Connection(Lobby& lobby, Arrival arrival, Deadline request);
    ~Connection() override;
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    // The one that this thread serves.
    static Connection& current();

    bool is_readable() const override { return true; }
    bool is_writable() const override { return true; }
    ssize_t read(char* to, size_t size) override;
    ssize_t write(const char* from, size_t size) override;
    void get_remote_ip_and_port(std::string& ip, int& port) const override;
    void get_local_ip_and_port(std::string& ip, int& port) const override;
    socket_t socket() const override { return socket_; }

    // From now on bytes belong to the body, of which `expected` are to come.
    void begin_body(std::uint64_t expected);
    bool in_body() const { return in_body_; }
    // Reads the next `size` bytes of the body straight to where they are wanted; gives how many came before it ended, or timed out.
    std::size_t read_body(char* to, std::size_t size);

    const Deadline& request() const { return request_; }
    bool timed_out() const { return timed_out_; }
    bool too_slow() const { return too_slow_; } // timed out before the request's deadline: see transfer_end()
    bool headers_too_large() const { return line_too_long_ || header_bytes_ > lobby_.limits().header_bytes; }

    // Of the request, for its handler and its log line. `reason` and `inside`: why it was refused, for metrics and for the log alone.
    std::string content_type, request_id, reason, inside;
    std::optional<TraceContext> trace;
    std::string span_id;
    RequestCost cost;
    Deadline::Clock::time_point begun;

private:
    bool late();                                     // whether the body's time is up; notes it
    std::size_t receive(char* to, std::size_t size); // waits for more of the body; 0: nothing came
    bool fill();                                     // the buffer with more of the body; false: nothing came
    std::size_t take_buffered(char* to, std::size_t size);
    void count_body(std::size_t count);

    Lobby& lobby_;
    socket_t socket_;
    Deadline request_;
    bool in_body_ = false, timed_out_ = false, too_slow_ = false, ended_ = false, line_too_long_ = false;
    std::size_t header_bytes_ = 0;
    std::uint64_t body_left_ = 0, body_bytes_ = 0;
    Deadline::Clock::time_point body_begun_;
    std::string buffer_;
    std::size_t from_ = 0; // what of the buffer was read
    std::string rest_;     // of the answer
};

} // namespace penumbra::server
