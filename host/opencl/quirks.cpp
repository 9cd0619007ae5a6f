#include "opencl/quirks.hpp"

#include <cstdlib>
#include <mutex>
#include <string>

#include <unistd.h>

#include "opencl/cache_folder.hpp"
#include "scene/parallel.hpp"

namespace penumbra::opencl {
namespace {

void set_unless_set(const char* name, const std::string& value)
{
    if (!value.empty()) setenv(name, value.c_str(), 0);
}

// A folder that PoCL can use: it crashes when its cache folder is missing or cannot be written, also with its cache turned off, and aborts
// when libraries cannot be loaded from there.
std::string pocl_folder()
{
    if (const std::string folder = cache_folder(); !folder.empty() && make_private_folder(folder + "/pocl")) return folder + "/pocl";

    // No cache folder: one of this user's for temporary files, used again by the next process. It is refused when somebody else made it.
    const char* variable = std::getenv("TMPDIR");
    const std::string temporary = variable && *variable ? variable : "/tmp";
    if (const std::string folder = temporary + "/penumbra-" + std::to_string(geteuid()); make_private_folder(folder)) return folder;

    // One for this process alone. It stays behind: PoCL uses it until the process's very end, after anything that could remove it.
    std::string folder = temporary + "/penumbra-XXXXXX";
    return mkdtemp(folder.data()) ? folder : std::string();
}

} // namespace

void prepare_environment()
{
    // Once: setenv while another thread reads the environment is not safe, and PoCL looks at its first call only.
    static std::once_flag once;
    std::call_once(once, [] {
        // Its handler would hide integer divisions by zero of the whole process.
        set_unless_set("POCL_SIGFPE_HANDLER", "0");

        // It takes as many threads as the machine has processors, whatever the process may use (taskset, batch systems, containers).
        set_unless_set("POCL_MAX_PTHREAD_COUNT", std::to_string(processor_count()));

        // By default /tmp/pocl where there is no HOME: a path that any user of the machine can make first, and fill with code.
        if (!std::getenv("POCL_CACHE_DIR")) set_unless_set("POCL_CACHE_DIR", pocl_folder());

        // Not set: HWLOC_SYNTHETIC, which corrects the memory that PoCL reports on some virtual machines, but loses the sizes of the
        // caches.
    });
}

Quirks quirks_of(const cl::Device& device)
{
    Quirks quirks;
    if (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) quirks.lanes = 16;
    const std::string platform = cl::Platform(device.getInfo<CL_DEVICE_PLATFORM>()).getInfo<CL_PLATFORM_NAME>();
    quirks.keep_binaries = platform.find("Portable Computing Language") == std::string::npos;
    return quirks;
}

} // namespace penumbra::opencl
