#include "opencl/quirks.hpp"

#include <cstdlib>
#include <functional>
#include <string>

#include <unistd.h>

#include "opencl/cache_folder.hpp"
#include "scene/joined.hpp"
#include "scene/parallel.hpp"

namespace penumbra::opencl {
namespace {

void set_unless_set(const char* name, const std::string& value)
{
    if (!value.empty()) setenv(name, value.c_str(), 0);
}

struct Prepared {
    DriverFolder folder;
    std::vector<std::string> warnings;
};

// A folder that PoCL can use: it crashes when its cache folder is missing or cannot be written, also with its cache turned off, and aborts
// when libraries cannot be loaded from there.
Prepared choose_folder()
{
    Prepared chosen;
    std::vector<std::string> problems; // of folders that were asked for
    const auto usable = [&](const std::string& path, bool ours, const std::string& origin) {
        std::string why = ours ? unusable_private(path) : unusable(path);
        if (why.empty()) {
            chosen.folder = {path, ours, {}};
            return true;
        }
        problems.push_back(path + origin + ' ' + std::move(why));
        return false;
    };
    // Not `pocl`, where builds before this check keep theirs without a lock.
    if (const char* given = std::getenv("POCL_CACHE_DIR"); given && *given) {
        if (usable(given, false, " (POCL_CACHE_DIR)")) return chosen;
    } else if (const std::string folder = cache_folder(); !folder.empty() && usable(folder + "/kernels", true, "")) {
        return chosen;
    }
    const auto instead = [&] {
        for (const std::string& problem : problems)
            chosen.warnings.push_back("compiled kernels go to " + chosen.folder.path + ": " + problem);
        return chosen;
    };

    // No cache folder: one of this user's for temporary files, used again by the next process. It is refused when somebody else made it.
    const char* variable = std::getenv("TMPDIR");
    const std::string temporary = variable && *variable ? variable : "/tmp";
    const std::vector<std::string> asked = problems;
    if (usable(temporary + "/penumbra-kernels-" + std::to_string(geteuid()), true, "")) return instead();

    // One for this process alone. It stays behind: PoCL uses it until the process's very end, after anything that could remove it.
    const std::vector<std::string> named = problems;
    if (std::string folder = temporary + "/penumbra-kernels-XXXXXX"; mkdtemp(folder.data())) {
        if (usable(folder, true, "")) {
            problems = asked;
            return instead();
        }
        rmdir(folder.c_str());
    }

    // PoCL gives no device for a folder that cannot be made; for one that it cannot write to it crashes.
    chosen.folder = {"/dev/null/penumbra", true, joined(named, std::identity(), "; ")};
    return chosen;
}

const Prepared& prepared()
{
    // Once: setenv while another thread reads the environment is not safe, and PoCL looks at its first call only.
    static const Prepared once = [] {
        // Its handler would hide integer divisions by zero of the whole process.
        set_unless_set("POCL_SIGFPE_HANDLER", "0");

        // It takes as many threads as the machine has processors, whatever the process may use (taskset, batch systems, containers).
        set_unless_set("POCL_MAX_PTHREAD_COUNT", std::to_string(processor_count()));

        // By default /tmp/pocl where there is no HOME: a path that any user of the machine can make first, and fill with code. One that the
        // user set stays unless it cannot be used.
        Prepared chosen = choose_folder();
        setenv("POCL_CACHE_DIR", chosen.folder.path.c_str(), 1);

        // Not set: HWLOC_SYNTHETIC, which corrects the memory that PoCL reports on some virtual machines, but loses the sizes of the
        // caches.
        return chosen;
    }();
    return once;
}

} // namespace

void prepare_environment() { prepared(); }
const std::vector<std::string>& environment_warnings() { return prepared().warnings; }
const DriverFolder& driver_folder() { return prepared().folder; }

bool is_pocl(std::string_view platform) { return platform.find("Portable Computing Language") != std::string_view::npos; }

Quirks quirks_of(const cl::Device& device)
{
    Quirks quirks;
    const bool processor = (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) != 0;
    if (processor) quirks.lanes = 16;
    const cl::Platform platform(device.getInfo<CL_DEVICE_PLATFORM>());
    quirks.driver_cache = is_pocl(platform.getInfo<CL_PLATFORM_NAME>());
    quirks.host_memory = processor && quirks.driver_cache;
    quirks.keep_binaries = !quirks.driver_cache;
    // By Clang 15, whose header it declares the same functions as.
    const std::string version = platform.getInfo<CL_PLATFORM_VERSION>();
    if (quirks.driver_cache && version.find("PoCL 3.1") != std::string::npos && version.find("LLVM 15") != std::string::npos)
        quirks.builtins = "common/builtins_pocl_31.clh";
    quirks.system_linker = quirks.driver_cache && version.find("+debian") != std::string::npos;
    return quirks;
}

} // namespace penumbra::opencl
