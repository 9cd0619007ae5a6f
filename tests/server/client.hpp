// A service in this process on a free port of 127.0.0.1, requests byte by byte, and the scene that the tests send.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <penumbra/engine.hpp>
#include <penumbra/scene_file.hpp>

#include "http/service.hpp"
#include "io/image_io.hpp"
#include "support/maps.hpp"

namespace penumbra::test {

// The address sanitizer keeps what was freed, up to 256 MiB of it: resident memory says nothing there.
#ifdef __SANITIZE_ADDRESS__
constexpr bool resident_memory_is_ours = false;
#else
constexpr bool resident_memory_is_ours = true;
#endif

class Socket {
public:
    explicit Socket(int port) : socket_(::socket(AF_INET, SOCK_STREAM, 0))
    {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<std::uint16_t>(port));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        connected = ::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
    }
    ~Socket() { ::close(socket_); }
    Socket(const Socket&) = delete;
    Socket& operator=(const Socket&) = delete;

    void send(std::string_view text)
    {
        while (!text.empty()) {
            const ssize_t sent = ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
            if (sent <= 0) return;
            text.remove_prefix(static_cast<std::size_t>(sent));
        }
    }
    void end() { ::shutdown(socket_, SHUT_WR); }
    // Until the other side has sent or ended; false after a minute: a test that waits so long has failed.
    bool wait_for_bytes()
    {
        pollfd entry{socket_, POLLIN, 0};
        return ::poll(&entry, 1, 60000) > 0;
    }
    // All until the other side ends.
    std::string receive()
    {
        std::string text;
        std::array<char, 65536> buffer{};
        for (;;) {
            if (!wait_for_bytes()) return text + "(nothing came for a minute)";
            const ssize_t got = ::recv(socket_, buffer.data(), buffer.size(), 0);
            if (got <= 0) return got == 0 ? text : text + "(reset)";
            text.append(buffer.data(), static_cast<std::size_t>(got));
        }
    }

    bool connected = false;

private:
    int socket_;
};

struct Reply {
    int status = 0;
    std::string head, body;

    explicit Reply(const std::string& text)
    {
        const std::size_t end = text.find("\r\n\r\n");
        head = text.substr(0, end);
        if (end != std::string::npos) body = text.substr(end + 4);
        if (text.starts_with("HTTP/1.1 ")) status = std::stoi(text.substr(9));
    }
    std::string header(const std::string& name) const
    {
        const std::size_t at = head.find("\r\n" + name + ": ");
        if (at == std::string::npos) return {};
        const std::size_t begin = at + name.size() + 4;
        return head.substr(begin, head.find("\r\n", begin) - begin);
    }
    std::string detail() const { return nlohmann::json::parse(body, nullptr, false).value("detail", ""); }
};

inline Reply ask(int port, std::string_view request)
{
    Socket socket(port);
    socket.send(request);
    return Reply(socket.receive());
}

// Asks again while the service is out of time: on a machine that does other things too a deadline of a second or two may pass before a small
// request has its turn.
inline Reply ask_in_time(int port, std::string_view request)
{
    Reply reply = ask(port, request);
    for (int i = 0; i < 30 && (reply.status == 503 || reply.status == 504); ++i) reply = ask(port, request);
    return reply;
}

inline Reply get(int port, const std::string& path, const std::string& headers = {})
{
    std::string request = "GET ";
    request.append(path).append(" HTTP/1.1\r\nHost: 127.0.0.1\r\n").append(headers).append("\r\n");
    return ask(port, request);
}

// --- Requests ----------------------------------------------------------------------------------------------------------------------

using Parts = std::vector<std::pair<std::string, std::string>>;

inline std::string form(const Parts& parts)
{
    std::string body;
    for (const auto& [name, bytes] : parts)
        body += "--B\r\nContent-Disposition: form-data; name=\"" + name + "\"; filename=\"x\"\r\n\r\n" + bytes + "\r\n";
    return body + "--B--\r\n";
}

