// penumbra-server: the HTTP service. Exit codes: 0 ended as asked, 1 it could not work, 2 wrong usage.
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>

#include <penumbra/describe.hpp>
#include <penumbra/error.hpp>

#include "http/service.hpp"
#include "masks/worker.hpp"
#include "process/descriptors.hpp"
#include "process/memory.hpp"
#include "process/notify.hpp"
#include "process/options.hpp"

namespace penumbra::server {
namespace {

// A line on standard error, whole.
void say(std::string_view line)
{
    static std::mutex mutex;
    const std::scoped_lock lock(mutex);
    std::fwrite(line.data(), 1, line.size(), stderr);
    std::fputc('\n', stderr);
}

bool is_loopback(const std::string& host) { return host == "localhost" || host == "::1" || host.starts_with("127."); }

// Waits for SIGTERM or SIGINT, which every thread has blocked; false when the time is up first.
bool wait_for_signal(const sigset_t& signals, const timespec* time)
{
    for (;;) {
        const int got = time ? sigtimedwait(&signals, nullptr, time) : sigwaitinfo(&signals, nullptr);
        if (got > 0) return true;
        if (time && errno == EAGAIN) return false;
    }
}

// Tells the supervisor; that it cannot be told is worth a line, not the service.
void tell(const Notifier& notifier, const std::string& state)
{
    if (const std::string wrong = notifier.tell(state); !wrong.empty()) say("warning: " + wrong);
}

std::string workers_text(const Options& options, const Greeting& greeting)
{
    std::string closed;
    for (const std::string& what : greeting.closed) closed += (closed.empty() ? "" : ", ") + what;
    return "workers: " + std::to_string(options.slots) + " and " + std::to_string(spare_workers(options)) + " to spare, each with " + std::to_string(greeting.memory >> 20) + " MiB; closed to them: " +
           (closed.empty() ? "nothing, as this kernel offers no way" : closed) + "\n";
}

// What goes before the first request. Gives the port.
int begin(const Options& options, Service& service)
{
    const int port = service.bind();
    say("penumbra-server " + version() + "\n" + startup_text(options) + workers_text(options, service.greeting()) + "listening on " + options.host + " port " + std::to_string(port));
    if (!is_loopback(options.host) && options.token.empty())
        say("warning: everybody who reaches " + options.host + " can use this service; set a token, or put it behind a proxy");
    return port;
}

int serve(const Options& options, const Environment& environment)
{
    // Blocked before any thread is made, so that all of them inherit it.
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);

    if (const std::string unknown = ensure_descriptors(static_cast<std::uint64_t>(options.connections) + descriptors_beside);
        !unknown.empty())
        say("warning: " + unknown);
    const Notifier notifier(environment);
    Service service(options, say);
    for (const std::string& warning : service.greeting().warnings) say("warning: " + warning);
    const int port = begin(options, service);
    tell(notifier, "STATUS=building kernels and checking the device");

    // A failure to get ready ends the service as a signal does, with another exit code.
    std::exception_ptr failure;
    std::atomic<bool> failed = false;
    std::optional<Watchdog> watchdog;
    std::jthread getting_ready([&] {
        try {
            service.become_ready();
            say("ready");
            tell(notifier, "READY=1\nSTATUS=ready on " + options.host + " port " + std::to_string(port));
            watchdog.emplace(
                notifier, [&](auto within) { return service.works() && answers_health(options.host, port, within); }, say);
        } catch (const Problem& problem) {
            // Told to end before it was ready, or a failure.
            if (problem.reason != service_ends().reason) {
                failure = std::current_exception();
                failed = true;
                kill(getpid(), SIGTERM);
            }
        } catch (...) {
            failure = std::current_exception();
            failed = true;
            kill(getpid(), SIGTERM);
        }
    });
    std::jthread answering([&] { service.serve(); });

    wait_for_signal(signals, nullptr);
    say("ending: work in flight is being finished, or stopped");
    tell(notifier, failed ? "STOPPING=1\nSTATUS=could not get ready" : "STOPPING=1\nSTATUS=finishing work in flight");
    service.drain();
    if (options.drain_s > 0) {
        const timespec time{options.drain_s, 0};
        wait_for_signal(signals, &time); // a second signal shortens it
    }
    service.end_work();
    getting_ready.join();
    watchdog.reset(); // from here on nobody is answered
    service.stop();
    answering.join();
    if (failure) std::rethrow_exception(failure);
    say("ended");
    return 0;
}

int run(const std::vector<std::string>& arguments)
{
    for (const std::string& argument : arguments) {
        std::string text;
        if (argument == "--help" || argument == "-h") text = help_text();
        if (argument == "--version") text = "penumbra-server " + version() + "\n";
        if (argument == "--limits") text = limits_markdown();
        if (text.empty()) continue;
        if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
            throw Error(ErrorCode::output, "standard output cannot be written");
        return 0;
    }
    const Environment environment = [](const char* name) -> const char* { return std::getenv(name); };
    // Not for users: what a service that has ended leaves behind. Of the folders that WorkerPool makes.
    if (constexpr std::string_view remove = "--remove="; !arguments.empty() && arguments.front().starts_with(remove)) {
        const std::filesystem::path folder = arguments.front().substr(remove.size());
        std::error_code ignored; // there is nobody to tell
        if (folder.filename().string().starts_with("penumbra-server-") && folder.parent_path() == std::filesystem::temp_directory_path(ignored))
            std::filesystem::remove_all(folder, ignored);
        return 0;
    }
    // Nor this: how the service starts its workers.
    for (const auto& [flag, kernels] : {std::pair(std::string_view("--worker="), Kernels::own), {"--builder=", Kernels::shared}}) {
        if (arguments.empty() || !arguments.front().starts_with(flag)) continue;
        fcntl(worker_channel, F_SETFD, FD_CLOEXEC);
        return work(options_from({arguments.begin() + 1, arguments.end()}, [](const char*) -> const char* { return nullptr; }), kernels,
                    arguments.front().substr(flag.size()), Channel(Descriptor(worker_channel)));
    }
    return serve(options_from(arguments, environment), environment);
}

} // namespace
} // namespace penumbra::server

int main(int argc, char** argv)
{
    using namespace penumbra;
    try {
        return server::run({argv + 1, argv + argc});
    } catch (const Error& error) {
        server::say("penumbra-server: " + std::string(error.what()));
        return exit_code(error.code());
    } catch (const std::exception& error) {
        server::say("penumbra-server: " + std::string(error.what()));
        return 1;
    }
}
