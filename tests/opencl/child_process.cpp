#include <map>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fixture.hpp"

namespace penumbra::opencl::test {

int run_in_child(const std::string& test, const std::vector<std::pair<std::string, std::string>>& environment)
{
    std::map<std::string, std::string> variables;
    for (char** entry = environ; *entry; ++entry) {
        const std::string text = *entry;
        const std::size_t equals = text.find('=');
        // This process has prepared its own environment already.
        if (equals != std::string::npos && !text.starts_with("POCL_")) variables[text.substr(0, equals)] = text.substr(equals + 1);
    }
    for (const auto& [name, value] : environment) {
        variables.erase(name);
        if (!value.empty()) variables[name] = value;
    }

    std::vector<std::string> lines;
    for (const auto& [name, value] : variables) lines.push_back(name + '=' + value);
    std::vector<char*> child_environment;
    for (std::string& line : lines) child_environment.push_back(line.data());
    child_environment.push_back(nullptr);

    std::string program = "test", filter = "--gtest_filter=" + test, disabled = "--gtest_also_run_disabled_tests",
                brief = "--gtest_brief=1";
    char* arguments[] = {program.data(), filter.data(), disabled.data(), brief.data(), nullptr};
    pid_t child = 0;
    if (posix_spawn(&child, "/proc/self/exe", nullptr, nullptr, arguments, child_environment.data()) != 0) return -1;
    int status = 0;
    if (waitpid(child, &status, 0) != child) return -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

} // namespace penumbra::opencl::test