inline std::string head(const std::string& headers, const std::string& type = "multipart/form-data; boundary=B")
{
    return "POST /v1/masks HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: " + type + "\r\n" + headers + "\r\n";
}
inline std::string length_of(const std::string& body) { return "Content-Length: " + std::to_string(body.size()) + "\r\n"; }

inline std::string post(const std::string& body, const std::string& headers = {}) { return head(length_of(body) + headers) + body; }

inline std::string text_of(const std::vector<std::byte>& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

// A square of 1 in 4 at depth 1 under a light of half-extent 0.25, receivers at depth 2. All values are short binary fractions, so that
// 16-bit integers hold them exactly with scale 3 (65535 / 3 is whole).
constexpr int side = 32;
inline DepthMap occluder_depth() { return boxes(side, side, 1, {{8, 24, 8, 24}}); }
inline DepthMap receiver_depth() { return flat(side, side, 2); }

inline Image image_of(const DepthMap& map, float empty, float scale)
{
    Image image{map.width, map.height, 1, {}};
    for (const float depth : map.depth) image.pixels.push_back(depth == nothing_there ? empty : depth / scale);
    return image;
}

inline nlohmann::json scene_json()
{
    const nlohmann::json camera = {{"kind", "light"}, {"tan_half_fov", {1, 1}}};
    return {{"penumbra", 1},
            {"light", {{"kind", "rectangle"}, {"center", {0, 0, 0}}, {"half_u", {0.25, 0, 0}}, {"half_v", {0, 0, -0.25}}}},
            {"occluders", {{"camera", camera}, {"depth", {{"front", "front.exr"}}}}},
            {"receivers", {{"camera", camera}, {"depth", "floor.exr"}}},
            {"technique", {{"kind", "soft_shadow_map"}, {"sides", "front"}}}};
}

inline Parts parts(const nlohmann::json& scene = scene_json())
{
    return {{"scene", scene.dump()},
            {"front.exr", text_of(encode_depth(occluder_depth()))},
            {"floor.exr", text_of(encode_depth(receiver_depth()))}};
}

// The parts as the library takes them.
class PartResources final : public Resources {
public:
    explicit PartResources(Parts all) : all_(std::move(all)) {}
    Bytes bytes(const std::string& name) const override
    {
        for (const auto& [known, text] : all_)
            if (known == name) return Bytes(std::as_bytes(std::span(text)));
        throw Error(ErrorCode::not_found, name);
    }
    std::string path(const std::string& name) const override { throw Error(ErrorCode::unsupported, name); }

private:
    Parts all_;
};

// --- The service -------------------------------------------------------------------------------------------------------------------

class Running {
public:
    explicit Running(server::Options options, bool ready = true)
        : service_(with_free_port(std::move(options)), [](std::string_view) {}, PENUMBRA_SERVER), port(service_.bind())
    {
        thread_ = std::thread([this] { service_.serve(); });
        if (ready) service_.become_ready();
        while (get(port, "/healthz").status != 200) {
        } // until the library takes connections, and can be stopped
    }
    ~Running()
    {
        service_.stop();
        thread_.join();
    }
    server::Service& service() { return service_; }

private:
    static server::Options with_free_port(server::Options options)
    {
        options.port = 0;
        return options;
    }
    server::Service service_;

public:
    const int port;

private:
    std::thread thread_;
};

// One for all tests that need no options of their own. The process ends with it.
inline int shared_port()
{
    static Running running{server::Options{}};
    return running.port;
}

// Waits until a line of /metrics says so. Of what a service counts nothing tells from outside: it is asked again.
inline void wait_for_metric(int port, const std::string& line)
{
    for (int i = 0; i < 6000; ++i) {
        if (("\n" + get(port, "/metrics").body).find("\n" + line + "\n") != std::string::npos) return;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    FAIL() << "no line " << line << " within a minute";
}

} // namespace penumbra::test
