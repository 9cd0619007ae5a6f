// What a worker may not do, tried by a process that has closed it to itself.
#include <gtest/gtest.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include <fcntl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include "process/confinement.hpp"

namespace penumbra::test {
namespace {

namespace fs = std::filesystem;

// Runs it in a process of its own, that is to say yes.
#define EXPECT_IN_CHILD(condition) EXPECT_EXIT(_exit((condition) ? 0 : 1), testing::ExitedWithCode(0), "")

class Confinement : public testing::Test {
protected:
    void SetUp() override
    {
        GTEST_FLAG_SET(death_test_style, "fast");
        std::string pattern = (fs::temp_directory_path() / "penumbra-confinement-XXXXXX").string();
        folder = mkdtemp(pattern.data());
        fs::create_directory(folder / "open");
        fs::create_directory(folder / "shut");
        std::ofstream(folder / "shut" / "secret") << "secret";
    }
    void TearDown() override { fs::remove_all(folder); }
    bool closed() const { return server::close_files({.read = {"/usr"}, .write = {(folder / "open").string()}}); }
    fs::path folder;
};

bool can_open(const fs::path& path, int flags)
{
    const int file = ::open(path.c_str(), flags | O_CLOEXEC, 0600);
    if (file >= 0) ::close(file);
    return file >= 0;
}

TEST_F(Confinement, FilesElsewhereAreClosed)
{
    if (syscall(SYS_landlock_create_ruleset, nullptr, 0, 1) < 2) GTEST_SKIP() << "this kernel has no Landlock";
    EXPECT_IN_CHILD(closed() && !can_open(folder / "shut" / "secret", O_RDONLY));
    EXPECT_IN_CHILD(closed() && !can_open(folder / "shut" / "new", O_WRONLY | O_CREAT));
    EXPECT_IN_CHILD(closed() && !can_open("/etc/passwd", O_RDONLY));
    EXPECT_IN_CHILD(closed() && can_open(folder / "open" / "new", O_RDWR | O_CREAT));
    EXPECT_IN_CHILD(closed() && can_open("/usr/bin/env", O_RDONLY) && !can_open("/usr/new", O_WRONLY | O_CREAT));
    EXPECT_IN_CHILD(closed() && can_open("/dev/null", O_WRONLY));
}

// As PoCL does with what it has linked.
TEST_F(Confinement, FilesMoveWithinWhatIsOpen)
{
    fs::create_directories(folder / "open" / "kernels");
    std::ofstream(folder / "open" / "new") << "library";
    EXPECT_IN_CHILD((closed(), std::rename((folder / "open" / "new").c_str(), (folder / "open" / "kernels" / "library").c_str()) == 0));
    std::ofstream(folder / "open" / "mine") << "text";
    EXPECT_IN_CHILD((closed(), std::rename((folder / "open" / "mine").c_str(), (folder / "open" / "yours").c_str()) == 0));
}

TEST_F(Confinement, FilesElsewhereKeepTheirLength)
{
    if (syscall(SYS_landlock_create_ruleset, nullptr, 0, 1) < 3) GTEST_SKIP() << "this kernel's Landlock does not know truncation";
    EXPECT_IN_CHILD(closed() && ::truncate((folder / "shut" / "secret").c_str(), 0) != 0 && errno == EACCES);
    std::ofstream(folder / "open" / "mine") << "text";
    EXPECT_IN_CHILD(closed() && ::truncate((folder / "open" / "mine").c_str(), 0) == 0);
}

// One that came by another way serves nobody: it may not be connected, nor bound.
TEST_F(Confinement, SocketsAndTracingAreRefused)
{
    EXPECT_IN_CHILD(server::close_calls() && ::socketpair(AF_UNIX, SOCK_DGRAM, 0, std::array<int, 2>{}.data()) < 0 && errno == EPERM);
    const int before = ::socket(AF_UNIX, SOCK_DGRAM, 0);
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = "/run/nobody"};
    const auto* const any = reinterpret_cast<const sockaddr*>(&address);
    EXPECT_IN_CHILD(server::close_calls() && ::connect(before, any, sizeof(address)) < 0 && errno == EPERM);
    EXPECT_IN_CHILD(server::close_calls() && ::bind(before, any, sizeof(address)) < 0 && errno == EPERM);
    ::close(before);
    EXPECT_IN_CHILD(server::close_calls() && ::socket(AF_INET, SOCK_STREAM, 0) < 0 && errno == EPERM);
    EXPECT_IN_CHILD(server::close_calls() && ::socket(AF_INET6, SOCK_DGRAM, 0) < 0 && errno == EPERM);
    EXPECT_IN_CHILD(server::close_calls() && ::socket(AF_NETLINK, SOCK_RAW, 0) < 0 && errno == EPERM);
    EXPECT_IN_CHILD(server::close_calls() && ::socket(AF_UNIX, SOCK_STREAM, 0) < 0 && errno == EPERM);
    EXPECT_IN_CHILD(server::close_calls() && ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) < 0 && errno == EPERM);
}

