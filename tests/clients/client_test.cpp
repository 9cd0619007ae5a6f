// The C++ client against services that answer by script, and against the real one.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include <penumbra/client.hpp>

#include "clients/fake_service.hpp"
#include "clients/server_program.hpp"

namespace penumbra::test {
namespace {

using namespace std::chrono_literals;
using client::Client;
using client::Images;
using client::Mask;
using Json = nlohmann::json;

const Json scene{{"penumbra", 1}};

// Retries without long pauses.
client::Options quick(int retries = 4, std::chrono::milliseconds timeout = 60s)
{
    return {.token = {}, .timeout = timeout, .retries = retries, .backoff = 1ms, .traceparent = {}};
}

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::string kept(const std::string& id, int status = 201)
{
    return answer(status, R"({"id": ")" + id + R"(", "expires_s": 600, "bytes": 7, "warnings": ["w"]})");
}

TEST(ClientRequest, WhatIsSentAndWhatComesBack)
{
    FakeService fake({mask_answer("Server-Timing: queue;dur=0.5, decode;desc=x;dur=2, cdn\r\nETag: \"e\"\r\n"
                                  "Penumbra-Warnings: [\"a, b\", \"\\u00e4\"]\r\n")});
    const Client service(fake.url + "/below/", {.token = "secret", .traceparent = "00-1-2-01"});
    const Mask mask = service.mask(scene, {{"front.exr", "\r\n--x"}});
    fake.finish();
    const std::string& sent = fake.requests.at(0);
    EXPECT_TRUE(sent.starts_with("POST /below/v1/masks HTTP/1.1\r\n")) << sent;
    for (const char* header : {"Authorization: Bearer secret\r\n", "traceparent: 00-1-2-01\r\n", "Accept: image/x-portable-floatmap\r\n"})
        EXPECT_TRUE(holds(sent, header)) << sent;
    EXPECT_TRUE(holds(sent, "name=\"scene\"; filename=\"scene\"\r\n\r\n{\"penumbra\":1}\r\n--")) << sent;
    EXPECT_TRUE(holds(sent, "name=\"front.exr\"; filename=\"front.exr\"\r\n\r\n\r\n--x\r\n--")) << sent;
    EXPECT_FALSE(holds(sent, "If-None-Match"));

    EXPECT_EQ(mask.visibility.width, 2);
    EXPECT_EQ(mask.visibility.pixels, (std::vector<float>{0.25f, 1}));
    EXPECT_EQ(mask.warnings, (std::vector<std::string>{"a, b", "\u00e4"}));
    EXPECT_EQ(mask.stages_ms, (std::vector<std::pair<std::string, double>>{{"queue", 0.5}, {"decode", 2}}));
    EXPECT_EQ(mask.request_id, "r-1");
    EXPECT_EQ(mask.etag, "\"e\"");
}

TEST(ClientRequest, ALightAndAFrame)
{
    FakeService fake({mask_answer(), mask_answer()});
    const Client service(fake.url);
    (void)service.mask(scene, {}, {.light = "lamp-1", .frame = 12});
    (void)service.mask(scene, {}, {.frame = 1});
    EXPECT_THROW((void)service.mask(scene, {}, {.light = "a&b"}), std::invalid_argument);
    EXPECT_THROW((void)service.mask(scene, {}, {.frame = -1}), std::invalid_argument);
    fake.finish();
    ASSERT_EQ(fake.requests.size(), 2u);
    EXPECT_TRUE(fake.requests[0].starts_with("POST /v1/masks?light=lamp-1&frame=12 HTTP/1.1\r\n")) << fake.requests[0].substr(0, 80);
    EXPECT_TRUE(fake.requests[1].starts_with("POST /v1/masks?frame=1 HTTP/1.1\r\n")) << fake.requests[1].substr(0, 80);
}

TEST(ClientRequest, TheBoundOfAMask)
{
    const std::string type = "Content-Type: image/x-exr\r\n";
    FakeService fake({answer(200, "first", type), answer(200, "second", type)});
    const Client service(fake.url);
    const Mask bound = service.mask(scene, {}, {.format = client::Format::exr, .image = client::MaskImage::bound});
    EXPECT_EQ(bound.bytes, "first");
    EXPECT_TRUE(bound.visibility.pixels.empty());
    (void)service.mask(scene, {}, {.format = client::Format::exr, .light = "lamp", .image = client::MaskImage::bound});
    EXPECT_THROW((void)service.mask(scene, {}, {.image = client::MaskImage::bound}), std::invalid_argument); // PFM holds no two channels
    fake.finish();
    ASSERT_EQ(fake.requests.size(), 2u);
    EXPECT_TRUE(fake.requests[0].starts_with("POST /v1/masks?image=bound HTTP/1.1\r\n")) << fake.requests[0].substr(0, 80);
    EXPECT_TRUE(holds(fake.requests[0], "Accept: image/x-exr\r\n"));
    EXPECT_TRUE(fake.requests[1].starts_with("POST /v1/masks?light=lamp&image=bound HTTP/1.1\r\n")) << fake.requests[1].substr(0, 80);
}

TEST(ClientRequest, PreviousMaskStandsWhenNothingChanged)
{
    FakeService fake({mask_answer("ETag: \"e\"\r\n"), answer(304), mask_answer("ETag: \"f\"\r\n"), answer(304)});
    const Client service(fake.url);
    const Mask first = service.mask(scene);
    EXPECT_EQ(service.mask(scene, {}, {.previous = &first}).visibility.pixels, first.visibility.pixels);
    EXPECT_EQ(service.mask(scene, {}, {.previous = &first}).etag, "\"f\"");
    EXPECT_THROW(service.mask(scene), client::ServerError); // nobody asked for a 304
    fake.finish();
    EXPECT_TRUE(holds(fake.requests.at(1), "If-None-Match: \"e\"\r\n"));
}

TEST(ClientRequest, WrongArgumentsAreFoundBeforeAnythingIsSent)
{
    for (const char* url : {"127.0.0.1:8080", "ftp://x", "http://", "http:///v1", "http://x?a", "http://user@x", "http://x y"})
        EXPECT_THROW((void)Client(url), std::invalid_argument) << url;
    EXPECT_THROW((void)Client("http://x", quick(-1)), std::invalid_argument);
    EXPECT_THROW((void)Client("http://x", quick(0, 0ms)), std::invalid_argument);
    const Client service("http://127.0.0.1:1", quick(0));
    for (const char* name : {"scene", "", ".a", "a/b", "a b", "a\"", "a\n"})
        EXPECT_THROW(service.mask(scene, {{name, "x"}}), std::invalid_argument);
    EXPECT_THROW(service.mask(scene, {{std::string(129, 'a'), "x"}}), std::invalid_argument);
    EXPECT_THROW(service.mask(scene, {{"a", ""}}), std::invalid_argument);
}

template <class Kind> void expect_problem(int status)
{
    FakeService fake({problem(status, "why")});
    try {
        (void)Client(fake.url, quick(0)).mask(scene);
        ADD_FAILURE() << status << " is no error";
    } catch (const client::Error& error) {
        EXPECT_EQ(typeid(error), typeid(Kind)) << status;
        EXPECT_EQ(error.problem().status, status);
        EXPECT_EQ(error.problem().detail, "the detail");
        EXPECT_EQ(error.problem().reason, "why");
        EXPECT_EQ(error.problem().request_id, "r-1");
        EXPECT_EQ(error.what(), std::to_string(status) + ": the detail");
    }
}

TEST(ClientErrors, EachStatusHasItsClass)
{
    for (const int status : {400, 405, 406, 411, 415, 431}) expect_problem<client::BadRequest>(status);
    expect_problem<client::Unauthorized>(401);
    expect_problem<client::NotFound>(404);
    expect_problem<client::DeadlineExceeded>(408);
    expect_problem<client::TooLarge>(413);
    expect_problem<client::Unprocessable>(422);
    expect_problem<client::ServerError>(500);
    expect_problem<client::Overloaded>(503);
    expect_problem<client::DeadlineExceeded>(504);
    expect_problem<client::ServerError>(302);
}

TEST(ClientErrors, BrokenAnswers)
{
    const std::string type = "Content-Type: image/x-portable-floatmap\r\n";
    for (const std::string& reply :
         {std::string(), std::string("garbage\r\n\r\n"), std::string("HTTP/1.1 200 OK\r\n"), std::string(70000, '\0'),
          "HTTP/1.1 200 OK\r\n" + type + "Content-Length: 99\r\n\r\nPf", answer(200, "Pf\n", type), answer(200, "", type),
          answer(200, "<html>", "Content-Type: text/html\r\n"), mask_answer("Penumbra-Warnings: {\r\n"),
          mask_answer("Penumbra-Warnings: [3]\r\n"), answer(502, std::string("\xff\xfe\0<", 4)), answer(500, "[[["),
          answer(500, R"({"detail": 3, "reason": []})")}) {
        FakeService fake({reply});
        EXPECT_THROW((void)Client(fake.url, quick()).mask(scene), client::Error) << reply.substr(0, 80);
    }
    for (const std::string& reply : {kept("../masks"), kept(""), answer(200, "[]"), answer(200, R"({"id": "a", "expires_s": "x"})")}) {
        FakeService fake({reply});
        EXPECT_THROW((void)Client(fake.url, quick()).keep(scene), client::ServerError) << reply;
    }
}

TEST(ClientErrors, SlowAnswersEndAtTheTimeout)
{
    const auto silent = [](int socket) {
        char c = 0;
        (void)!::recv(socket, &c, 1, 0);
    };
    const auto trickle = [](int socket) {
        for (int i = 0; i < 300 && ::send(socket, "H", 1, MSG_NOSIGNAL) == 1; ++i) std::this_thread::sleep_for(50ms);
    };
    const auto trickle_body = [&](int socket) {
        const std::string head = "HTTP/1.1 200 OK\r\nContent-Length: 999\r\n\r\n";
        ::send(socket, head.data(), head.size(), MSG_NOSIGNAL);
        trickle(socket);
    };
    for (const FakeService::Script& script :
         {FakeService::Script(silent), FakeService::Script(trickle), FakeService::Script(trickle_body)}) {
        FakeService fake({{script, true}});
        const auto begun = std::chrono::steady_clock::now();
        try {
            (void)Client(fake.url, quick(4, 500ms)).mask(scene);
            ADD_FAILURE() << "no timeout";
        } catch (const client::DeadlineExceeded& error) {
            EXPECT_EQ(error.problem().status, 0);
            EXPECT_EQ(error.problem().reason, "timeout");
        }
        EXPECT_LT(std::chrono::steady_clock::now() - begun, 10s);
    }
}

// The service answers by the headers and closes; what the client still sends is answered by a reset.
TEST(ClientErrors, AnUploadThatIsRefusedEarlySaysWhy)
{
    const auto refuse = [](int socket) {
        const std::string text = problem(413, "body_bytes");
        ::send(socket, text.data(), text.size(), MSG_NOSIGNAL);
        ::shutdown(socket, SHUT_WR);
        std::this_thread::sleep_for(200ms);
    };
    FakeService fake({{refuse, false}});
    EXPECT_THROW((void)Client(fake.url).mask(scene, {{"x", std::string(64 << 20, 'x')}}), client::TooLarge);
}

// Whether a write meets a closed connection is a matter of time, so the guard is tested by itself.
TEST(ClientErrors, AWriteToAClosedConnectionDoesNotEndTheProcess)
{
    std::signal(SIGPIPE, SIG_DFL); // what a program starts with
    std::array<int, 2> ends{};
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
    ::close(ends[1]);
    {
        const client::detail::NoBrokenPipe guard;
        EXPECT_EQ(::write(ends[0], "x", 1), -1);
        EXPECT_EQ(errno, EPIPE);
    }
    ::close(ends[0]);
    sigset_t pending, blocked;
    sigpending(&pending);
    pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
    EXPECT_EQ(sigismember(&pending, SIGPIPE), 0);
    EXPECT_EQ(sigismember(&blocked, SIGPIPE), 0);
}

TEST(ClientErrors, AResetIsAConnectionThatFailed)
{
    FakeService fake({{[](int socket) {
                           const linger at_once{.l_onoff = 1, .l_linger = 0};
                           ::setsockopt(socket, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
                       },
                       false}});
    EXPECT_THROW((void)Client(fake.url).mask(scene, {{"x", std::string(64 << 20, 'x')}}), client::ConnectionFailed);
}

TEST(ClientRetries, AgainAfter503NeverSoonerThanAsked)
{
    FakeService fake({problem(503, "queue_full", "Retry-After: 1\r\n"), problem(503, "queue_full"), mask_answer()});
    const auto begun = std::chrono::steady_clock::now();
    EXPECT_EQ(Client(fake.url, quick()).mask(scene).visibility.width, 2);
    EXPECT_GE(std::chrono::steady_clock::now() - begun, 1s);
}

TEST(ClientRetries, GivesUp)
{
    {
        FakeService fake({problem(503, "x"), problem(503, "x"), problem(503, "x")});
        EXPECT_THROW((void)Client(fake.url, quick(2)).mask(scene), client::Overloaded);
    }
    FakeService fake({problem(503, "x", "Retry-After: 3600\r\n")});
    try {
        (void)Client(fake.url, quick()).mask(scene);
        ADD_FAILURE() << "no error";
    } catch (const client::Overloaded& error) {
        EXPECT_EQ(error.problem().retry_after_s, 3600);
    }
}

TEST(ClientRetries, RetryAfterAsADate)
{
    EXPECT_EQ(client::detail::retry_after_s("17"), 17);
    EXPECT_EQ(client::detail::retry_after_s("Sun, 06 Nov 1994 08:49:37 GMT"), 0);
    EXPECT_GT(client::detail::retry_after_s("Fri, 31 Dec 2100 23:59:59 GMT"), 1e6);
    for (const char* text : {"", "soon", "-1", "1.5", "1 "}) EXPECT_FALSE(client::detail::retry_after_s(text)) << text;
}

TEST(ClientRetries, NothingElseIsTriedAgain)
{
    for (const std::string& reply : {problem(400, "x"), problem(408, "x"), problem(500, "x"), problem(504, "x"), std::string()}) {
        FakeService fake({reply});
        EXPECT_THROW((void)Client(fake.url, quick()).mask(scene), client::Error);
        fake.finish();
        EXPECT_EQ(fake.requests.size(), 1u);
    }
}

TEST(ClientRetries, ARefusedConnection)
{
    std::string url;
    {
        FakeService gone(std::vector<FakeService::Answer>{});
        url = gone.url;
    }
    try {
        (void)Client(url, quick(2)).mask(scene);
        ADD_FAILURE() << "no error";
    } catch (const client::ConnectionFailed& error) {
        EXPECT_EQ(error.problem().reason, "connect");
    }
    EXPECT_THROW((void)Client(url, quick(0)).ready(), client::ConnectionFailed);
}

TEST(ClientKeeping, PatchesAndUploadsAgainWhenForgotten)
{
    FakeService fake({kept("ab12"), mask_answer(), mask_answer(), problem(404, "no_scene"), kept("cd34"), mask_answer(), answer(204),
                      problem(404, "no_scene")});
    auto kept_scene = Client(fake.url, quick()).keep(scene, {{"front.exr", "x"}});
    EXPECT_EQ(kept_scene.id(), "ab12");
    EXPECT_EQ(kept_scene.expires_s(), 600);
    EXPECT_EQ(kept_scene.warnings(), (std::vector<std::string>{"w"}));
    (void)kept_scene.mask({{"light", {{"center", {1, 2, 3}}}}});
    (void)kept_scene.mask({{"receivers", {{"depth", "other.exr"}}}}, {{"other.exr", "y"}});
    (void)kept_scene.mask();
    EXPECT_EQ(kept_scene.id(), "cd34");
    kept_scene.forget();
    kept_scene.forget();
    fake.finish();
    EXPECT_TRUE(holds(fake.requests.at(1), "POST /v1/scenes/ab12/masks "));
    EXPECT_TRUE(holds(fake.requests.at(1), "Content-Type: application/merge-patch+json\r\n"));
    EXPECT_TRUE(fake.requests.at(1).ends_with("\r\n\r\n{\"light\":{\"center\":[1,2,3]}}"));
    EXPECT_TRUE(holds(fake.requests.at(2), "{\"receivers\":{\"depth\":\"other.exr\"}}"));
    EXPECT_TRUE(holds(fake.requests.at(4), "name=\"front.exr\""));
    EXPECT_TRUE(holds(fake.requests.at(5), "POST /v1/scenes/cd34/masks "));
    EXPECT_TRUE(holds(fake.requests.at(6), "DELETE /v1/scenes/cd34 "));
}

TEST(ClientKeeping, UploadsAgainOnceAndForThatReasonOnly)
{
    {
        FakeService fake({kept("ab12"), problem(404, "no_scene"), kept("ab12"), problem(404, "no_scene")});
        auto kept_scene = Client(fake.url, quick()).keep(scene);
        EXPECT_THROW(kept_scene.mask(), client::NotFound);
    }
    FakeService fake({kept("ab12"), problem(404, "no_route")});
    auto kept_scene = Client(fake.url, quick()).keep(scene);
    EXPECT_THROW(kept_scene.mask(), client::NotFound);
}

TEST(ClientImages, PfmThereAndBack)
{
    const Image grey{3, 2, 1, {1, 2, 3, 4, 5.5f, std::numeric_limits<float>::infinity()}};
    const std::string bytes = client::pfm_bytes(grey);
    EXPECT_EQ(bytes.substr(0, 12), "Pf\n3 2\n-1.0\n");
    EXPECT_EQ(client::image_from_pfm(bytes)->pixels, grey.pixels);
    const Image colour{1, 2, 3, {1, 2, 3, 4, 5, 6}};
    EXPECT_EQ(client::image_from_pfm(client::pfm_bytes(colour))->pixels, colour.pixels);
    EXPECT_EQ(client::image_from_pfm(std::string("Pf\n1 1\n1.0\n\x3f\x80\0\0", 15))->pixels, (std::vector<float>{1})); // big endian
    for (const Image& wrong : {Image{}, Image{2, 2, 1, {1, 2, 3}}, Image{1, 1, 2, {1, 2}}, Image{-1, -1, 1, {1}}})
        EXPECT_THROW((void)client::pfm_bytes(wrong), std::invalid_argument);
}

TEST(ClientImages, WhatIsNoWholePfm)
{
    const std::string whole = client::pfm_bytes({1, 1, 1, {1}});
    for (const std::string& bytes :
         {std::string(), std::string("P"), std::string("Pf\n"), std::string("P5\n1 1\n-1\n\0\0\0\0", 14), whole + "x",
          whole.substr(0, whole.size() - 1), std::string("Pf\n0 1\n-1\n"), std::string("Pf\n1 1\n0\n\0\0\0\0", 13),
          std::string("Pf\n-1 -1\n-1\n\0\0\0\0", 16), std::string("Pf\n99999999999 1\n-1\n"),
          std::string("PF\n2147483647 2147483647\n-1\n"), std::string("Pf\n1 1\nnan\n\0\0\0\0", 15)})
        EXPECT_FALSE(client::image_from_pfm(bytes)) << bytes;
}

// --- The real service ----------------------------------------------------------------------------------------------------------------

constexpr int side = 32;

Images images()
{
    Image front{side, side, 1, {}}, floor{20, side, 1, std::vector<float>(20 * side, 2.0f)};
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            front.pixels.push_back(x >= 8 && x < 24 && y >= 8 && y < 20 ? 1 : std::numeric_limits<float>::infinity());
    return {{"front.pfm", client::pfm_bytes(front)}, {"floor.pfm", client::pfm_bytes(floor)}};
}

Json whole_scene()
{
    return {{"penumbra", 1},
            {"light", {{"kind", "rectangle"}, {"center", {0, 0, 0}}, {"half_u", {0.25, 0, 0}}, {"half_v", {0, 0, -0.25}}}},
            {"occluders", {{"camera", {{"kind", "light"}, {"tan_half_fov", 1}}}, {"depth", {{"front", "front.pfm"}}}}},
            {"receivers", {{"camera", {{"kind", "light"}, {"tan_half_fov", 0.5}}}, {"depth", "floor.pfm"}}},
            {"technique", {{"kind", "soft_shadow_map"}, {"sides", "front"}}}};
}

class ClientAndService : public ::testing::Test {
protected:
    ServerProgram server{{"--body-bytes", "4194304"}};
    Client service{server.url, {.token = server_token, .traceparent = {}}};
};

TEST_F(ClientAndService, Masks)
{
    EXPECT_TRUE(service.ready());
    const Mask mask = service.mask(whole_scene(), images());
    EXPECT_EQ(mask.visibility.width, 20);
    EXPECT_EQ(mask.visibility.height, side);
    const auto [darkest, brightest] = std::ranges::minmax(mask.visibility.pixels);
    EXPECT_LT(darkest, 0.5f); // there is a shadow
    EXPECT_EQ(brightest, 1.0f);
    EXPECT_FALSE(mask.stages_ms.empty());
    EXPECT_FALSE(mask.request_id.empty());
    EXPECT_EQ(service.mask(whole_scene(), images(), {.format = client::Format::png}).bytes.substr(0, 4), "\x89PNG");
    EXPECT_EQ(service.mask(whole_scene(), images(), {.format = client::Format::exr}).bytes.substr(0, 4), "\x76\x2f\x31\x01");
    EXPECT_EQ(service.mask(whole_scene(), images(), {.format = client::Format::tiff}).bytes.substr(0, 2), "II");

    EXPECT_FALSE(service.techniques().at("techniques").empty());
    EXPECT_FALSE(service.devices().at("devices").empty());
}

TEST_F(ClientAndService, Errors)
{
    Json tilted = whole_scene();
    tilted["light"]["half_v"] = {0.25, 0, 0.5};
    try {
        (void)service.mask(tilted, images());
        ADD_FAILURE() << "no error";
    } catch (const client::Unprocessable& error) {
        EXPECT_TRUE(holds(error.problem().detail, "light.half_v")) << error.what();
    }
    EXPECT_THROW((void)Client(server.url).mask(whole_scene(), images()), client::Unauthorized);
    EXPECT_THROW((void)Client(server.url + "/nowhere", {.token = server_token, .traceparent = {}}).mask(whole_scene(), images()),
                 client::NotFound);
    EXPECT_THROW((void)service.mask(whole_scene(), {{"x", std::string(100 << 20, 'x')}}), client::TooLarge);
}

TEST_F(ClientAndService, KeptScenesAndPreviousMasks)
{
    auto kept_scene = service.keep(whole_scene(), images());
    const Mask first = service.mask(whole_scene(), images());
    EXPECT_EQ(kept_scene.mask().visibility.pixels, first.visibility.pixels);

    const Json patch{{"light", {{"half_u", {0.5, 0, 0}}}}};
    Json moved = whole_scene();
    moved.merge_patch(patch);
    const Mask other = kept_scene.mask(patch);
    EXPECT_EQ(other.visibility.pixels, service.mask(moved, images()).visibility.pixels);
    EXPECT_NE(other.visibility.pixels, first.visibility.pixels);

    kept_scene.forget();
    EXPECT_EQ(kept_scene.mask().visibility.pixels, first.visibility.pixels);
    kept_scene.forget();

    EXPECT_FALSE(first.etag.empty());
    EXPECT_EQ(service.mask(whole_scene(), images(), {.previous = &first}).request_id, first.request_id); // the same answer, not another
}

} // namespace
} // namespace penumbra::test
