// The real penumbra-server on a free port of 127.0.0.1, ready; it ends with the object.
#pragma once

#include <array>
#include <csignal>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace penumbra::test {

inline constexpr const char* server_token = "0123456789abcdef";

class ServerProgram {
public:
    explicit ServerProgram(const std::vector<std::string>& arguments = {})
    {
        std::array<int, 2> ends{};
        if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe2");
        std::vector<std::string> words{PENUMBRA_SERVER, "--port", "0"};
        words.insert(words.end(), arguments.begin(), arguments.end());
        std::vector<char*> pointers;
        for (std::string& word : words) pointers.push_back(word.data());
        pointers.push_back(nullptr);
        process_ = fork();
        if (process_ == 0) {
            ::setenv("PENUMBRA_SERVER_TOKEN", server_token, 1);
            dup2(ends[1], 2);
            execv(PENUMBRA_SERVER, pointers.data());
            _exit(127);
        }
        ::close(ends[1]);
        errors_ = ends[0];

        std::string said;
        char c = 0;
        while (said.find("\nready\n") == std::string::npos && ::read(errors_, &c, 1) == 1) said += c;
        const std::string listening = "listening on 127.0.0.1 port ";
        const std::size_t at = said.find(listening);
        if (at == std::string::npos || !said.ends_with("\nready\n")) throw std::runtime_error("the server did not become ready: " + said);
        url = "http://127.0.0.1:" + std::to_string(std::stoi(said.substr(at + listening.size())));
        // So that its log never fills the pipe.
        reader_ = std::thread([this] {
            std::array<char, 4096> block;
            while (::read(errors_, block.data(), block.size()) > 0) {
            }
        });
    }
    ~ServerProgram()
    {
        kill(process_, SIGTERM);
        waitpid(process_, nullptr, 0);
        reader_.join();
        ::close(errors_);
    }
    ServerProgram(const ServerProgram&) = delete;
    ServerProgram& operator=(const ServerProgram&) = delete;

    std::string url;

private:
    pid_t process_ = 0;
    int errors_ = -1;
    std::thread reader_;
};

// The address of one with these options, for all tests of the process that need none of their own. It ends with the process.
inline const std::string& shared_server(const std::vector<std::string>& arguments = {})
{
    static std::map<std::vector<std::string>, std::unique_ptr<ServerProgram>> running;
    std::unique_ptr<ServerProgram>& server = running[arguments];
    if (!server) server = std::make_unique<ServerProgram>(arguments);
    return server->url;
}

} // namespace penumbra::test
