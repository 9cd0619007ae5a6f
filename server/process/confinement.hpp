// What a worker may not do: it decodes what strangers send, with libraries that others wrote.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace penumbra::server {

// Takes the network from this process (a namespace of its own): to be called while it has one thread. False: the kernel does not give one.
bool leave_network();

// Folders that this process goes on using; everything else of the file system is closed.
struct OpenFolders {
    std::vector<std::string> read; // and execute: libraries, the linker, devices' own files
    std::vector<std::string> write;
};
// The loader's folders, those of devices and of this program, and as `write` the folder of temporary files; `kernels`: and those of built kernels.
OpenFolders folders_of_a_worker(const std::string& temporary, bool kernels);

// Closes the file system but for those folders (Landlock), for this thread and those that it makes. False: the kernel has no Landlock
// that lets files be moved within them (Linux 5.19).
bool close_files(const OpenFolders& folders);

// Refuses sockets, signals to other processes, tracing them, mounting and loading modules (seccomp), for this process and those that it starts.
// What it has open stays so. False: the kernel has no filters.
bool close_calls();

// Memory beyond what the process has now, in bytes: what is private and can be written (RLIMIT_DATA). Throws Error device where it cannot be set.
void limit_memory(std::uint64_t more_bytes);
// Processor time from now on, in seconds of all threads together; the kernel ends the process after that.
void limit_processor(std::uint64_t seconds);

} // namespace penumbra::server
