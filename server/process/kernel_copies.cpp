#include "process/kernel_copies.hpp"

#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include <sys/statvfs.h>

namespace penumbra::server {
namespace {

namespace fs = std::filesystem;

constexpr const char *list_name = ".penumbra-kernels", *used_name = "last_accessed";

// The list's lines on those programs: "HASH BYTES MODIFIED CHANGED PATH". Without the others nothing is missed; without "boot ID" all is read.
void copy_list(const fs::path& from, const std::set<std::string>& programs, const fs::path& to)
{
    std::ifstream in(from);
    std::ofstream out(to);
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string number, path;
        for (int i = 0; i < 4; ++i) words >> number;
        if (!(words >> path)) continue;
        const std::size_t program = path.find('/', path.find('/') + 1);
        if (programs.contains(path.substr(0, program))) out << line << '\n';
    }
}

void copy_pocl(const fs::path& from, fs::file_time_type used_since, const fs::path& to)
{
    std::set<std::string> programs;
    for (const fs::directory_entry& group : fs::directory_iterator(from)) {
        if (!group.is_directory()) continue;
        for (const fs::directory_entry& program : fs::directory_iterator(group.path())) {
            std::error_code none;
            const fs::file_time_type used = fs::last_write_time(program.path() / used_name, none);
            if (none || used < used_since) continue;
            const fs::path name = program.path().lexically_relative(from);
            fs::create_directories(to / name.parent_path());
            fs::copy(program.path(), to / name, fs::copy_options::recursive | fs::copy_options::skip_symlinks);
            programs.insert(name.string());
        }
    }
    copy_list(from / list_name, programs, to / list_name);
}

} // namespace

KernelFolders folders_in(const fs::path& cache) { return {cache / "kernels", cache / "programs"}; }

KernelFolders shared_folders(const fs::path& kernels)
{
    for (const auto& [name, below] : {std::pair("PENUMBRA_CACHE_DIR", "programs"), {"XDG_CACHE_HOME", "penumbra/programs"}, {"HOME", ".cache/penumbra/programs"}})
        if (const char* const folder = std::getenv(name); folder && *folder) return {kernels, fs::path(folder) / below};
    return {kernels, {}};
}

void copy_kernels(const KernelFolders& from, fs::file_time_type used_since, const KernelFolders& to)
{
    // For this user alone: what lies there is loaded as code.
    for (const fs::path& folder : {to.kernels.parent_path(), to.kernels, to.programs}) {
        fs::create_directory(folder);
        fs::permissions(folder, fs::perms::owner_all);
    }
    if (!from.kernels.empty() && fs::is_directory(from.kernels)) copy_pocl(from.kernels, used_since, to.kernels);
    if (!from.programs.empty() && fs::is_directory(from.programs))
        fs::copy(from.programs, to.programs, fs::copy_options::recursive | fs::copy_options::skip_symlinks);
}

bool may_hold_code(const fs::path& folder)
{
    struct statvfs system {};
    return statvfs(folder.c_str(), &system) == 0 && (system.f_flag & ST_NOEXEC) == 0;
}

} // namespace penumbra::server
