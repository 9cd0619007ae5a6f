// The HTTP library, with connections of our own (connection.hpp). Only the service's own files see it.
#pragma once

#include <atomic>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>

#include <httplib.h>

#include "http/connection.hpp"
#include "http/service.hpp"
#include "masks/mask_choice.hpp"

namespace penumbra::server {

class Service::Http final : public httplib::Server {
public:
    explicit Http(Service& service);
    void lengthen_backlog();
    // All connections are closed by then, whatever they wait for.
    void end_by(Deadline::Clock::time_point end);

private:
    class Reception;
    bool process_and_close_socket(socket_t socket) override;
    void serve(Lobby& lobby, Arrival arrival);
    // After the headers are read, before anything is decided.
    void begin(httplib::Request& request, Connection& connection);

    Service& service_;
    std::atomic<Lobby*> lobby_ = nullptr; // while it serves
};

// A Content-Length; nothing when it is no number.
inline std::optional<std::uint64_t> length_from(const std::string& text)
{
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return {};
    return value;
}

// Which mask the query asks for. Throws Problem 400.
inline MaskChoice choice_of(const httplib::Request& request) { return choice_from({request.params.begin(), request.params.end()}); }

} // namespace penumbra::server
