// What devices do differently, in one place: every decision that depends on the device or its driver is made here.
#pragma once

#define CL_HPP_ENABLE_EXCEPTIONS
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#include <CL/opencl.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace penumbra::opencl {

struct Quirks {
    // Receivers that one work-item owns. 16 on CPU devices (PoCL does not vectorise loops that accumulate floats across work-items, so the
    // kernels hold the lanes themselves), 1 on GPUs (the hardware does).
    int lanes = 1;
    // Kernels read the host's memory as it is now: a word that the host writes while they run is seen (penumbra/stop.hpp).
    bool host_memory = false;
    // Whether built programs are kept on disk as binaries. Not with PoCL, which has a cache of its own. A process that builds 4 programs
    // and launches their 13 kernels, from main() to the last launch, on a 2-core EPYC under a load of 4, median of 4 (cold) and 8 (warm):
    //     without  cold 3.3 s   warm 0.25 s
    //     with     cold 5.7 s   warm 0.09 s
    // To give its binary, PoCL compiles every kernel once more. Cold: PENUMBRA_CACHE_DIR is empty; warm: the same process again.
    bool keep_binaries = true;
    // PoCL: it keeps compiled kernels in a folder (driver_cache.hpp) that must be sound and have room, or it ends the process.
    bool driver_cache = false;
    // A kernel file that declares the built-in functions in place of the driver's own header, which it takes longer to read than it does to
    // compile most programs; empty: none.
    std::string builtins;
    // Debian's PoCL: it links every kernel by the system's `ld`, or ends the process.
    bool system_linker = false;
};

// Where PoCL keeps compiled kernels in this process.
struct DriverFolder {
    std::string path;
    bool ours = true;    // false: the user's own POCL_CACHE_DIR, where other programs may keep theirs
    std::string problem; // why no folder can be used: PoCL will give no device. Empty: one can
};

// Called before the first OpenCL call of the process: sets what PoCL reads from the environment, unless the user has set it
// (POCL_SIGFPE_HANDLER, threads from the affinity mask, a private cache folder).
void prepare_environment();

// What prepare_environment has to say: which folder cannot be used, why, and which one is used instead. It is called first where it was not.
const std::vector<std::string>& environment_warnings();
const DriverFolder& driver_folder();

// By the platform's name.
bool is_pocl(std::string_view platform);

Quirks quirks_of(const cl::Device& device);

} // namespace penumbra::opencl
