#include "isolate.hpp"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <string_view>
#include <system_error>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <penumbra/error.hpp>

namespace penumbra::cli {
namespace {

volatile sig_atomic_t child = 0;
extern "C" void pass_on(int signal) { kill(child, signal); }

} // namespace

std::optional<std::vector<std::string>> isolated_arguments(int argc, char** argv)
{
    std::vector<std::string> rest;
    for (int i = 1; i < argc; ++i)
        if (std::string_view(argv[i]) != "--isolate") rest.emplace_back(argv[i]);
    if (rest.size() + 1 == static_cast<std::size_t>(argc)) return {};
    return rest;
}

int run_isolated(const std::vector<std::string>& arguments)
{
    std::vector<std::string> words{"penumbra"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    pointers.reserve(words.size() + 1);
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    pid_t process = 0;
    if (const int wrong = posix_spawn(&process, "/proc/self/exe", nullptr, nullptr, pointers.data(), environ); wrong != 0)
        throw Error(ErrorCode::internal, "--isolate: no process: " + std::generic_category().message(wrong));
    child = process;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, pass_on);
    int status = 0;
    while (waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    if (WIFEXITED(status)) return WEXITSTATUS(status);
    const int signal = WTERMSIG(status);
    throw Error(ErrorCode::internal, "the process that did the work died of " + std::string(strsignal(signal)) + " (signal " + std::to_string(signal) + ")",
                "nothing was written under a final name; try each of its files alone");
}

} // namespace penumbra::cli
