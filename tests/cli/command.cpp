#include <penumbra/image.hpp>

#include "command.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

namespace penumbra::test {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void become_penumbra(const Arguments& arguments, const Environment& environment)
{
    for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
    std::vector<char*> argv{const_cast<char*>(PENUMBRA_CLI)};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    ::execv(PENUMBRA_CLI, argv.data());
    ::_exit(127);
}

// Reads both until their ends, so that neither can fill up and block.
void drain(int out, int err, Ran& ran)
{
    std::array<pollfd, 2> streams{pollfd{out, POLLIN, 0}, pollfd{err, POLLIN, 0}};
    std::array<std::string*, 2> texts{&ran.out, &ran.err};
    std::array<char, 4096> block;
    while (streams[0].fd >= 0 || streams[1].fd >= 0) {
        if (::poll(streams.data(), streams.size(), -1) < 0) continue;
        for (std::size_t i = 0; i < streams.size(); ++i) {
            if (streams[i].fd < 0 || streams[i].revents == 0) continue;
            const ssize_t count = ::read(streams[i].fd, block.data(), block.size());
            if (count > 0)
                texts[i]->append(block.data(), static_cast<std::size_t>(count));
            else
                streams[i].fd = -1; // the end; a terminal whose other side is gone reports an error instead
        }
    }
}

} // namespace

Ran penumbra(const Arguments& arguments, const Environment& environment)
{
    std::array<int, 2> out{}, err{};
    if (::pipe(out.data()) != 0 || ::pipe(err.data()) != 0) throw std::runtime_error("pipe");
    const pid_t process = ::fork();
    if (process == 0) {
        ::dup2(out[1], STDOUT_FILENO);
        ::dup2(err[1], STDERR_FILENO);
        for (const int fd : {out[0], out[1], err[0], err[1]}) ::close(fd);
        become_penumbra(arguments, environment);
    }
    ::close(out[1]);
    ::close(err[1]);
    Ran ran;
    drain(out[0], err[0], ran);
    ::close(out[0]);
    ::close(err[0]);
    ran.code = wait_for(process);
    return ran;
}

Ran penumbra_on_terminal(const Arguments& arguments)
{
    int terminal = -1;
    winsize size{.ws_row = 24, .ws_col = 100, .ws_xpixel = 0, .ws_ypixel = 0};
    const pid_t process = ::forkpty(&terminal, nullptr, nullptr, &size);
    if (process == 0) become_penumbra(arguments, {{"TERM", "xterm"}});
    Ran ran;
    drain(terminal, -1, ran);
    ::close(terminal);
    ran.code = wait_for(process);
    return ran;
}

int start(const Arguments& arguments)
{
    const pid_t process = ::fork();
    if (process == 0) {
        const int nowhere = ::open("/dev/null", O_WRONLY);
        ::dup2(nowhere, STDOUT_FILENO);
        ::dup2(nowhere, STDERR_FILENO);
        become_penumbra(arguments, {});
    }
    return process;
}

int wait_for(int process)
{
    int status = 0;
    ::waitpid(process, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string text_of(const std::string& path)
{
    std::ifstream in(path, std::ios::binary);
    EXPECT_TRUE(in) << path << " is not there";
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

void expect_alike(const std::string& path, const std::string& other)
{
    const penumbra::Image a = penumbra::read_image(path), b = penumbra::read_image(other);
    ASSERT_EQ(a.pixels.size(), b.pixels.size());
    double sum = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) sum += std::abs(static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i]));
    EXPECT_LE(sum / static_cast<double>(a.pixels.size()), .01) << path << " and " << other;
}

void expect_same_bytes(const std::string& path, const std::string& other)
{
    const bool same = text_of(path) == text_of(other);
    EXPECT_TRUE(same) << path << " and " << other << " differ";
}

void write_text(const std::string& path, const std::string& text)
{
    std::ofstream out(path, std::ios::binary);
    out << text;
    ASSERT_TRUE(out.flush()) << path;
}

CommandTest::CommandTest(const std::string& below)
{
    std::string name = (fs::temp_directory_path() / "penumbra_cli_XXXXXX").string();
    if (!::mkdtemp(name.data())) throw std::runtime_error("mkdtemp");
    folder_ = name;
    if (!below.empty()) fs::create_directory(path(below));
}

CommandTest::~CommandTest()
{
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
}

std::vector<std::string> CommandTest::files(const std::string& below) const
{
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path(below))) names.push_back(entry.path().filename().string());
    std::ranges::sort(names);
    return names;
}

std::string CommandTest::write_scene(const std::string& name, const std::string& technique, const std::string& more, double height) const
{
    std::ostringstream json;
    json << R"({
  "penumbra": 1,
  "light": { "kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5] },
  "objects": [
    { "quad": { "center": [0.25, )"
         << height << R"(, 0], "half_u": [1, 0, 0], "half_v": [0, 0, -0.75] }, "casts": true, "receives": false },
    { "quad": { "center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4] }, "casts": false, "receives": true }
  ],
  "occluders": { "camera": { "kind": "light", "tan_half_fov": [0.5, 0.5] }, "resolution": [61, 61] },
  "receivers": { "camera": { "kind": "light", "tan_half_fov": [0.5, 0.5] }, "resolution": [40, 31] },
  "technique": )"
         << technique << more << "\n}\n";
    write_text(path(name), json.str());
    return path(name);
}

void expect_one_error(const Ran& ran, int code, const std::vector<std::string>& parts)
{
    EXPECT_EQ(ran.code, code) << ran.err;
    EXPECT_EQ(ran.out, "");
    EXPECT_TRUE(ran.err.starts_with("penumbra: ")) << ran.err;
    EXPECT_EQ(std::ranges::count(ran.err, '\n'), 1) << ran.err;
    for (const std::string& part : parts) EXPECT_NE(ran.err.find(part), std::string::npos) << "\"" << part << "\" is not in: " << ran.err;
}

} // namespace penumbra::test
