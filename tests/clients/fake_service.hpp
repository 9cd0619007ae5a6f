// A service that answers by script: one answer a connection, in order; it keeps the requests. Afterwards connections are refused.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <gtest/gtest.h>

namespace penumbra::test {

inline std::string answer(int status, const std::string& body = {}, const std::string& headers = {})
{
    return "HTTP/1.1 " + std::to_string(status) + " x\r\nContent-Length: " + std::to_string(body.size()) + "\r\nConnection: close\r\n" +
           headers + "\r\n" + body;
}

inline std::string problem(int status, const std::string& reason, const std::string& headers = {})
{
    return answer(status, R"({"status": 1, "detail": "the detail", "reason": ")" + reason + R"(", "request_id": "r-1"})",
                  "Content-Type: application/problem+json\r\n" + headers);
}

// A mask of 2 x 1: 0.25 and 1.
inline std::string mask_answer(const std::string& headers = {})
{
    const std::array<float, 2> samples{0.25f, 1.0f};
    return answer(200, "Pf\n2 1\n-1.0\n" + std::string(reinterpret_cast<const char*>(samples.data()), sizeof(samples)),
                  "Content-Type: image/x-portable-floatmap\r\nX-Request-Id: r-1\r\n" + headers);
}

class FakeService {
public:
    using Script = std::function<void(int socket)>;
    struct Answer {
        std::string bytes;
        Script script; // instead of the bytes
        bool read_body = true;
        Answer(std::string text) : bytes(std::move(text)) {}
        Answer(Script call, bool read) : script(std::move(call)), read_body(read) {}
    };

    explicit FakeService(std::vector<Answer> answers) : answers_(std::move(answers)), listener_(::socket(AF_INET, SOCK_STREAM, 0))
    {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof(address);
        EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
        EXPECT_EQ(::listen(listener_, 16), 0);
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
        url = "http://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
        thread_ = std::thread([this] { serve(); });
    }
    ~FakeService()
    {
        finish();
        EXPECT_EQ(requests.size(), answers_.size()) << "answers were not asked for";
    }
    // Waits until every answer is given; `requests` may be read then.
    void finish()
    {
        if (!thread_.joinable()) return;
        ::shutdown(listener_, SHUT_RDWR);
        thread_.join();
        ::close(listener_);
    }

    std::string url;
    std::vector<std::string> requests;

private:
    void serve()
    {
        for (const Answer& reply : answers_) {
            const int socket = ::accept(listener_, nullptr, nullptr);
            if (socket < 0) break;
            requests.push_back(receive(socket, reply.read_body));
            if (reply.script)
                reply.script(socket);
            else
                ::send(socket, reply.bytes.data(), reply.bytes.size(), MSG_NOSIGNAL);
            ::close(socket);
        }
        ::shutdown(listener_, SHUT_RDWR);
    }

    static std::string receive(int socket, bool whole)
    {
        std::string text;
        std::array<char, 65536> block;
        std::size_t expected = std::string::npos;
        while (text.size() < expected) {
            const ssize_t got = ::recv(socket, block.data(), block.size(), 0);
            if (got <= 0) break;
            text.append(block.data(), static_cast<std::size_t>(got));
            const std::size_t head = text.find("\r\n\r\n");
            if (head == std::string::npos) continue;
            const std::size_t length = text.find("Content-Length: ");
            expected = head + 4 + (whole && length < head ? static_cast<std::size_t>(std::stoul(text.substr(length + 16))) : 0);
        }
        return text;
    }

    std::vector<Answer> answers_;
    int listener_;
    std::thread thread_;
};

} // namespace penumbra::test
