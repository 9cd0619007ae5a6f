#include "opencl/cache_folder.hpp"

#include <cerrno>
#include <cstdlib>

#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

namespace penumbra::opencl {
namespace {

std::string variable(const char* name)
{
    const char* value = std::getenv(name);
    return value ? value : "";
}

// mkdir -p, each new folder 0700.
bool make_folders(const std::string& path)
{
    if (path.empty()) return false;
    for (std::size_t slash = path.find('/', 1);; slash = path.find('/', slash + 1)) {
        const std::string part = path.substr(0, slash);
        if (mkdir(part.c_str(), 0700) != 0 && errno != EEXIST) {
            // A parent on a read-only file system or of another user's may still hold the rest.
            struct stat status = {};
            if (stat(part.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) return false;
        }
        if (slash == std::string::npos) return true;
    }
}

} // namespace

std::string cache_folder()
{
    if (const std::string own = variable("PENUMBRA_CACHE_DIR"); !own.empty()) return own;
    if (const std::string xdg = variable("XDG_CACHE_HOME"); !xdg.empty()) return xdg + "/penumbra";
    if (const std::string home = variable("HOME"); !home.empty()) return home + "/.cache/penumbra";
    return {};
}

bool make_private_folder(const std::string& path)
{
    if (!make_folders(path)) return false;

    // lstat: a link that somebody else planted is not followed.
    struct stat status = {};
    if (lstat(path.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) return false;
    if (status.st_uid != geteuid() || (status.st_mode & (S_IWGRP | S_IWOTH)) != 0) return false;

    // access() sees read-only file systems too; noexec ones it does not.
    if (access(path.c_str(), R_OK | W_OK | X_OK) != 0) return false;
    struct statvfs file_system = {};
    return statvfs(path.c_str(), &file_system) == 0 && (file_system.f_flag & ST_NOEXEC) == 0;
}

} // namespace penumbra::opencl
