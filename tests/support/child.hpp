// Runs one (disabled) test of this executable in a process of its own, with variables set in its environment, and gives what it printed.
#pragma once

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

namespace penumbra::test {

// Lines of the child's output that begin with `tag`, joined. The test fails when the child does.
inline std::string child_output(const std::string& test, const std::vector<std::pair<std::string, std::string>>& environment,
                                const std::string& tag)
{
    std::array<char, 4096> self{};
    const auto length = readlink("/proc/self/exe", self.data(), self.size() - 1);
    if (length <= 0) {
        ADD_FAILURE() << "/proc/self/exe cannot be read";
        return {};
    }
    // `env` sets the child's variables; this process, whose driver may be running already, keeps its own.
    std::string command = "env";
    for (const auto& [name, value] : environment) command += " " + name + "=" + value;
    command += " '" + std::string(self.data()) + "' --gtest_also_run_disabled_tests --gtest_filter=" + test;
    FILE* pipe = popen(command.c_str(), "r");
    if (!pipe) {
        ADD_FAILURE() << "no child process";
        return {};
    }
    std::string found;
    std::array<char, 1024> line{};
    while (fgets(line.data(), static_cast<int>(line.size()), pipe))
        if (std::string(line.data()).starts_with(tag)) found += line.data();
    EXPECT_EQ(pclose(pipe), 0) << command;
    return found;
}

} // namespace penumbra::test
