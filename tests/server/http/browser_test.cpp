// What other sites' pages cannot do; the page's own headers; trace context.
#include "http/browser_guard.hpp"
#include "http/trace_context.hpp"
#include "server/client.hpp"

namespace penumbra::test {
namespace {

TEST(Browser, HostsThatAreNoNameOfTheService)
{
    for (const char* known : {"localhost", "LOCALHOST:8080", "127.0.0.1:1", "192.0.2.7", "[::1]:8080", "[::1]"})
        EXPECT_TRUE(server::is_known_host(known, "")) << known;
    for (const char* unknown : {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example:80", "[::1", "1.2.3"})
        EXPECT_FALSE(server::is_known_host(unknown, "")) << unknown;
    EXPECT_TRUE(server::is_known_host("Masks.example:443", "a.example, masks.example"));
    EXPECT_FALSE(server::is_known_host("masks.example", "xmasks.example,masks.exampl"));

    const auto with_host = [](const std::string& host) {
        return ask(shared_port(), "GET /v1/techniques HTTP/1.1\r\nHost: " + host + "\r\n\r\n").status;
    };
    EXPECT_EQ(with_host("localhost"), 200);
    EXPECT_EQ(with_host("evil.example"), 403);
    EXPECT_EQ(with_host("localhost\r\nHost: localhost"), 400);
    EXPECT_EQ(ask(shared_port(), "GET /healthz HTTP/1.0\r\n\r\n").status, 200) << "a probe without Host";
    Running named{server::Options{.device = {}, .token = {}, .names = "masks.example"}};
    EXPECT_EQ(ask(named.port, "GET /healthz HTTP/1.1\r\nHost: masks.example\r\n\r\n").status, 200);
}

TEST(Browser, OriginsThatAreAnothersite)
{
    EXPECT_TRUE(server::is_own_origin("", "localhost:8080", ""));
    EXPECT_TRUE(server::is_own_origin("http://localhost:8080", "localhost:8080", ""));
    EXPECT_TRUE(server::is_own_origin("https://masks.example", "masks.example", ""));
    EXPECT_FALSE(server::is_own_origin("http://localhost:8081", "localhost:8080", ""));
    EXPECT_FALSE(server::is_own_origin("null", "localhost:8080", ""));
    EXPECT_FALSE(server::is_own_origin("https://evil.example", "localhost:8080", "https://tools.example"));
    EXPECT_TRUE(server::is_own_origin("https://tools.example", "localhost:8080", "https://a.example, https://tools.example"));

    EXPECT_EQ(ask(shared_port(), post(form(parts()), "Origin: https://evil.example\r\n")).status, 403);
    EXPECT_EQ(ask(shared_port(), post(form(parts()), "Origin: http://127.0.0.1\r\n")).status, 200);
}

TEST(Browser, ThePageMayLoadNothingFromElsewhere)
{
    const Reply page = get(shared_port(), "/");
    ASSERT_EQ(page.status, 200);
    EXPECT_TRUE(page.header("Content-Type").starts_with("text/html"));
    EXPECT_TRUE(page.header("Content-Security-Policy").starts_with("default-src 'none'"));
    EXPECT_EQ(page.header("X-Content-Type-Options"), "nosniff");
    EXPECT_EQ(get(shared_port(), "/page/nothing.js").status, 404);
    EXPECT_EQ(get(shared_port(), "/page/../service.cpp").status, 404);
}

TEST(TraceContext, IsTakenAndPassedOn)
{
    const std::string trace(32, 'a'), parent(16, 'b');
    const std::string given = "00-" + trace + "-" + parent + "-01";
    const std::string back = get(shared_port(), "/healthz", "traceparent: " + given + "\r\n").header("traceparent");
    ASSERT_EQ(back.size(), 55u) << back;
    EXPECT_TRUE(back.starts_with("00-" + trace + "-"));
    EXPECT_TRUE(back.ends_with("-01"));
    EXPECT_EQ(back.find(parent), std::string::npos) << "the service's own part of the trace";
    EXPECT_EQ(get(shared_port(), "/healthz").header("traceparent"), "");

    EXPECT_TRUE(server::trace_context_from("cc-" + trace + "-" + parent + "-01-what a later version adds"));
    for (const std::string& wrong :
         {std::string(), "ff-" + trace + "-" + parent + "-01", "00-" + std::string(32, '0') + "-" + parent + "-01",
          "00-" + trace + "-" + std::string(16, '0') + "-01", "00-" + std::string(32, 'A') + "-" + parent + "-01", given + "-x",
          given + "1", given.substr(1)})
        EXPECT_FALSE(server::trace_context_from(wrong)) << wrong;
}

} // namespace
} // namespace penumbra::test
