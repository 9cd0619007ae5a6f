// The real program, penumbra-server, as a child process.
#pragma once

#include <array>
#include <csignal>
#include <string>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace penumbra::test {

struct Program {
    pid_t process = 0;
    int errors = -1;
    mutable bool waited = false;

    explicit Program(const std::vector<std::string>& arguments)
    {
        std::array<int, 2> ends{};
        if (pipe2(ends.data(), O_CLOEXEC) != 0) return;
        std::vector<std::string> words{PENUMBRA_SERVER};
        words.insert(words.end(), arguments.begin(), arguments.end());
        std::vector<char*> pointers;
        for (std::string& word : words) pointers.push_back(word.data());
        pointers.push_back(nullptr);
        process = fork();
        if (process == 0) {
            dup2(ends[1], 2);
            execv(PENUMBRA_SERVER, pointers.data());
            _exit(127);
        }
        ::close(ends[1]);
        errors = ends[0];
    }
    // A test that failed on the way leaves no process behind.
    ~Program()
    {
        ::close(errors);
        if (waited) return;
        kill(process, SIGKILL);
        wait();
    }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;

    // What it says up to and with `end`, or all.
    std::string said_until(const std::string& end) const
    {
        std::string text;
        char c = 0;
        while (!text.ends_with(end) && ::read(errors, &c, 1) == 1) text += c;
        return text;
    }
    // The port, once it is ready; 0 when it does not get there.
    int port_when_ready() const
    {
        const std::string block = said_until("\nready\n"), listening = " port ";
        const std::size_t at = block.find(listening, block.find("listening on "));
        return at == std::string::npos ? 0 : std::stoi(block.substr(at + listening.size()));
    }
    // Its exit code, or 128 and the signal that ended it.
    int wait() const
    {
        int status = 0;
        waited = true;
        waitpid(process, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
};

} // namespace penumbra::test
