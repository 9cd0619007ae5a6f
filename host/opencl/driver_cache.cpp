#include "opencl/driver_cache.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string_view>

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <penumbra/error.hpp>

#include "opencl/cache_folder.hpp"
#include "opencl/errors.hpp"
#include "opencl/quirks.hpp"

namespace penumbra::opencl {
namespace {

namespace fs = std::filesystem;

constexpr const char *list_name = "/.penumbra-kernels", *lock_name = "/.penumbra-lock";

// The letters of PoCL's hashes.
bool is_hash(std::string_view name, std::size_t length)
{
    return name.size() == length && std::ranges::all_of(name, [](char c) { return c >= 'A' && c <= 'P'; });
}

// What changes whenever the machine starts.
std::string boot_id()
{
    std::string id;
    std::ifstream("/proc/sys/kernel/random/boot_id") >> id;
    return id.empty() ? "unknown" : id;
}

// "PJ/EKPP..." of a path below it.
std::string program_of(const std::string& path)
{
    const std::size_t first = path.find('/');
    return first == std::string::npos ? path : path.substr(0, path.find('/', first + 1));
}

// Whether it is such a path: what is thrown away is never outside the folder, whatever a damaged list says.
bool is_in_program(const std::string& path)
{
    const std::string program = program_of(path);
    return program.size() > 3 && program.size() < path.size() && is_hash(program.substr(0, 2), 2) &&
           is_hash(program.substr(3), program.size() - 3);
}

// Files that PoCL writes again at any time, and never loads.
bool is_scratch(const std::string& path)
{
    return path.ends_with("/last_accessed") || path.ends_with("/build.log") || path.find(".temp") != std::string::npos;
}

// Waits for nobody who might not let go: what another process holds alone, it holds while it checks.
bool lock_alone(int file) { return flock(file, LOCK_EX | LOCK_NB) == 0; }

int open_lock(const std::string& path)
{
    const auto open_it = [&] { return open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600); };
    int file = open_it();
    if (file < 0) {
        std::error_code ignored;
        fs::remove_all(path, ignored); // something else of that name
        file = open_it();
    }
    return file;
}

} // namespace

// One thing in the folder that is not a folder itself.
struct DriverCache::Found {
    std::string path; // below the folder
    struct stat status = {};
    bool regular() const { return S_ISREG(status.st_mode); }
};

namespace {

// What lies below an open folder, which this closes. Links are not followed.
template <class Take> void walk_below(int folder, const std::string& prefix, int depth, const Take& take)
{
    DIR* entries = folder < 0 ? nullptr : fdopendir(folder);
    if (!entries) {
        if (folder >= 0) close(folder);
        return;
    }
    while (const dirent* entry = readdir(entries)) {
        const std::string_view name = entry->d_name;
        if (name == "." || name == ".." || (depth == 0 && !is_hash(name, 2))) continue;
        const std::string path = prefix + std::string(name);
        struct stat status = {};
        if (fstatat(dirfd(entries), entry->d_name, &status, AT_SYMLINK_NOFOLLOW) != 0) continue; // gone meanwhile
        // No folder of PoCL's has a file's name: one that has stands in the way of the file, even an empty one.
        const bool in_the_way = name.find('.') != std::string_view::npos || name == "last_accessed";
        if (S_ISDIR(status.st_mode) && depth < 6 && !in_the_way)
            walk_below(openat(dirfd(entries), entry->d_name, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW), path + '/', depth + 1, take);
        else
            take(path, status);
    }
    closedir(entries);
}

} // namespace

std::vector<DriverCache::Found> DriverCache::walk() const
{
    std::vector<Found> all;
    walk_below(open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC), "", 0, [&](const std::string& path, const struct stat& status) {
        all.push_back({path, status});
    });
    return all;
}

DriverCache::DriverCache(std::string folder, bool ours) : folder_(std::move(folder))
{
    timespec now = {};
    clock_gettime(CLOCK_REALTIME_COARSE, &now);
    opened_ns_ = nanoseconds(now);
    if (ours) lock_ = open_lock(folder_ + lock_name);
    try {
        // Alone, everything must be in the list. With others at work, what is not yet there may be theirs.
        if (lock_ >= 0 && lock_alone(lock_)) {
            check(true);
            flock(lock_, LOCK_SH);
        } else {
            if (lock_ >= 0) flock(lock_, LOCK_SH);
            check(false);
        }
    } catch (...) {
        if (lock_ >= 0) close(lock_);
        throw;
    }
}

