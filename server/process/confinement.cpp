#include "process/confinement.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>

#include <dlfcn.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <penumbra/error.hpp>

#include "process/descriptor.hpp"

namespace penumbra::server {
namespace {

bool write_file(const char* path, const std::string& text)
{
    const Descriptor file(::open(path, O_WRONLY | O_CLOEXEC));
    return file && ::write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

constexpr std::uint64_t reads = LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
// REFER: moving a file to another folder, which PoCL does with each library that it has linked. Where it is not handled it is refused.
constexpr std::uint64_t writes = LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE |
                                 LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_MAKE_SYM |
                                 LANDLOCK_ACCESS_FS_MAKE_FIFO | LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_CHAR |
                                 LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_REFER;
constexpr std::uint64_t truncate = std::uint64_t{1} << 14; // LANDLOCK_ACCESS_FS_TRUNCATE, of kernels newer than Debian 12's headers
constexpr long version_of_refer = 2, version_of_truncate = 3;

// A folder that is not there needs no rule.
void open_folder(int rules, const std::string& folder, std::uint64_t access)
{
    const Descriptor at(::open(folder.c_str(), O_PATH | O_CLOEXEC));
    if (!at) return;
    const landlock_path_beneath_attr beneath{.allowed_access = access, .parent_fd = at.get()};
    syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &beneath, 0);
}

// Where the loader looks for what this program loads later.
std::vector<std::string> loader_folders()
{
    void* const program = dlopen(nullptr, RTLD_LAZY);
    Dl_serinfo size{};
    if (!program || dlinfo(program, RTLD_DI_SERINFOSIZE, &size) != 0) return {};
    const std::unique_ptr<void, decltype(&std::free)> memory(std::malloc(size.dls_size), &std::free);
    auto* const all = static_cast<Dl_serinfo*>(memory.get());
    if (!all || dlinfo(program, RTLD_DI_SERINFOSIZE, all) != 0 || dlinfo(program, RTLD_DI_SERINFO, all) != 0) return {};
    std::vector<std::string> folders;
    for (unsigned i = 0; i < all->dls_cnt; ++i) folders.emplace_back(all->dls_serpath[i].dls_name);
    return folders;
}

std::string value_of(const char* name)
{
    const char* const value = std::getenv(name);
    return value ? value : "";
}

#if defined(__x86_64__)
constexpr std::uint32_t this_machine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t this_machine = AUDIT_ARCH_AARCH64;
#endif

constexpr sock_filter step(std::uint16_t code, std::uint32_t value, std::uint8_t yes = 0, std::uint8_t no = 0) { return {code, yes, no, value}; }
constexpr std::uint32_t refused = SECCOMP_RET_ERRNO | EPERM;

// A call is allowed with these values of an argument (its lower half), and refused with others.
void allow_with(std::vector<sock_filter>& program, long call, int argument, const std::vector<std::uint32_t>& values)
{
    const auto count = static_cast<std::uint8_t>(values.size());
    program.push_back(step(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, static_cast<std::uint8_t>(count + 3)));
    program.push_back(
        step(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offsetof(seccomp_data, args) + 8 * static_cast<std::size_t>(argument))));
    for (std::uint8_t i = 0; i < count; ++i)
        program.push_back(step(BPF_JMP | BPF_JEQ | BPF_K, values[i], static_cast<std::uint8_t>(count - i), 0));
    program.push_back(step(BPF_RET | BPF_K, refused));
    program.push_back(step(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
}

} // namespace

bool leave_network()
{
    const uid_t user = geteuid();
    const gid_t group = getegid();
    if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
    // Inside, this user is who it was: files stay its own.
    const bool named = write_file("/proc/self/setgroups", "deny") &&
                       write_file("/proc/self/uid_map", std::to_string(user) + " " + std::to_string(user) + " 1") &&
                       write_file("/proc/self/gid_map", std::to_string(group) + " " + std::to_string(group) + " 1");
    if (!named) throw Error(ErrorCode::device, "a worker's user cannot be named in its namespace");
    return true;
}

OpenFolders folders_of_a_worker(const std::string& temporary, bool with_kernels)
{
    OpenFolders folders{.read = {"/usr", "/lib", "/lib32", "/lib64", "/bin", "/etc", "/opt", "/proc", "/sys"}, .write = {}};
    if (!temporary.empty()) folders.write.push_back(temporary);
    std::error_code unknown;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
    if (!unknown) folders.read.push_back(program.parent_path().string());
    for (std::string& folder : loader_folders()) folders.read.push_back(std::move(folder));
    // Where the OpenCL loader has been told to look.
    for (const char* name : {"OCL_ICD_VENDORS", "OPENCL_VENDOR_PATH"}) {
        const std::string list = value_of(name);
        for (std::size_t from = 0; from < list.size();) {
            const std::size_t to = std::min(list.find(':', from), list.size());
            if (to > from) folders.read.push_back(list.substr(from, to - from));
            from = to + 1;
        }
    }
    const auto kernels = [&](const std::string& folder, const char* below) {
        if (!folder.empty()) folders.write.push_back(folder + below);
    };
    if (with_kernels) {
        kernels(value_of("PENUMBRA_CACHE_DIR"), "");
        kernels(value_of("XDG_CACHE_HOME"), "/penumbra");
        kernels(value_of("HOME"), "/.cache/penumbra");
        kernels(value_of("POCL_CACHE_DIR"), "");
    }
    if (const std::string note = value_of("PENUMBRA_PROGRAM_LOG"); !note.empty())
        folders.write.push_back(std::filesystem::path(note).parent_path().string());
    return folders;
}

bool close_files(const OpenFolders& folders)
{
    const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
    if (version < version_of_refer) return false;
    const std::uint64_t all = reads | writes | (version >= version_of_truncate ? truncate : 0);
    const landlock_ruleset_attr handled{.handled_access_fs = all};
    const Descriptor rules(static_cast<int>(syscall(SYS_landlock_create_ruleset, &handled, sizeof(handled), 0)));
    if (!rules) return false;
    for (const std::string& folder : folders.read) open_folder(rules.get(), folder, reads);
    for (const std::string& folder : folders.write) open_folder(rules.get(), folder, all);
    open_folder(rules.get(), "/dev", reads | LANDLOCK_ACCESS_FS_WRITE_FILE);
    open_folder(rules.get(), "/dev/shm", all);
    return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && syscall(SYS_landlock_restrict_self, rules.get(), 0) == 0;
}

bool close_calls()
{
    constexpr std::array closed{SYS_ptrace, SYS_process_vm_readv, SYS_process_vm_writev, SYS_mount, SYS_umount2, SYS_pivot_root, SYS_bpf,
                                SYS_perf_event_open, SYS_init_module, SYS_finit_module, SYS_delete_module, SYS_kexec_load, SYS_add_key,
                                SYS_request_key, SYS_keyctl, SYS_userfaultfd, SYS_setns, SYS_unshare,
                                // Queues of calls, sockets among them, that this filter does not see; other processes.
                                SYS_io_uring_setup, SYS_io_uring_enter, SYS_io_uring_register, SYS_pidfd_getfd, SYS_pidfd_send_signal,
                                SYS_process_madvise, SYS_tkill, SYS_rt_sigqueueinfo, SYS_rt_tgsigqueueinfo, SYS_setpriority,
                                // A pair of sockets is closed as well: one of datagrams can be connected anew, to any local socket.
                                SYS_socket, SYS_socketpair, SYS_connect, SYS_bind, SYS_listen, SYS_accept, SYS_accept4};
    std::vector<sock_filter> program{step(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)),
                                     step(BPF_JMP | BPF_JEQ | BPF_K, this_machine, 1, 0),
                                     step(BPF_RET | BPF_K, refused),
                                     step(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
#if defined(__x86_64__)
    // The same calls under other numbers (x32).
    program.push_back(step(BPF_JMP | BPF_JGE | BPF_K, 0x40000000, 0, 1));
    program.push_back(step(BPF_RET | BPF_K, refused));
#endif
    for (const long call : closed) {
        program.push_back(step(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 1));
        program.push_back(step(BPF_RET | BPF_K, refused));
    }
    // Signals to itself (as abort(3) sends); limits of its own (0: the caller's).
    const auto self = static_cast<std::uint32_t>(getpid());
    allow_with(program, SYS_kill, 0, {self});
    allow_with(program, SYS_tgkill, 0, {self});
    allow_with(program, SYS_prlimit64, 0, {0, self});
    program.push_back(step(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
    const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
    return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC, &filter) == 0;
}

void limit_memory(std::uint64_t more_bytes)
{
    // Data: what is private and can be written, such as all that is allocated. Not the address space, of which allocators and drivers reserve
    // more than they ever use.
    std::ifstream status("/proc/self/status");
    std::uint64_t has_kib = 0;
    for (std::string word; status >> word;)
        if (word == "VmData:") {
            status >> has_kib;
            break;
        }
    const rlim_t limit = has_kib * 1024 + more_bytes;
    const rlimit both{limit, limit};
    if (has_kib == 0 || setrlimit(RLIMIT_DATA, &both) != 0)
        throw Error(ErrorCode::device, "a worker's memory cannot be limited: " + std::generic_category().message(errno));
}

void limit_processor(std::uint64_t seconds)
{
    rusage used{};
    rlimit limit{};
    if (getrusage(RUSAGE_SELF, &used) != 0 || getrlimit(RLIMIT_CPU, &limit) != 0) return;
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, static_cast<rlim_t>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + seconds + 1);
    setrlimit(RLIMIT_CPU, &limit); // the service's own clock is there as well
}

} // namespace penumbra::server
