// Messages between the service and a worker: text with file descriptors beside it, whole or not at all (a socket of sequenced packets).
#pragma once

#include <chrono>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "process/descriptor.hpp"

namespace penumbra::server {

struct Message {
    std::string text;
    std::vector<Descriptor> files = {};
};

class Channel {
public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::size_t most_text = 128 * 1024; // bytes of a message's text
    static constexpr std::size_t most_files = 4;

    enum class Got { message, late, ended };

    Channel() = default;
    explicit Channel(Descriptor socket) : socket_(std::move(socket)) {}
    // Two ends that belong together. Throws Error device where the system has no more sockets.
    static std::pair<Channel, Channel> pair();

    // False: the other side is gone. Descriptors stay the caller's.
    bool send(std::string_view text, std::span<const int> files = {});
    // Waits until `end`; ended: the other side is gone.
    Got receive(Message& message, Clock::time_point end);

    int descriptor() const { return socket_.get(); }
    explicit operator bool() const { return static_cast<bool>(socket_); }

private:
    Descriptor socket_;
};

} // namespace penumbra::server
