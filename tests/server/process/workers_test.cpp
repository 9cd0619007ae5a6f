// Workers may die, hang and run out of memory; the service goes on, and only the request that did it is lost.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <random>

#include <cstdlib>

#include <sys/resource.h>

#include "process/priority.hpp"
#include "server/client.hpp"
#include "server/program.hpp"

namespace penumbra::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

server::Options options_with(std::int64_t deadline_s, std::int64_t slots = 2, std::int64_t spares = 0)
{
    server::Options options;
    options.deadline_s = deadline_s;
    options.slots = slots;
    options.spares = spares;
    options.rays = std::int64_t{1} << 40;
    return options;
}

// Seconds of rays, or as many as these are.
std::string long_request(int samples = 16384)
{
    nlohmann::json scene = scene_json();
    scene["technique"] = {{"kind", "depth_trace"}, {"samples", samples}}; // of which nobody estimates the time
    Parts slow = parts(scene);
    slow[2].second = text_of(encode_depth(flat(256, 256, 2)));
    return post(form(slow));
}

std::string honest_request() { return post(form(parts())); }

void wait_for_busy(int port, int busy) { wait_for_metric(port, "penumbra_workers{state=\"busy\"} " + std::to_string(busy)); }
void wait_for_idle(int port, int idle) { wait_for_metric(port, "penumbra_workers{state=\"idle\"} " + std::to_string(idle)); }

// No two are alike, so that none has ended a worker before, and none is made from what was kept.
std::string request_number(int number)
{
    nlohmann::json scene = scene_json();
    scene["light"]["half_u"] = {0.125 + 1e-5 * number, 0, 0};
    return post(form(parts(scene)));
}

// What workers are asked for from now on takes as long as the test likes: until SIGCONT, or their end.
void hold(const std::vector<pid_t>& workers)
{
    for (const pid_t worker : workers) kill(worker, SIGSTOP);
}

std::vector<pid_t> children_of(pid_t process)
{
    std::vector<pid_t> children;
    for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
        std::ifstream list(task.path() / "children");
        for (pid_t child = 0; list >> child;) children.push_back(child);
    }
    return children;
}

// Asks a service of one worker, and kills it while it computes.
Reply killed(Running& running, const std::string& request)
{
    std::string text;
    std::jthread client([&] {
        Socket socket(running.port);
        socket.send(request);
        text = socket.receive();
    });
    wait_for_busy(running.port, 1);
    kill(running.service().workers().processes().front(), SIGKILL);
    client.join();
    return Reply(text);
}

TEST(Workers, OneThatDiesCostsItsOwnRequestOnly)
{
    Running running{options_with(60, 1)};
    const Reply reply = killed(running, long_request());
    EXPECT_EQ(reply.status, 500);
    EXPECT_TRUE(holds(reply.body, "\"crashed\"")) << reply.body;
    // The next one waits for the new worker.
    EXPECT_EQ(ask(running.port, honest_request()).status, 200);
    EXPECT_EQ(get(running.port, "/readyz").status, 200);
    wait_for_metric(running.port, "penumbra_workers_crashed_total 1");
}

TEST(Workers, ARequestThatEndedTwoIsNotTriedAgain)
{
    Running running{options_with(60, 1)};
    for (int i = 0; i < 2; ++i) {
        wait_for_idle(running.port, 1);
        EXPECT_EQ(killed(running, long_request()).status, 500);
    }
    const Reply refused = ask(running.port, long_request());
    EXPECT_EQ(refused.status, 422);
    EXPECT_TRUE(holds(refused.body, "\"crashed\"")) << refused.body;
    EXPECT_NE(refused.header("Retry-After"), "");
    EXPECT_EQ(ask(running.port, honest_request()).status, 200);
}

