// What a supervisor is told: datagrams to a real socket, by the parts and by the real program; and how many files may be open.
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/un.h>

#include "process/descriptors.hpp"
#include "process/notify.hpp"
#include "server/client.hpp"
#include "server/program.hpp"

namespace penumbra::test {
namespace {

using namespace std::chrono_literals;
using server::Notifier;
using server::Watchdog;
using Clock = std::chrono::steady_clock;

bool holds(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

// The supervisor's end: a datagram socket at a path, or of an abstract name.
class Supervisor {
public:
    explicit Supervisor(std::string name) : name_(std::move(name)), socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0))
    {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::copy(name_.begin(), name_.end(), address.sun_path);
        if (is_abstract()) address.sun_path[0] = '\0';
        const std::size_t size = offsetof(sockaddr_un, sun_path) + name_.size() + (is_abstract() ? 0 : 1);
        bound = ::bind(socket_, reinterpret_cast<const sockaddr*>(&address), static_cast<socklen_t>(size)) == 0;
    }
    ~Supervisor()
    {
        ::close(socket_);
        if (!is_abstract()) ::unlink(name_.c_str());
    }
    Supervisor(const Supervisor&) = delete;
    Supervisor& operator=(const Supervisor&) = delete;

    const std::string& name() const { return name_; }
    // The next datagram; empty when none comes in that time.
    std::string heard(std::chrono::milliseconds within = 60s) const
    {
        pollfd entry{socket_, POLLIN, 0};
        if (::poll(&entry, 1, static_cast<int>(within.count())) <= 0) return {};
        std::array<char, 4096> buffer{};
        const ssize_t got = ::recv(socket_, buffer.data(), buffer.size(), 0);
        return got <= 0 ? std::string() : std::string(buffer.data(), static_cast<std::size_t>(got));
    }
    // The next datagram that holds `part`; empty when none comes within a minute.
    std::string heard_with(std::string_view part) const
    {
        for (std::string text = heard(); !text.empty(); text = heard())
            if (holds(text, part)) return text;
        return {};
    }