DriverCache::~DriverCache()
{
    if (lock_ >= 0) close(lock_);
}

// Lines: "boot ID", "HASH BYTES MODIFIED CHANGED PATH", "- PROGRAM" (thrown away). The last word on a path counts. A line that makes no
// sense is left out: what it was about is then unknown, and built again.
void DriverCache::read_list()
{
    std::istringstream text(content_of(folder_ + list_name).value_or(""));
    for (std::string line; std::getline(text, line); ++lines_) {
        if (line.starts_with("boot ")) {
            boot_ = line.substr(5);
        } else if (line.starts_with("- ")) {
            std::erase_if(list_, [program = line.substr(2)](const auto& known) { return program_of(known.first) == program; });
        } else if (const auto file = file_of_line(line); file && is_in_program(file->first)) {
            list_.insert_or_assign(file->first, file->second);
        }
    }
}

// Whether a file is the one that the list knows. One with other times is read, and if it has the same content the list is told.
bool DriverCache::fits(const Found& found, std::vector<std::string>& news)
{
    CachedFile& known = list_.at(found.path);
    const std::int64_t modified = nanoseconds(found.status.st_mtim), changed = nanoseconds(found.status.st_ctim);
    if (!found.regular() || static_cast<std::uint64_t>(found.status.st_size) != known.bytes) return false;
    const bool same_times = modified == known.modified_ns && changed == known.changed_ns;
    if (same_times && boot_ == boot_id()) return true;
    const auto bytes = content_of(folder_ + '/' + found.path);
    if (!bytes || hash_of(*bytes) != known.hash) return false;
    if (!same_times) {
        known.modified_ns = modified;
        known.changed_ns = changed;
        news.push_back(line_of(found.path, known));
    }
    return true;
}

void DriverCache::check(bool strict)
{
    read_list();
    std::set<std::string> damaged, seen;
    std::vector<std::string> news;
    for (const Found& found : walk()) {
        seen.insert(found.path);
        bool sound = found.regular();
        if (list_.contains(found.path))
            sound = fits(found, news);
        else if (!is_scratch(found.path))
            sound = sound && !strict && looks_sound(folder_ + '/' + found.path);
        if (!sound) damaged.insert(program_of(found.path));
    }

    // A library that is gone is built again; a program whose file is gone, or a folder in a file's place, PoCL does not get over. Others
    // may have thrown it away.
    for (const auto& [path, file] : list_) {
        struct stat status = {};
        if (!seen.contains(path) && (strict || lstat((folder_ + '/' + path).c_str(), &status) == 0)) damaged.insert(program_of(path));
    }
    throw_away(damaged);

    const std::string boot = boot_id();
    if (boot != boot_) news.push_back("boot " + boot);
    boot_ = boot;
    if (!strict) {
        for (const std::string& program : damaged) news.push_back("- " + program);
        append(news);
        return;
    }
    if (!damaged.empty() || lines_ > 2 * list_.size() + 64)
        write_list();
    else
        append(news);

    // What processes that died left behind.
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_, ignored)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("tempfile_") || name.starts_with("tempdir_") || name.starts_with(".penumbra-new-"))
            fs::remove_all(entry.path(), ignored);
    }
}

void DriverCache::throw_away(const std::set<std::string>& damaged)
{
    for (const std::string& program : damaged) {
        const std::string path = folder_ + '/' + program;
        std::error_code why;
        fs::remove_all(path, why);
        if (struct stat status = {}; lstat(path.c_str(), &status) == 0)
            throw Error(ErrorCode::device, path + ": is a damaged kernel and cannot be removed (" + why.message() + ")",
                        "remove it, or name another folder in PENUMBRA_CACHE_DIR");
        std::erase_if(list_, [&](const auto& known) { return program_of(known.first) == program; });
        ++thrown_away_;
    }
}

