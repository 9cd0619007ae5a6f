// Hostile clients, through real sockets: what each gets, and that others are served meanwhile.
#include <condition_variable>
#include <csignal>
#include <memory>
#include <mutex>

#include "http/metrics.hpp"
#include "server/client.hpp"

namespace penumbra::test {
namespace {

using Clock = std::chrono::steady_clock;
using Sockets = std::vector<std::unique_ptr<Socket>>;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// Sends a byte of `text` to each socket four times a second, as long as it lives.
class Trickle {
public:
    Trickle(int port, int count, const std::string& begin, const std::string& text) : text_(text)
    {
        for (int i = 0; i < count; ++i) {
            sockets_.push_back(std::make_unique<Socket>(port));
            sockets_.back()->send(begin);
        }
        thread_ = std::jthread([this](const std::stop_token& stop) {
            std::mutex mutex;
            std::condition_variable_any pace;
            std::unique_lock lock(mutex);
            for (std::size_t at = 0; !stop.stop_requested(); ++at) {
                for (const auto& socket : sockets_) socket->send(text_.substr(at % text_.size(), 1));
                pace.wait_for(lock, stop, std::chrono::milliseconds(250), [] { return false; });
            }
        });
    }

private:
    std::string text_;
    Sockets sockets_;
    std::jthread thread_; // ends first
};

// Who waits for one of these clients waits for its headers' time, 5 s, less what the client was there before: a good request that takes 4 s
// has waited for none.
constexpr double undisturbed_s = 4;

void expect_good_requests_undisturbed(int port)
{
    for (int i = 0; i < 5; ++i) {
        const auto begin = Clock::now();
        EXPECT_EQ(ask(port, post(form(parts()))).status, 200);
        EXPECT_LT(seconds_since(begin), undisturbed_s);
        EXPECT_EQ(get(port, "/healthz").status, 200);
    }
}

TEST(Attack, ClientsWhoTrickleHeaders)
{
    for (const int count : {8, 300}) {
        const Trickle slow(shared_port(), count, "GET /healthz HTTP/1.1\r\n", "X: y\r\n");
        expect_good_requests_undisturbed(shared_port());
    }
}

TEST(Attack, ClientsWhoSayNothing)
{
    const Trickle silent(shared_port(), 300, "", " ");
    expect_good_requests_undisturbed(shared_port());
}

TEST(Attack, MoreConnectionsThanTheServiceKeeps)
{
    // 600 are more than it keeps: the oldest of them make room.
    const Trickle slow(shared_port(), 600, "GET /healthz HTTP/1.1\r\n", "X: y\r\n");
    expect_good_requests_undisturbed(shared_port());
}

TEST(Attack, RefusedUploadsThatGoOn)
{
    const Trickle refused(shared_port(), 100, head("Content-Length: 1000000\r\nContent-Encoding: gzip\r\n"), "x");
    expect_good_requests_undisturbed(shared_port());
}

TEST(Attack, BodiesThatTrickleLoseTheirPlaces)
{
    Running small{server::Options{.device = {}, .token = {}, .slots = 1, .queue = 1}};
    const std::string begin = head("Content-Length: 100000\r\n") + "--B";
    Socket watched(small.port);
    watched.send(begin);
    wait_for_metric(small.port, "penumbra_requests_admitted 1");
    const Trickle slow(small.port, 300, begin, "x");
    wait_for_metric(small.port, "penumbra_requests_admitted 2");

    // Every place is taken: good requests are told so and do not wait, and get their masks when the slow ones are dropped.
    EXPECT_EQ(ask(small.port, post(form(parts()))).status, 503);
    const Reply dropped(watched.receive());
    EXPECT_EQ(dropped.status, 408);
    EXPECT_TRUE(holds(dropped.detail(), "16384")) << dropped.body;
    wait_for_metric(small.port, "penumbra_requests_admitted 0");
    EXPECT_EQ(ask(small.port, post(form(parts()))).status, 200);
}

// --- Requests that are none -----------------------------------------------------------------------------------------------------------

struct Case {
    std::string what, request;
    int status;
};

// One answer, whole, with nothing of the inside in it and no header of the client's making.
void expect_one_answer(const Case& c)
{
    Socket socket(shared_port());
    socket.send(c.request);
    socket.end();
    const std::string text = socket.receive();
    const Reply reply(text);
    EXPECT_EQ(reply.status, c.status) << c.what << "\n" << text.substr(0, 2000);
    EXPECT_EQ(text.find("HTTP/1.1 ", 1), std::string::npos) << c.what << ": two answers";
    EXPECT_EQ(std::to_string(reply.body.size()), reply.header("Content-Length")) << c.what;
    for (const char* never : {"EXCEPTION", "X-Evil", "\r\nEvil", "terminate", "/work", "std::"})
        EXPECT_FALSE(holds(reply.head, never)) << c.what << ": " << reply.head;
}

TEST(Attack, RequestsThatAreNone)
{
    const std::string host = "Host: 127.0.0.1\r\n", health = "GET /healthz HTTP/1.1\r\n" + host;
    std::string headers, ranges = "Range: bytes=0-";
    for (int i = 0; i < 20000; ++i) headers += "H" + std::to_string(i) + ": x\r\n";
    for (int i = 0; i < 1000; ++i) ranges += ",0-";
    const std::vector<Case> cases{
        {"20000 headers", health + headers + "\r\n", 431},
        {"a header line without end", health + "X: " + std::string(1 << 20, 'x'), 431},
        {"a request line without end", "GET /" + std::string(1 << 20, 'x'), 431},
        {"a path of 8000 characters", "GET /" + std::string(8000, 'x') + " HTTP/1.1\r\n" + host + "\r\n", 404},
        {"a path of 9000 characters", "GET /" + std::string(9000, 'x') + " HTTP/1.1\r\n" + host + "\r\n", 414},
        {"a path of 8000 slashes", "GET " + std::string(8000, '/') + " HTTP/1.1\r\n" + host + "\r\n", 404},
        {"a NUL in the path", std::string("GET /health\0z HTTP/1.1\r\n", 24) + host + "\r\n", 400},
        {"an encoded NUL in the path", "GET /healthz%00 HTTP/1.1\r\n" + host + "\r\n", 404},
        {"CR LF in the path", "GET /x%0d%0aX-Evil:%201 HTTP/1.1\r\n" + host + "\r\n", 404},
        {"CR LF in a header", health + "X-Request-Id: a%0d%0aX-Evil: 1\r\n\r\n", 200},
        {"CR LF in a token", health + "Authorization: Bearer a%0d%0aX-Evil: 1\r\n\r\n", 200},
        {"NULs in a header", health + std::string("X: \0\0\0\r\n\r\n", 10), 200},
        {"an absurd method", "EVIL /healthz HTTP/1.1\r\n" + host + "\r\n", 400},
        {"a method of 10000 characters", std::string(10000, 'G') + " /healthz HTTP/1.1\r\n" + host + "\r\n", 414},
        {"a method that is none of ours", "TRACE /healthz HTTP/1.1\r\n" + host + "\r\n", 405},
        {"HTTP of another number", "GET /healthz HTTP/9.9\r\n" + host + "\r\n", 400},
        {"TLS", std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\n", 12), 400},
        {"1000 ranges", health + ranges + "\r\n\r\n", 200},
        {"another's address", health + "REMOTE_ADDR: 6.6.6.6\r\nX-Forwarded-For: 6.6.6.6\r\nForwarded: for=6.6.6.6\r\n\r\n", 200},
        {"two requests at once", health + "\r\n" + health + "\r\n", 200},
        {"a chunked body without end", head("Transfer-Encoding: chunked\r\n") + "FFFFFFFFFFFFFFFE\r\n" + std::string(3 << 20, 'x'), 411},
        {"length and chunks", head("Content-Length: 4\r\nTransfer-Encoding: chunked\r\n") + "0\r\n\r\n" + health + "\r\n", 411},
        {"two lengths", head("Content-Length: 0\r\nContent-Length: 60\r\n") + health + "\r\n", 400},
        {"a length that overflows", head("Content-Length: 18446744073709551617\r\n"), 400},
    };
    for (const Case& c : cases) expect_one_answer(c);
}

TEST(Attack, AFormThatIsCompressedIsNotInflated)
{
    if (!resident_memory_is_ours) GTEST_SKIP() << "the sanitizer keeps freed memory";
    // What it would become does not matter: nothing looks inside.
    const int port = shared_port(); // with its kernels, which are none of the request's
    const double before = server::resident_bytes();
    for (int i = 0; i < 20; ++i) EXPECT_EQ(ask(port, post(std::string(2 << 20, '\x1f'), "Content-Encoding: gzip\r\n")).status, 415);
    // 20 bodies of 2 MiB would be 40 MiB.
    EXPECT_LT(server::resident_bytes() - before, 20 * (2 << 20));
}

TEST(Attack, ABodyAfterAnEarlyAnswerIsNoRequest)
{
    Socket socket(shared_port());
    const std::string hidden = "GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
    socket.send("GET /secret HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: " + std::to_string(hidden.size()) + "\r\n\r\n");
    socket.wait_for_bytes();
    socket.send(hidden);
    const std::string text = socket.receive();
    EXPECT_TRUE(text.starts_with("HTTP/1.1 404 "));
    EXPECT_EQ(text.find("HTTP/1.1 ", 1), std::string::npos);
}

TEST(Attack, TwoServicesDoNotShareAPort)
{
    server::Service second(server::Options{.port = shared_port(), .device = {}, .token = {}}, [](std::string_view) {}, PENUMBRA_SERVER);
    EXPECT_THROW(second.bind(), Error);
}

} // namespace
} // namespace penumbra::test