// A TIFF with RowsPerStrip 2^31 - 1 and deflate: its reader never comes back.
std::string looping_tiff()
{
    constexpr std::string_view hex = "49492a00080000000a000001040001000000040000000101040001000000040000000201030001000000200000000301030001000000080000000601030001000000010000001101040001000000860000001501030001000000010000001601040001000000ffffff7f17010400010000003400000053010300010000000300000000000000789c0dc3011100101000c18b2082081a780d441041848f228a28a2b8995dc80e849c3ebe7e6640717573787a793bc707392b09c9";
    std::string bytes;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2) bytes += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
    return bytes;
}

TEST(Workers, AnImageThatItsReaderNeverFinishesIsRefused)
{
    nlohmann::json scene = scene_json();
    Parts loop = parts(scene);
    loop[2].second = looping_tiff();
    const Reply reply = ask(shared_port(), post(form(loop)));
    EXPECT_EQ(reply.status, 422);
    EXPECT_TRUE(holds(reply.detail(), "strips of 2147483647 rows")) << reply.body;
}

// What never comes back, whatever it hangs in, is ended at the deadline; the slot is free again.
TEST(Workers, OneThatHangsIsEndedAtTheDeadline)
{
    Running running{options_with(2, 1)};
    wait_for_idle(running.port, 1);
    hold(running.service().workers().processes());
    const auto begun = Clock::now();
    const Reply reply = ask(running.port, honest_request());
    EXPECT_EQ(reply.status, 504) << reply.body;
    EXPECT_GE(Clock::now() - begun, 2s);
    wait_for_metric(running.port, "penumbra_workers_overdue_total 1");
    EXPECT_EQ(ask_in_time(running.port, honest_request()).status, 200);
    wait_for_metric(running.port, "penumbra_workers_overdue_total 1");
}

TEST(Workers, TheEndOfTheServiceWaitsForNoWorker)
{
    const Program program({"--port", "0", "--deadline-s", "60", "--rays", std::to_string(std::int64_t{1} << 40)});
    const int port = program.port_when_ready();
    ASSERT_NE(port, 0);
    hold(children_of(program.process));
    Socket socket(port);
    socket.send(honest_request());
    wait_for_busy(port, 1);
    const auto begun = Clock::now();
    kill(program.process, SIGTERM);
    const Reply reply(socket.receive());
    EXPECT_EQ(reply.status, 503);
    EXPECT_EQ(program.wait(), 0);
    EXPECT_LT(Clock::now() - begun, 30s) << "the worker would go on to the deadline, 60 s";
}

