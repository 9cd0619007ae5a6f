#include "process/channel.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include <poll.h>
#include <sys/socket.h>

#include <penumbra/error.hpp>

#include "process/wait.hpp"

namespace penumbra::server {

std::pair<Channel, Channel> Channel::pair()
{
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0)
        throw Error(ErrorCode::device, "no socket for a worker: " + std::generic_category().message(errno));
    std::pair<Channel, Channel> both{Channel(Descriptor(ends[0])), Channel(Descriptor(ends[1]))};
    for (const int end : ends) {
        const int room = 4 * most_text;
        setsockopt(end, SOL_SOCKET, SO_SNDBUF, &room, sizeof(room));
    }
    return both;
}

bool Channel::send(std::string_view text, std::span<const int> files)
{
    iovec part{const_cast<char*>(text.data()), text.size()};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(most_files * sizeof(int))> control{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    if (!files.empty()) {
        message.msg_control = control.data();
        message.msg_controllen = CMSG_SPACE(files.size_bytes());
        cmsghdr* const head = CMSG_FIRSTHDR(&message);
        head->cmsg_level = SOL_SOCKET;
        head->cmsg_type = SCM_RIGHTS;
        head->cmsg_len = CMSG_LEN(files.size_bytes());
        std::memcpy(CMSG_DATA(head), files.data(), files.size_bytes());
    }
    for (;;) {
        const ssize_t sent = sendmsg(socket_.get(), &message, MSG_NOSIGNAL);
        if (sent >= 0) return static_cast<std::size_t>(sent) == text.size();
        if (errno != EINTR) return false;
    }
}

Channel::Got Channel::receive(Message& message, Clock::time_point end)
{
    message = {};
    if (!wait_for(socket_.get(), POLLIN, end)) return Got::late;
    message.text.resize(most_text);
    iovec part{message.text.data(), message.text.size()};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(most_files * sizeof(int))> control{};
    msghdr header{};
    header.msg_iov = &part;
    header.msg_iovlen = 1;
    header.msg_control = control.data();
    header.msg_controllen = control.size();
    ssize_t got = 0;
    do got = recvmsg(socket_.get(), &header, MSG_CMSG_CLOEXEC);
    while (got < 0 && errno == EINTR);
    message.text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    for (cmsghdr* head = CMSG_FIRSTHDR(&header); head; head = CMSG_NXTHDR(&header, head)) {
        if (head->cmsg_level != SOL_SOCKET || head->cmsg_type != SCM_RIGHTS) continue;
        for (std::size_t at = CMSG_LEN(0); at + sizeof(int) <= head->cmsg_len; at += sizeof(int)) {
            int file = -1;
            std::memcpy(&file, reinterpret_cast<const char*>(head) + at, sizeof(file));
            message.files.emplace_back(file);
        }
    }
    // A message without text is none of ours; a cut one neither.
    return got <= 0 || (header.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) != 0 ? Got::ended : Got::message;
}

} // namespace penumbra::server