// The list anew. Where it cannot be written the old one stays, and what it does not know is built again next time.
void DriverCache::write_list() const
{
    std::string temporary = folder_ + "/.penumbra-new-XXXXXX";
    const int file = mkstemp(temporary.data());
    if (file < 0) return;
    std::string text = "boot " + boot_ + '\n';
    for (const auto& [path, known] : list_) text += line_of(path, known) + '\n';
    const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    close(file);
    std::error_code ignored;
    fs::remove_all(folder_ + list_name, ignored); // if it is a folder, nothing can be renamed to it
    if (!written || std::rename(temporary.c_str(), (folder_ + list_name).c_str()) != 0) unlink(temporary.c_str());
}

// In one write, so that the lines of several processes do not mix.
void DriverCache::append(const std::vector<std::string>& lines) const
{
    if (lines.empty()) return;
    std::string text;
    for (const std::string& line : lines) text += line + '\n';
    const std::string path = folder_ + list_name;
    int file = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (file < 0) {
        std::error_code ignored;
        fs::remove_all(path, ignored);
        file = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0600);
    }
    if (file < 0) return;
    // A list that cannot be written costs a build, not the mask.
    [[maybe_unused]] const ssize_t ignored = write(file, text.data(), text.size());
    close(file);
}

void DriverCache::record()
{
    const std::lock_guard lock(mutex_);
    std::vector<std::string> news;
    for (const Found& found : walk()) {
        // What the list knows stays as it is there: a change is damage, for the next process to find.
        if (!found.regular() || is_scratch(found.path) || list_.contains(found.path)) continue;
        const auto bytes = content_of(folder_ + '/' + found.path);
        if (!bytes) continue;
        const CachedFile file = cached_file(*bytes, found.status);
        list_[found.path] = file;
        news.push_back(line_of(found.path, file));
    }
    append(news);
}

void DriverCache::require_room() const
{
    if (const std::string wrong = lacks_room(folder_); !wrong.empty())
        throw Error(ErrorCode::device, folder_ + ": kernels cannot be built there: it " + wrong,
                    "make room, or name another folder in PENUMBRA_CACHE_DIR");
}

void DriverCache::require_library(const std::string& kernel, const std::array<std::size_t, 2>& global,
                                  const std::array<std::size_t, 2>& local) const
{
    // The widest grid of PoCL's "small" ones.
    constexpr std::size_t small = 65535;
    std::string shape = std::to_string(local[0]) + '-' + std::to_string(local[1]) + "-1-goffs0";
    if (global[0] < small && global[1] < small) shape += "-smallgrid";
    if (has_library(kernel, shape)) return;
    const char* path = std::getenv("PATH");
    throw Error(ErrorCode::device,
                std::string("the linker ld is not on PATH (") + (path ? path : "not set") + "), and PoCL needs it to build the kernel " +
                    kernel,
                "expected ld of the package binutils, in /usr/bin as a rule");
}

// Whether a program that was looked up since this process began has that kernel linked: PoCL touches last_accessed whenever it builds one.
bool DriverCache::has_library(const std::string& kernel, const std::string& shape) const
{
    constexpr std::int64_t clock_tick_ns = 20'000'000;
    const std::vector<Found> all = walk();
    std::set<std::string> programs;
    for (const Found& found : all)
        if (found.path.ends_with("/last_accessed") && nanoseconds(found.status.st_mtim) >= opened_ns_ - clock_tick_ns)
            programs.insert(program_of(found.path));
    return std::ranges::any_of(all, [&](const Found& found) {
        const std::string program = program_of(found.path);
        return programs.contains(program) && found.path == program + '/' + kernel + '/' + shape + '/' + kernel + ".so";
    });
}

DriverCache& driver_cache()
{
    static std::mutex mutex;
    static std::unique_ptr<DriverCache> cache;
    const std::lock_guard lock(mutex);
    // One that could not be opened is tried again: somebody may have removed what was in the way.
    if (!cache) {
        const DriverFolder& folder = driver_folder();
        cache = std::make_unique<DriverCache>(folder.path, folder.ours);
    }
    return *cache;
}

RecordingIfSlow::~RecordingIfSlow()
{
    // PoCL runs a linker for each kernel; one from the folder is loaded in a fraction of that.
    if (std::chrono::steady_clock::now() - start_ < std::chrono::milliseconds(3)) return;
    try {
        driver_cache().record();
    } catch (const std::exception&) {
        // What is not recorded is built again.
    }
}

} // namespace penumbra::opencl
