// Load: many clients at once, an end in the middle of it, deadlines, memory that does not grow.
#include <atomic>
#include <future>
#include <sstream>

#include <sys/resource.h>

#include "http/metrics.hpp"
#include <penumbra/scene_file.hpp>
#include "server/client.hpp"
#include "server/program.hpp"

namespace penumbra::test {
namespace {

std::string request_of(double half_extent, const std::string& headers)
{
    nlohmann::json scene = scene_json();
    scene["light"]["half_u"] = {half_extent, 0, 0};
    scene["light"]["half_v"] = {0, 0, -half_extent};
    return post(form(parts(scene)), "Accept: image/x-portable-floatmap\r\n" + headers);
}

class OwnParts final : public Resources {
public:
    Bytes bytes(const std::string& name) const override
    {
        return Bytes(encode_depth(name == "front.exr" ? occluder_depth() : receiver_depth()));
    }
    std::string path(const std::string& name) const override { throw Error(ErrorCode::unsupported, name); }
};

// What the library computes by itself.
std::string library_mask(const Engine& engine, double half_extent)
{
    nlohmann::json scene = scene_json();
    scene["light"]["half_u"] = {half_extent, 0, 0};
    scene["light"]["half_v"] = {0, 0, -half_extent};
    return text_of(encode_image(engine.mask(parse_scene(scene.dump(), OwnParts())).visibility, {"pfm", 32}));
}

constexpr std::array extents{0.125, 0.25, 0.5};

// A thousand clients and the service's ends of their connections are more than the usual limit of descriptors.
void raise_descriptors()
{
    rlimit limit{};
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
}

bool is_whole(const Reply& reply) { return reply.status != 0 && reply.header("Content-Length") == std::to_string(reply.body.size()); }

TEST(Load, AThousandAtOnceGetEachItsOwnAnswer)
{
    raise_descriptors();
    const int port = shared_port();
    const Engine engine;
    std::array<std::string, 3> expected;
    for (std::size_t i = 0; i < 3; ++i) expected[i] = library_mask(engine, extents[i]);
    ASSERT_NE(expected[0], expected[1]);
    ASSERT_NE(expected[1], expected[2]);

    // A thread has 10 connections open: 7 good requests and 3 that are not.
    std::atomic<int> right = 0, busy = 0;
    const auto client = [&](int number) {
        for (std::vector<int> open{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}; !open.empty();) {
            std::vector<std::unique_ptr<Socket>> sockets;
            for (const int i : open) {
                const std::string id = "X-Request-Id: load-" + std::to_string(number) + "-" + std::to_string(i) + "\r\n";
                sockets.push_back(std::make_unique<Socket>(port));
                if (i < 7)
                    sockets.back()->send(request_of(extents[static_cast<std::size_t>(i) % 3], id));
                else
                    sockets.back()->send(i == 7 ? post("--B--\r\n", id) : i == 8 ? head(id) : post("--B", "Content-Encoding: br\r\n" + id));
            }
            std::vector<int> again;
            for (std::size_t k = 0; k < open.size(); ++k) {
                const int i = open[k];
                const Reply reply(sockets[k]->receive());
                EXPECT_TRUE(is_whole(reply)) << reply.head;
                EXPECT_EQ(reply.header("X-Request-Id"), "load-" + std::to_string(number) + "-" + std::to_string(i));
                if (reply.status == 503) {
                    EXPECT_EQ(reply.header("Retry-After"), "1");
                    again.push_back(i);
                    ++busy;
                } else if (i < 7) {
                    right += reply.status == 200 && reply.body == expected[static_cast<std::size_t>(i) % 3];
                } else {
                    right += reply.status == (i == 7 ? 400 : i == 8 ? 411 : 415);
                }
            }
            open = again;
        }
    };
    std::vector<std::future<void>> clients;
    for (int number = 0; number < 100; ++number) clients.push_back(std::async(std::launch::async, client, number));
    for (auto& one : clients) one.get();
    EXPECT_EQ(right, 1000);
    EXPECT_GT(busy, 0); // or it was no load
    wait_for_metric(port, "penumbra_requests_admitted 0");
}

TEST(Load, SigtermInTheMiddleOfIt)
{
    const Program program({"--port", "0"});
    const int port = program.port_when_ready();
    ASSERT_NE(port, 0);
    std::string log;
    std::jthread reader([&] { log = program.said_until("\nended\n"); });

    // Clients ask until nobody listens. Each answer is whole, or there is nothing at all: then the service had not taken the connection.
    std::atomic<int> whole = 0, broken = 0, masks = 0;
    {
        std::vector<std::jthread> clients;
        for (int number = 0; number < 16; ++number)
            clients.emplace_back([&] {
                for (;;) {
                    Socket socket(port);
                    if (!socket.connected) return;
                    socket.send(request_of(0.25, {}));
                    const std::string text = socket.receive();
                    const Reply reply(text);
                    if (reply.status == 200) ++masks;
                    masks.notify_one();
                    if (is_whole(reply))
                        ++whole;
                    else
                        broken += text != "" && text != "(reset)";
                }
            });
        for (int got = masks; got <= 16; got = masks) masks.wait(got); // each has asked again
        kill(program.process, SIGTERM);
    }
    EXPECT_EQ(program.wait(), 0);
    reader.join();
    EXPECT_EQ(broken, 0);

    // And every request in its log had its answer.
    int lines = 0;
    std::istringstream stream(log);
    for (std::string line; std::getline(stream, line);) lines += line.starts_with('{');
    EXPECT_EQ(lines, whole);
}

TEST(Load, ADeadlineThatPassesWhileAMaskIsComputed)
{
    Running hasty{server::Options{.device = {}, .token = {}, .deadline_s = 3}};
    nlohmann::json scene = scene_json();
    scene["technique"] = {{"kind", "depth_trace"}, {"samples", 65536}}; // of 96 x 96 receivers, 604 million rays: many seconds, which it does not estimate
    Parts slow = parts(scene);
    slow[2].second = text_of(encode_depth(flat(96, 96, 2)));
    const Reply reply = ask(hasty.port, post(form(slow)));
    ASSERT_EQ(reply.status, 504) << reply.head;
    EXPECT_TRUE(holds(reply.detail(), "while it was computed")) << reply.body;
    EXPECT_EQ(ask_in_time(hasty.port, post(form(parts()))).status, 200);
}

TEST(Load, MemoryDoesNotGrow)
{
    if (!resident_memory_is_ours) GTEST_SKIP() << "the sanitizer keeps freed memory";
    const int port = shared_port();
    int different = 0; // no mask is asked for twice, so none is made from what was kept
    const auto ask_times = [&](int count) {
        for (int i = 0; i < count; ++i) {
            const bool bad = i % 4 == 3;
            ASSERT_EQ(ask(port, bad ? post("--B--\r\n") : request_of(0.125 + 1e-5 * ++different, {})).status, bad ? 400 : 200);
        }
    };
    ask_times(500); // threads, arenas and caches come to what they need
    const double before = server::resident_bytes();
    ask_times(2000);
    // 1500 masks: had each left its smallest image behind, 32 x 32 floats, that would be 1500 x 4096 bytes.
    EXPECT_LT(server::resident_bytes() - before, 1500.0 * 4096);
}

} // namespace
} // namespace penumbra::test