bool runs(pid_t process)
{
    std::ifstream status("/proc/" + std::to_string(process) + "/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("State:")) return line.find('Z') == std::string::npos && line.find('X') == std::string::npos;
    return false;
}

// The workers' processes are gone with the service, however it ended.
TEST(Workers, EndWithTheService)
{
    std::vector<pid_t> processes;
    {
        Running running{options_with(60)};
        wait_for_idle(running.port, 2);
        processes = running.service().workers().processes();
        ASSERT_EQ(processes.size(), 2U);
    }
    for (const pid_t process : processes) EXPECT_EQ(kill(process, 0), -1) << process;

    const Program program({"--port", "0"});
    const int port = program.port_when_ready();
    ASSERT_NE(port, 0);
    wait_for_idle(port, 3);
    const std::vector<pid_t> workers = children_of(program.process);
    ASSERT_EQ(workers.size(), 3U);
    kill(program.process, SIGKILL);
    program.wait();
    // Nobody is left to collect them: one that ended may stay as a zombie.
    for (int i = 0; i < 6000 && std::ranges::any_of(workers, runs); ++i) std::this_thread::sleep_for(10ms);
    for (const pid_t process : workers) EXPECT_FALSE(runs(process)) << process;
}

int priority_of(pid_t process) { return getpriority(PRIO_PROCESS, static_cast<id_t>(process)); }

// It goes on beside the slot, on what the others leave.
TEST(Workers, OneThatIsBusyForLongHoldsUpNobody)
{
    Running running{options_with(60, 1, 1)};
    wait_for_idle(running.port, 2);
    Socket client(running.port);
    client.send(long_request());
    wait_for_busy(running.port, 1);
    EXPECT_EQ(ask(running.port, honest_request()).status, 200);
    wait_for_busy(running.port, 1);
    const auto lowered = [&] {
        return std::ranges::count_if(running.service().workers().processes(), [](pid_t one) { return priority_of(one) > priority_of(getpid()); });
    };
    for (int i = 0; i < 6000 && lowered() == 0; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_EQ(lowered(), std::min<std::ptrdiff_t>(1, 19 - priority_of(getpid())));
    EXPECT_EQ(ask(running.port, honest_request()).status, 200);
}

// The second one of them has the slot: there is one spare. The third waits until one of them is over.
TEST(Workers, AsManyAsThereAreSparesMayBeBusyForLong)
{
    Running running{options_with(60, 1, 1)};
    wait_for_idle(running.port, 2);
    const std::vector<pid_t> held = running.service().workers().processes();
    hold(held);
    Socket first(running.port), second(running.port), third(running.port);
    first.send(request_number(1));
    wait_for_busy(running.port, 1);
    second.send(request_number(2));
    wait_for_busy(running.port, 2);
    third.send(request_number(3));
    wait_for_metric(running.port, "penumbra_queue_depth 1");
    std::this_thread::sleep_for(2 * server::long_call); // by now the second one has asked whether it may go on beside the slot, too
    wait_for_metric(running.port, "penumbra_queue_depth 1");
    EXPECT_EQ(running.service().workers().counts().busy, 2U);
    // One of them ends, and the other, which still computes, makes room.
    kill(held.front(), SIGKILL);
    EXPECT_EQ(Reply(third.receive()).status, 200);
    wait_for_busy(running.port, 1);
    kill(held.back(), SIGCONT);
    std::vector<int> statuses{Reply(first.receive()).status, Reply(second.receive()).status};
    std::ranges::sort(statuses);
    EXPECT_EQ(statuses, (std::vector<int>{200, 500}));
}

// The next request has all of the worker, or another one.
TEST(Workers, PriorityComesBackWithTheAnswer)
{
    Running running{options_with(60, 1)};
    const pid_t before = running.service().workers().processes().front();
    EXPECT_EQ(ask(running.port, long_request(512)).status, 200);
    wait_for_idle(running.port, 1);
    const pid_t after = running.service().workers().processes().front();
    EXPECT_EQ(priority_of(after), priority_of(getpid()));
    EXPECT_EQ(after == before, server::may_raise_priority());
    wait_for_metric(running.port, "penumbra_workers_crashed_total 0");
}

// Another one that is warm takes its place at once.
TEST(Workers, OneThatDiesCostsNobodyAWarmUp)
{
    Running running{options_with(60, 1, 1)};
    wait_for_idle(running.port, 2);
    for (int i = 0; i < 2; ++i) {
        kill(running.service().workers().processes().front(), SIGKILL);
        wait_for_metric(running.port, "penumbra_workers_crashed_total " + std::to_string(i + 1));
        EXPECT_GE(running.service().workers().counts().idle, 1U) << "nobody waits for the new one";
        EXPECT_EQ(ask(running.port, honest_request()).status, 200);
        wait_for_idle(running.port, 2);
    }
}

// What workers write stays their own.
TEST(Workers, TheFolderOfKernelsIsWrittenBeforeTheFirstRequest)
{
    std::string pattern = (std::filesystem::temp_directory_path() / "penumbra-kernels-XXXXXX").string();
    const std::filesystem::path folder = mkdtemp(pattern.data());
    const char* const old = std::getenv("PENUMBRA_CACHE_DIR");
    const std::string before_it = old ? old : "";
    setenv("PENUMBRA_CACHE_DIR", folder.c_str(), 1);
    const auto times = [&] {
        std::map<std::string, std::filesystem::file_time_type> all;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
            if (entry.is_regular_file()) all[entry.path()] = entry.last_write_time();
        return all;
    };
    {
        Running running{options_with(60, 1)};
        const auto built = times();
        EXPECT_GT(built.size(), 50U);
        for (int i = 0; i < 2; ++i) {
            EXPECT_EQ(ask(running.port, honest_request()).status, 200);
            kill(running.service().workers().processes().front(), SIGKILL);
            wait_for_metric(running.port, "penumbra_workers_crashed_total " + std::to_string(i + 1));
            wait_for_idle(running.port, 1);
        }
        EXPECT_EQ(ask(running.port, honest_request()).status, 200);
        EXPECT_EQ(times(), built);
        const auto& closed = running.service().greeting().closed;
        EXPECT_NE(std::ranges::find(closed, "kernels that others load (copies)"), closed.end());
    }
    old ? setenv("PENUMBRA_CACHE_DIR", before_it.c_str(), 1) : unsetenv("PENUMBRA_CACHE_DIR");
    std::filesystem::remove_all(folder);
}

TEST(Workers, KilledAtRandomTheyLoseTheirOwnRequests)
{
    Running running{options_with(60)};
    constexpr int deaths = 12;
    std::atomic<bool> over = false;
    std::atomic<int> number = 0, lost = 0, other = 0;
    std::mutex mutex;
    std::map<int, std::string> masks;
    {
        std::vector<std::jthread> clients;
        for (int client = 0; client < 4; ++client)
            clients.emplace_back([&] {
                for (bool last = false; !last;) {
                    last = over; // so that each has one that nobody ends
                    const int mine = ++number;
                    const Reply reply = ask(running.port, request_number(mine));
                    lost += reply.status == 500;
                    other += reply.status != 500 && reply.status != 200;
                    const std::scoped_lock lock(mutex);
                    if (reply.status == 200 && masks.size() < 20) masks[mine] = reply.body;
                }
            });
        std::mt19937 random(5);
        for (int i = 0; i < deaths; ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(20 + random() % 150)); // moments that nobody has chosen
            const auto processes = running.service().workers().processes();
            if (!processes.empty()) kill(processes[random() % processes.size()], SIGKILL);
        }
        over = true;
    }
    EXPECT_LE(lost, deaths);
    EXPECT_EQ(other, 0);
    EXPECT_FALSE(masks.empty());
    for (const auto& [mine, mask] : masks) EXPECT_EQ(ask(running.port, request_number(mine)).body, mask);
}

// Which request comes next has nothing to do with it.
TEST(Workers, OneThatDiesIdleCostsNothing)
{
    Running running{options_with(60, 1)};
    for (int i = 0; i < 3; ++i) {
        wait_for_idle(running.port, 1);
        const auto process = running.service().workers().processes().front();
        kill(process, SIGKILL);
        siginfo_t facts{};
        ASSERT_EQ(waitid(P_PID, static_cast<id_t>(process), &facts, WEXITED | WNOWAIT), 0); // that it is gone, and its channel with it
        EXPECT_EQ(ask(running.port, honest_request()).status, 200);
    }
}

TEST(Workers, ScenesThatTheyKeepSurviveThem)
{
    Running running{options_with(60, 1)};
    const std::string upload = "POST /v1/scenes HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: multipart/form-data; boundary=B\r\n" +
                               length_of(form(parts())) + "\r\n" + form(parts());
    const Reply kept = ask(running.port, upload);
    ASSERT_EQ(kept.status, 201) << kept.body;
    const std::string id = nlohmann::json::parse(kept.body)["id"];
    const std::string mask = "POST /v1/scenes/" + id + "/masks HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 0\r\n\r\n";
    const Reply before = ask(running.port, mask);
    ASSERT_EQ(before.status, 200) << before.body;
    kill(running.service().workers().processes().front(), SIGKILL);
    const Reply lost = ask(running.port, mask); // the service may not have seen that it is gone
    const Reply after = lost.status == 200 ? lost : ask(running.port, mask);
    EXPECT_EQ(after.status, 200) << after.body;
    EXPECT_EQ(after.body, before.body);
}

} // namespace
} // namespace penumbra::test
