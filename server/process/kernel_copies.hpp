// Each worker's own copies of the built kernels: what one writes, no other loads.
#pragma once

#include <chrono>
#include <filesystem>

namespace penumbra::server {

// Where built kernels lie: PoCL's (host/opencl/driver_cache.hpp), and the programs of other drivers. Either may be empty: there are none.
struct KernelFolders {
    std::filesystem::path kernels, programs;
};

// What a process uses when PENUMBRA_CACHE_DIR is `cache`.
KernelFolders folders_in(const std::filesystem::path& cache);
// What this process and its like share, where PoCL's is known: PENUMBRA_CACHE_DIR, XDG_CACHE_HOME and HOME say where the other is.
KernelFolders shared_folders(const std::filesystem::path& kernels);

// Copies what was used since then, with its list, to new folders. Of PoCL's programs that is those that it has looked up; others stay behind, from
// older versions or of other programs. Throws std::filesystem::filesystem_error.
void copy_kernels(const KernelFolders& from, std::filesystem::file_time_type used_since, const KernelFolders& to);

// Whether libraries can be loaded from that folder's file system.
bool may_hold_code(const std::filesystem::path& folder);

} // namespace penumbra::server
