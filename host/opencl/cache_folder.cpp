#include "opencl/cache_folder.hpp"

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "opencl/errors.hpp"

namespace penumbra::opencl {
namespace {

std::string variable(const char* name)
{
    const char* value = std::getenv(name);
    return value ? value : "";
}

// mkdir -p, each new folder 0700. "" when it is there, else why not.
std::string make_folders(const std::string& path)
{
    if (path.empty()) return "has no name";
    for (std::size_t slash = path.find('/', 1);; slash = path.find('/', slash + 1)) {
        const std::string part = path.substr(0, slash);
        if (mkdir(part.c_str(), 0700) != 0) {
            // A parent on a read-only file system or of another user's may still hold the rest.
            const std::string why = std::strerror(errno);
            struct stat status = {};
            if (stat(part.c_str(), &status) != 0) return "cannot be made (" + why + ")";
            if (!S_ISDIR(status.st_mode)) return part == path ? "is not a folder" : "cannot be made (" + part + " is not a folder)";
        }
        if (slash == std::string::npos) return {};
    }
}

// access() sees read-only file systems too; noexec ones it does not.
std::string not_for_code(const std::string& path)
{
    if (access(path.c_str(), R_OK | W_OK | X_OK) != 0) return std::string("cannot be written to (") + std::strerror(errno) + ")";
    struct statvfs file_system = {};
    if (statvfs(path.c_str(), &file_system) != 0) return std::string("cannot be looked at (") + std::strerror(errno) + ")";
    if ((file_system.f_flag & ST_NOEXEC) != 0) return "is on a file system mounted noexec, and kernels are loaded as code";
    return lacks_room(path);
}

} // namespace

std::string cache_folder()
{
    if (std::string own = variable("PENUMBRA_CACHE_DIR"); !own.empty()) return own;
    if (const std::string xdg = variable("XDG_CACHE_HOME"); !xdg.empty()) return xdg + "/penumbra";
    if (const std::string home = variable("HOME"); !home.empty()) return home + "/.cache/penumbra";
    return {};
}

bool make_private_folder(const std::string& path) { return unusable_private(path).empty(); }

std::string unusable_private(const std::string& path)
{
    if (std::string why = make_folders(path); !why.empty()) return why;

    // lstat: a link that somebody else planted is not followed.
    struct stat status = {};
    if (lstat(path.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) return "is a link, expected a folder";
    if (status.st_uid != geteuid()) return "belongs to another user";
    if ((status.st_mode & (S_IWGRP | S_IWOTH)) != 0) return "can be written to by other users, expected mode 0700";
    return not_for_code(path);
}

std::string unusable(const std::string& path)
{
    std::string why = make_folders(path);
    return why.empty() ? not_for_code(path) : why;
}

std::string lacks_room(const std::string& path)
{
    // A program's source, what the preprocessor makes of it and a library: a tenth of that.
    constexpr std::uint64_t least = 4 << 20;
    struct statvfs file_system = {};
    if (statvfs(path.c_str(), &file_system) != 0 || file_system.f_blocks == 0) return {}; // without sizes
    const std::uint64_t room = std::uint64_t{file_system.f_bavail} * file_system.f_frsize;
    return room >= least ? std::string() : "has " + bytes_text(room) + " free, expected at least " + bytes_text(least);
}

} // namespace penumbra::opencl
