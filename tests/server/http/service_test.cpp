// Admission, deadlines, readiness, the graceful end, what the service says about itself, and its options.
#include <csignal>
#include <fstream>
#include <sstream>

#include <fcntl.h>
#include <sys/wait.h>

#include "http/describe.hpp"
#include "http/route.hpp"
#include "process/options.hpp"
#include "process/problem.hpp"
#include "process/ready.hpp"
#include "server/client.hpp"
#include "server/program.hpp"
#include "technique/table.hpp"

namespace penumbra::test {
namespace {

TEST(Admission, AFullHouseRefusesBeforeTheBody)
{
    Running small{server::Options{.device = {}, .token = {}, .slots = 1, .queue = 1}};
    const auto one = small.service().gate().admit();
    const std::string request = post(form(parts()));
    {
        // The second place belongs to an upload that does not go on.
        Socket half(small.port);
        half.send(request.substr(0, 400));
        wait_for_metric(small.port, "penumbra_requests_admitted 2");

        const Reply refused = ask(small.port, head(length_of(form(parts())))); // no body at all
        EXPECT_EQ(refused.status, 503);
        EXPECT_EQ(refused.header("Retry-After"), "1");
        EXPECT_EQ(get(small.port, "/healthz").status, 200);

        half.send(request.substr(400));
        EXPECT_EQ(Reply(half.receive()).status, 200);
    }
    wait_for_metric(small.port, "penumbra_requests_admitted 1");
    EXPECT_EQ(ask(small.port, request).status, 200);
    EXPECT_TRUE(holds(get(small.port, "/metrics").body, "penumbra_rejected_total{reason=\"queue_full\"} 1\n"));
}

TEST(Admission, ARequestThatGetsNoSlotInTimeIsToldSo)
{
    Running busy{server::Options{.device = {}, .token = {}, .deadline_s = 1, .slots = 1, .queue = 1}};
    const auto slot = busy.service().gate().enter(server::Deadline(std::chrono::seconds(60)));
    const Reply reply = ask(busy.port, post(form(parts())));
    EXPECT_EQ(reply.status, 504) << reply.body;
}

TEST(Admission, SlotsGoToWhoCameFirst)
{
    server::Gate gate(1, 8);
    const server::Deadline later(std::chrono::seconds(60));
    std::vector<int> order;
    std::vector<std::thread> threads;
    {
        const auto held = gate.enter(later);
        for (int i = 0; i < 5; ++i) {
            threads.emplace_back([&, i] {
                const auto slot = gate.enter(later);
                order.push_back(i); // guarded by the slot
            });
            while (gate.counts().waiting != static_cast<std::size_t>(i + 1)) std::this_thread::yield();
        }
        EXPECT_THROW((void)gate.enter(server::Deadline(std::chrono::seconds(0))), server::Problem);
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3, 4}));
}

// Who steps aside leaves his slot; who leaves then leaves no slot.
TEST(Admission, ALongRequestLeavesItsSlotWhileThereIsASpare)
{
    server::Gate gate(1, 8, 1);
    const server::Deadline later(std::chrono::seconds(60)), now(std::chrono::seconds(0));
    {
        auto first = gate.enter(later);
        EXPECT_TRUE(first.step_aside());
        EXPECT_TRUE(first.step_aside()) << "it has";
        auto second = gate.enter(later);
        EXPECT_EQ(gate.counts().computing, 2U);
        EXPECT_FALSE(second.step_aside()) << "there is one spare";
        EXPECT_THROW((void)gate.enter(now), server::Problem);
        { const auto gone = std::move(first); }
        EXPECT_EQ(gate.counts().computing, 1U);
        EXPECT_THROW((void)gate.enter(now), server::Problem) << "the slot is the second one's";
        EXPECT_TRUE(second.step_aside());
        const auto third = gate.enter(later);
        EXPECT_EQ(gate.counts().computing, 2U);
    }
    EXPECT_EQ(gate.counts().computing, 0U);
}

TEST(Readiness, NotBeforeTheKnownMask)
{
    Running cold{server::Options{}, false};
    EXPECT_EQ(get(cold.port, "/readyz").status, 503);
    EXPECT_EQ(ask(cold.port, post(form(parts()))).status, 503);
    cold.service().become_ready();
    EXPECT_EQ(get(cold.port, "/readyz").status, 200);
    cold.service().drain();
    EXPECT_EQ(get(cold.port, "/readyz").status, 503);
    EXPECT_EQ(ask(cold.port, post(form(parts()))).status, 200); // until the socket closes
}

TEST(Program, FinishesWorkInFlightAfterSigterm)
{
    const Program program({"--port", "0", "--deadline-s=60"});
    const std::string block = program.said_until("\nready\n");
    const std::string listening = "listening on 127.0.0.1 port ";
    const std::size_t at = block.find(listening);
    ASSERT_NE(at, std::string::npos) << block;
    const int port = std::stoi(block.substr(at + listening.size()));

    const std::string request = post(form(parts()));
    Socket half(port);
    half.send(request.substr(0, 400));
    wait_for_metric(port, "penumbra_requests_admitted 1");
    kill(program.process, SIGTERM);
    while (Socket(port).connected) {
    } // until it listens no more
    half.send(request.substr(400));
    EXPECT_EQ(Reply(half.receive()).status, 200);
    EXPECT_TRUE(holds(program.said_until("\nended\n"), "\nended\n"));
    EXPECT_EQ(program.wait(), 0);
}