    bool bound = false;

private:
    bool is_abstract() const { return name_.front() == '@'; }
    std::string name_;
    int socket_;
};

std::string own_name(const std::string& begin) { return begin + "penumbra-notify-" + std::to_string(getpid()); }

server::Environment environment_of(std::map<std::string, std::string> variables)
{
    return [variables = std::move(variables)](const char* name) {
        const auto found = variables.find(name);
        return found == variables.end() ? nullptr : found->second.c_str();
    };
}

void quiet(std::string_view) {}

// --- Telling -----------------------------------------------------------------------------------------------------------------------

TEST(Notifier, SendsWhatItIsTold)
{
    // A path, an abstract name, and the longest of both: 107 bytes and a zero, 108 bytes.
    const std::string folder = "/tmp/" + std::string("n") + std::to_string(getpid());
    ASSERT_EQ(mkdir(folder.c_str(), 0700), 0);
    const std::string longest = folder + "/" + std::string(107 - folder.size() - 1, 'x');
    std::string longest_abstract = own_name("@");
    longest_abstract.resize(108, 'x');
    for (const std::string& name : {own_name("/tmp/"), own_name("@"), longest, longest_abstract}) {
        const Supervisor supervisor(name);
        ASSERT_TRUE(supervisor.bound) << name;
        const Notifier notifier(environment_of({{"NOTIFY_SOCKET", name}}));
        EXPECT_EQ(notifier.tell("READY=1\nSTATUS=here"), "") << name;
        EXPECT_EQ(supervisor.heard(1s), "READY=1\nSTATUS=here") << name;
    }
    rmdir(folder.c_str());
}

TEST(Notifier, NobodyToTell)
{
    const Notifier none(environment_of({}));
    EXPECT_EQ(none.tell("READY=1"), "");
    // A watchdog that nobody listens to is none.
    EXPECT_FALSE(Notifier(environment_of({{"WATCHDOG_USEC", "1000000"}})).watchdog());

    // A name that nobody has: the reason comes back, with the name.
    const Notifier gone(environment_of({{"NOTIFY_SOCKET", "/tmp/nobody-is-here"}}));
    EXPECT_TRUE(holds(gone.tell("READY=1"), "/tmp/nobody-is-here"));
}

TEST(Notifier, NamesThatAreNone)
{
    for (const std::string& name : {std::string("relative"), std::string("/"), std::string("@"), "/" + std::string(107, 'x'),
                                    "@" + std::string(108, 'x'), std::string("vsock:2:1")})
        EXPECT_THROW(Notifier(environment_of({{"NOTIFY_SOCKET", name}})), Error) << name;
}

TEST(Notifier, ReadsTheWatchdogsTime)
{
    const std::string name = own_name("@");
    const auto of = [&](const std::string& time, const std::string& process) {
        return Notifier(environment_of({{"NOTIFY_SOCKET", name}, {"WATCHDOG_USEC", time}, {"WATCHDOG_PID", process}})).watchdog();
    };
    EXPECT_EQ(of("30000000", ""), 30s);
    EXPECT_EQ(of("1", std::to_string(getpid())), 1us);
    EXPECT_FALSE(of("30000000", "1")); // another's
    EXPECT_FALSE(of("", ""));
    EXPECT_GT(of("18446744073709551615", ""), std::chrono::years(99)); // no overflow
    for (const char* const time : {"0", "-1", "1s", "1.5", "18446744073709551616"}) EXPECT_THROW(of(time, ""), Error) << time;
    EXPECT_THROW(of("1", "me"), Error);
}

// --- The watchdog ------------------------------------------------------------------------------------------------------------------

TEST(Watchdog, MarksOnlyWhatIsHealthy)
{
    const Supervisor supervisor(own_name("@"));
    const Notifier notifier(environment_of({{"NOTIFY_SOCKET", supervisor.name()}, {"WATCHDOG_USEC", "400000"}}));
    std::atomic<bool> good = true;
    std::atomic<std::int64_t> allowed_us = 0;
    std::atomic<int> said = 0;
    const auto healthy = [&](std::chrono::microseconds within) {
        allowed_us = within.count();
        return good.load();
    };
    const auto begin = Clock::now();
    const Watchdog watchdog(notifier, healthy, [&](std::string_view) { ++said; });

    // The first at once, then one each half of the time: four take no less than three halves.
    for (int i = 0; i < 4; ++i) EXPECT_EQ(supervisor.heard(10s), "WATCHDOG=1");
    EXPECT_GE(Clock::now() - begin, 3 * 200ms);
    EXPECT_EQ(allowed_us, 100000);
    EXPECT_EQ(said, 0);

    // None while it is not healthy, but for those that may be on their way; a line says so, once.
    good = false;
    while (!supervisor.heard(400ms).empty()) {
    }
    EXPECT_EQ(supervisor.heard(1s), "");
    EXPECT_EQ(said, 1);
    good = true;
    EXPECT_EQ(supervisor.heard(10s), "WATCHDOG=1");
}

TEST(Watchdog, EndsAtOnce)
{
    const Supervisor supervisor(own_name("@"));
    const Notifier notifier(environment_of({{"NOTIFY_SOCKET", supervisor.name()}, {"WATCHDOG_USEC", "3600000000"}}));
    const auto begin = Clock::now();
    {
        const Watchdog watchdog(
            notifier, [](auto) { return true; }, quiet);
        EXPECT_EQ(supervisor.heard(), "WATCHDOG=1");
    }
    EXPECT_LT(Clock::now() - begin, 60s); // half an hour, if it waited for its next mark
}

// --- The health check --------------------------------------------------------------------------------------------------------------

TEST(HealthCheck, SeesAService)
{
    const Running running{server::Options{}, false}; // healthy before it is ready
    EXPECT_TRUE(server::answers_health("127.0.0.1", running.port, 10s));
    EXPECT_TRUE(server::answers_health("localhost", running.port, 10s));
    EXPECT_TRUE(server::answers_health("0.0.0.0", running.port, 10s));
}

// Listens, sends `answer` to the first that comes, and holds the line.
class Stub {
public:
    explicit Stub(std::string answer, bool holds_on) : listener_(::socket(AF_INET, SOCK_STREAM, 0))
    {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof(address);
        auto* plain = reinterpret_cast<sockaddr*>(&address);
        if (::bind(listener_, plain, size) != 0 || ::listen(listener_, 4) != 0 || ::getsockname(listener_, plain, &size) != 0) return;
        port = ntohs(address.sin_port);
        thread_ = std::thread([this, answer = std::move(answer), holds_on] {
            const int client = ::accept(listener_, nullptr, nullptr);
            std::array<char, 4096> request{};
            if (::recv(client, request.data(), request.size(), 0) > 0) ::send(client, answer.data(), answer.size(), MSG_NOSIGNAL);
            while (holds_on && ::recv(client, request.data(), request.size(), 0) > 0) {
            } // until the other side gives up
            ::close(client);
        });
    }
    ~Stub()
    {
        if (thread_.joinable()) thread_.join();
        ::close(listener_);
    }
    Stub(const Stub&) = delete;
    Stub& operator=(const Stub&) = delete;
    int port = 0;

private:
    int listener_;
    std::thread thread_;
};

TEST(HealthCheck, SeesWhatIsNone)
{
    struct Case {
        std::string answer;
        bool holds_on, good;
    };
    const std::array cases{Case{"HTTP/1.1 200 OK\r\n\r\nalive\n", false, true}, // what the stub can do when all is well
                           Case{"HTTP/1.1 200 OK\r\n\r\nali", true, false},     // begins, and hangs
                           Case{"HTTP/1.1 503 Service Unavailable\r\n\r\n", false, false},
                           Case{"", true, false}, // takes the request, and hangs
                           Case{"", false, false},
                           Case{"HTTP/1.1 200 OK\r\n\r\n" + std::string(1 << 20, 'x'), false, false}}; // endless
    for (const Case& one : cases) {
        const Stub stub(one.answer, one.holds_on);
        ASSERT_NE(stub.port, 0);
        const auto begin = Clock::now();
        EXPECT_EQ(server::answers_health("127.0.0.1", stub.port, one.good ? 10s : 300ms), one.good) << one.answer.substr(0, 40);
        EXPECT_LT(Clock::now() - begin, 10s);
    }
    EXPECT_FALSE(server::answers_health("127.0.0.1", 1, 300ms)); // nobody listens
    EXPECT_FALSE(server::answers_health("no.such.host.invalid", 80, 300ms));
}

// --- The program -------------------------------------------------------------------------------------------------------------------

TEST(Notifying, TheProgramTellsItsSupervisor)
{
    const Supervisor supervisor(own_name("@"));
    setenv("NOTIFY_SOCKET", supervisor.name().c_str(), 1);
    setenv("WATCHDOG_USEC", "1000000", 1);
    const Program program({"--port", "0"});
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");

    EXPECT_TRUE(supervisor.heard().starts_with("STATUS="));
    const int port = program.port_when_ready();
    ASSERT_NE(port, 0);
    EXPECT_EQ(supervisor.heard(), "READY=1\nSTATUS=ready on 127.0.0.1 port " + std::to_string(port));
    for (int i = 0; i < 3; ++i) EXPECT_EQ(supervisor.heard(), "WATCHDOG=1");

    // Without a descriptor for a further connection it answers nobody, and says nothing; with them again it does both.
    rlimit before{};
    ASSERT_EQ(prlimit(program.process, RLIMIT_NOFILE, nullptr, &before), 0);
    const rlimit none{0, before.rlim_max};
    ASSERT_EQ(prlimit(program.process, RLIMIT_NOFILE, &none, nullptr), 0);
    EXPECT_TRUE(holds(program.said_until("does not answer its health check; the watchdog is not told that it lives\n"), "not answer"));
    while (!supervisor.heard(500ms).empty()) {
    } // what was on its way
    EXPECT_EQ(supervisor.heard(2s), "");
    ASSERT_EQ(prlimit(program.process, RLIMIT_NOFILE, &before, nullptr), 0);
    EXPECT_EQ(supervisor.heard(), "WATCHDOG=1");

    kill(program.process, SIGTERM);
    EXPECT_EQ(supervisor.heard_with("STOPPING=1"), "STOPPING=1\nSTATUS=finishing work in flight");
    program.said_until("\nended\n");
    EXPECT_EQ(program.wait(), 0);
}

TEST(Notifying, TheProgramRunsWithoutItsSupervisor)
{
    setenv("NOTIFY_SOCKET", "/tmp/nobody-is-here", 1);
    const Program program({"--port", "0"});
    setenv("NOTIFY_SOCKET", "nowhere", 1);
    const Program wrong({"--port", "0"});
    unsetenv("NOTIFY_SOCKET");

    const std::string said = program.said_until("\nready\n");
    EXPECT_TRUE(holds(said, "\nwarning: NOTIFY_SOCKET: /tmp/nobody-is-here")) << said;
    kill(program.process, SIGTERM);
    program.said_until("\nended\n");
    EXPECT_EQ(program.wait(), 0);

    EXPECT_TRUE(wrong.said_until("\n").starts_with("penumbra-server: NOTIFY_SOCKET: \"nowhere\""));
    EXPECT_EQ(wrong.wait(), 2);
}

// --- Descriptors -------------------------------------------------------------------------------------------------------------------

rlim_t soft_limit_of(pid_t process)
{
    rlimit limit{};
    prlimit(process, RLIMIT_NOFILE, nullptr, &limit);
    return limit.rlim_cur;
}

TEST(Descriptors, TheProgramRaisesALowSoftLimit)
{
    rlimit before{};
    getrlimit(RLIMIT_NOFILE, &before);
    const rlim_t needed = 512 + server::descriptors_beside; // with the default's connections
    if (before.rlim_max < needed + 1) GTEST_SKIP() << "the hard limit is " << before.rlim_max;
    const rlim_t low = 256, high = needed + 1;
    for (const rlim_t soft : {low, high}) { // too few; more than enough, which stays
        const rlimit limit{soft, before.rlim_max};
        setrlimit(RLIMIT_NOFILE, &limit);
        const Program program({"--port", "0"});
        setrlimit(RLIMIT_NOFILE, &before);
        EXPECT_NE(program.port_when_ready(), 0);
        EXPECT_EQ(soft_limit_of(program.process), std::max<rlim_t>(soft, needed));
        kill(program.process, SIGTERM);
        program.said_until("\nended\n");
        EXPECT_EQ(program.wait(), 0);
    }
}

TEST(Descriptors, TheProgramSaysThatAHardLimitIsTooLow)
{
    FILE* const program = ::popen("ulimit -n 300 && exec " PENUMBRA_SERVER " --port 0 2>&1", "r");
    ASSERT_NE(program, nullptr);
    std::string said;
    for (int c = std::fgetc(program); c != EOF; c = std::fgetc(program)) said += static_cast<char>(c);
    const int status = ::pclose(program);
    EXPECT_EQ(WEXITSTATUS(status), 2);
    EXPECT_TRUE(said.starts_with("penumbra-server: RLIMIT_NOFILE: 300 open files are allowed, and 300 at most (expected at least 1024"))
        << said;
}

} // namespace
} // namespace penumbra::test
