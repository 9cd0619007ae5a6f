#include "opencl/machine_memory.hpp"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

#include <sys/resource.h>

namespace penumbra::opencl {
namespace {

constexpr std::uint64_t without_limit = std::numeric_limits<std::uint64_t>::max();

// A file that holds one number; "max", or no such file: no limit.
std::uint64_t number_in(const std::string& path)
{
    std::ifstream file(path);
    std::uint64_t number = 0;
    return file >> number ? number : without_limit;
}

std::uint64_t installed(const std::string& root)
{
    std::ifstream file(root + "/proc/meminfo");
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string name;
        std::uint64_t kib = 0;
        if (words >> name >> kib && name == "MemTotal:") return kib * 1024;
    }
    return without_limit;
}

// The least limit of a group and those above it.
std::uint64_t of_groups(const std::string& mount, std::string group, const std::string& file)
{
    std::uint64_t least = number_in(mount + "/" + file);
    while (group.size() > 1) {
        least = std::min(least, number_in(mount + group + "/" + file));
        group.resize(group.find_last_of('/'));
    }
    return least;
}

// Lines of /proc/self/cgroup: "0::/group" (version 2), "9:memory:/group" (version 1).
std::uint64_t of_control_groups(const std::string& root)
{
    std::uint64_t least = without_limit;
    std::ifstream file(root + "/proc/self/cgroup");
    for (std::string line; std::getline(file, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",", group = line.substr(second + 1);
        if (controllers == ",,") least = std::min(least, of_groups(root + "/sys/fs/cgroup", group, "memory.max"));
        if (controllers.find(",memory,") != std::string::npos)
            least = std::min(least, of_groups(root + "/sys/fs/cgroup/memory", group, "memory.limit_in_bytes"));
    }
    return least;
}

} // namespace

std::uint64_t machine_memory(const std::string& root)
{
    rlimit data{};
    const std::uint64_t own = getrlimit(RLIMIT_DATA, &data) == 0 && data.rlim_cur != RLIM_INFINITY ? data.rlim_cur : without_limit;
    return std::min({installed(root), of_control_groups(root), own});
}

} // namespace penumbra::opencl