TEST(Program, WrongUsage)
{
    for (const std::vector<std::string>& arguments :
         std::vector<std::vector<std::string>>{{"--prot", "1"}, {"--port", "70000"}, {"--host=192.0.2.1"}, {"--token=short"}}) {
        const Program program(arguments);
        const std::string said = program.said_until("\n");
        EXPECT_EQ(program.wait(), 2) << said;
        EXPECT_TRUE(said.starts_with("penumbra-server: ") || holds(said, "--host")) << said;
        EXPECT_FALSE(holds(said, "short")) << said;
    }
}

TEST(Descriptions, OpenApiIsWhatTheRouterDoes)
{
    const nlohmann::json api = nlohmann::json::parse(get(shared_port(), "/openapi.json").body);
    EXPECT_EQ(api["openapi"], "3.1.0");
    std::size_t count = 0;
    for (const auto& [path, operations] : api["paths"].items())
        for (const auto& [method, operation] : operations.items()) {
            ++count;
            std::string verb, at = path;
            for (const char c : method) verb += static_cast<char>(c - 'a' + 'A');
            const std::size_t hole = at.find("{id}");
            if (hole != std::string::npos) at.replace(hole, 4, std::string(64, '0')); // an id that nothing has
            const Reply reply = ask(shared_port(), verb + " " + at + " HTTP/1.1\r\n\r\n");
            EXPECT_TRUE(operation["responses"].contains(std::to_string(reply.status))) << path << " " << reply.status;
            // The route is there: 404 is what a scene that is not kept gives, and says so.
            const std::string reason = reply.status == 404 ? nlohmann::json::parse(reply.body).value("reason", "") : "no_scene";
            EXPECT_EQ(reason, "no_scene") << path;
            if (method != "get" || reply.status != 200) continue;
            const std::string type = operation["responses"]["200"]["content"].begin().key();
            EXPECT_TRUE(reply.header("Content-Type").starts_with(type)) << path;
        }
    EXPECT_EQ(count, server::routes().size());
}

TEST(Descriptions, TechniquesAreSchemasOfTheTable)
{
    const nlohmann::json list = nlohmann::json::parse(get(shared_port(), "/v1/techniques").body)["techniques"];
    ASSERT_EQ(list.size(), technique_table().size());
    for (const auto& technique : list) {
        EXPECT_EQ(technique["schema"]["properties"]["kind"]["const"], technique["kind"]);
        EXPECT_FALSE(technique["schema"]["additionalProperties"].get<bool>());
    }
    const nlohmann::json devices = nlohmann::json::parse(get(shared_port(), "/v1/devices").body)["devices"];
    EXPECT_EQ(std::ranges::count_if(devices, [](const auto& device) { return device["selected"].template get<bool>(); }), 1);
}

TEST(Descriptions, RequestIdsComeBack)
{
    EXPECT_EQ(get(shared_port(), "/healthz", "X-Request-Id: abc-1\r\n").header("X-Request-Id"), "abc-1");
    EXPECT_NE(get(shared_port(), "/healthz", "X-Request-Id: a b\r\n").header("X-Request-Id"), "a b");
    EXPECT_EQ(get(shared_port(), "/healthz", "Range: bytes=0-1,0-1\r\n").body, "alive\n");
}

TEST(OptionTable, FlagsAndVariables)
{
    const auto none = [](const char*) -> const char* { return nullptr; };
    const auto slots = [](const char* name) -> const char* { return std::string_view(name) == "PENUMBRA_SERVER_SLOTS" ? "7" : nullptr; };
    EXPECT_EQ(server::options_from({}, slots).slots, 7);
    EXPECT_EQ(server::options_from({"--slots=3"}, slots).slots, 3);
    EXPECT_TRUE(server::options_from({"--allow-meshes"}, none).allow_meshes);
    for (const server::OptionRow& row : server::option_table()) {
        EXPECT_TRUE(holds(server::help_text(), server::flag_of(row)));
        if (!std::holds_alternative<std::int64_t server::Options::*>(row.member)) continue;
        for (const std::int64_t wrong : {row.range.low - 1, row.range.high + 1}) {
            const Error error = error_of([&] { server::options_from({server::flag_of(row), std::to_string(wrong)}, none); });
            EXPECT_EQ(error.code(), ErrorCode::usage);
            EXPECT_TRUE(holds(error.what(), server::flag_of(row)) && holds(error.what(), std::to_string(row.range.high))) << error.what();
        }
    }
    EXPECT_EQ(error_of([&] { server::options_from({"--io-threads", "10"}, none); }).code(), ErrorCode::usage);
    const std::string secret = "a-secret-of-some-length";
    EXPECT_FALSE(holds(server::startup_text(server::options_from({"--token=" + secret}, none)), secret));
}

TEST(OptionTable, TheDocumentIsTheTable)
{
    std::ifstream file(PENUMBRA_DOCS "/limits.md");
    std::stringstream text;
    text << file.rdbuf();
    EXPECT_EQ(text.str(), server::limits_markdown()) << "penumbra-server --limits > docs/limits.md";
}

} // namespace
} // namespace penumbra::test