TEST_F(Confinement, OtherProcessesAreOutOfReach)
{
    const pid_t parent = getpid();
    EXPECT_IN_CHILD(server::close_calls() && kill(parent, 0) < 0 && errno == EPERM && kill(getpid(), 0) == 0);
    EXPECT_IN_CHILD(server::close_calls() && syscall(SYS_tgkill, parent, parent, 0) < 0 && errno == EPERM);
    rlimit limit{};
    EXPECT_IN_CHILD(server::close_calls() && prlimit(parent, RLIMIT_NOFILE, nullptr, &limit) < 0 && errno == EPERM);
    EXPECT_IN_CHILD(server::close_calls() && getrlimit(RLIMIT_NOFILE, &limit) == 0);
    EXPECT_IN_CHILD(server::close_calls() && setpriority(PRIO_PROCESS, static_cast<id_t>(parent), 19) < 0 && errno == EPERM);
    EXPECT_EXIT((server::close_calls(), std::abort()), testing::KilledBySignal(SIGABRT), "");
}

TEST_F(Confinement, NoWayAroundTheFilter)
{
    EXPECT_IN_CHILD(server::close_calls() && syscall(SYS_io_uring_setup, 1, nullptr) < 0 && errno == EPERM);
#if defined(__x86_64__)
    constexpr long x32 = 0x40000000;
    EXPECT_IN_CHILD(server::close_calls() && syscall(x32 | SYS_socket, AF_INET, SOCK_STREAM, 0) < 0 && errno == EPERM);
#endif
}

// What workers share is written by the first process alone.
TEST_F(Confinement, BuiltKernelsAreOutOfReachOfAWorker)
{
    if (syscall(SYS_landlock_create_ruleset, nullptr, 0, 1) < 2) GTEST_SKIP() << "this kernel has no Landlock";
    const fs::path shared = folder / "shut", own = folder / "open";
    const auto confined = [&](bool kernels) {
        setenv("PENUMBRA_CACHE_DIR", shared.c_str(), 1);
        return server::close_files(server::folders_of_a_worker(own.string(), kernels));
    };
    EXPECT_IN_CHILD(confined(false) && !can_open(shared / "new", O_WRONLY | O_CREAT) && !can_open(shared / "secret", O_RDONLY));
    EXPECT_IN_CHILD(confined(false) && can_open(own / "new", O_WRONLY | O_CREAT));
    EXPECT_IN_CHILD(confined(true) && can_open(shared / "new", O_WRONLY | O_CREAT));
}

TEST_F(Confinement, MemoryIsLimited)
{
    constexpr std::size_t mib = std::size_t{1} << 20;
    const auto takes = [](std::size_t bytes) {
        const std::unique_ptr<void, decltype(&std::free)> memory(std::malloc(bytes), &std::free);
        return memory != nullptr;
    };
#ifndef __SANITIZE_ADDRESS__
    EXPECT_IN_CHILD((server::limit_memory(256 * mib), takes(128 * mib) && !takes(512 * mib)));
#endif
}

} // namespace
} // namespace penumbra::test
