// The folder in which PoCL keeps compiled kernels, kept sound. PoCL takes what lies there without a look: a shortened library kills the
// process (SIGBUS), an emptied program fails for ever.
//
// Beside PoCL's files stands a list of them, `.penumbra-kernels`, written when they are: size, times and a hash of each. What does not fit
// it when a process starts is thrown away, a whole program at a time, and PoCL builds it anew. The times are enough while the machine runs;
// after a restart, which may have lost what was not yet on the disk, everything is read again.
//
// Layout of PoCL 3.1, [A-P] being the letters of a hash in base 16:
//     <folder>/[A-P]{2}/[A-P]{37}/program.bc, last_accessed, build.log
//                                /<kernel>/<local size>-goffs0[-smallgrid]/<kernel>.so
//     <folder>/tempfile_*           what is being made; renamed when it is whole
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "opencl/cached_file.hpp"

namespace penumbra::opencl {

// Safe from several threads, and with several processes in one folder.
class DriverCache {
public:
    // Checks the folder and throws away what is damaged. `ours`: nobody but this library writes there, so that what is not in the list, and
    // nobody is writing now, was left by a process that died. Throws Error(device) naming what is damaged and cannot be thrown away.
    DriverCache(std::string folder, bool ours);
    ~DriverCache();
    DriverCache(const DriverCache&) = delete;
    DriverCache& operator=(const DriverCache&) = delete;

    const std::string& folder() const { return folder_; }

    // What the driver wrote since goes into the list.
    void record();

    // Throws Error(device) when the disk is full, before a build or a first launch: PoCL would end the process.
    void require_room() const;
    // Throws Error(device) unless the kernel is there for such work-groups (`global` in work-items), of a program that was built since the
    // process began: to be asked where there is no linker, for PoCL would end the process.
    void require_library(const std::string& kernel, const std::array<std::size_t, 2>& global,
                         const std::array<std::size_t, 2>& local) const;

    // How many programs were thrown away.
    int thrown_away() const { return thrown_away_; }

private:
    struct Found;
    std::vector<Found> walk() const;
    void read_list();
    void check(bool strict);
    bool fits(const Found& found, std::vector<std::string>& news);
    void throw_away(const std::set<std::string>& damaged);
    void write_list() const;
    void append(const std::vector<std::string>& lines) const;
    bool has_library(const std::string& kernel, const std::string& shape) const;

    std::string folder_;
    int lock_ = -1; // held, shared, as long as the process may use the folder
    std::int64_t opened_ns_ = 0;
    std::map<std::string, CachedFile> list_; // by path below the folder
    std::string boot_;                       // in which the list was last checked
    std::size_t lines_ = 0;                  // of the list's file
    int thrown_away_ = 0;
    std::mutex mutex_;
};

// The one of this process, in the folder that prepare_environment chose; checked at the first call, which goes before the first OpenCL
// call.
DriverCache& driver_cache();

// Around a first launch: if it took as long as compiling takes, the driver has written something, which is recorded at the end.
class RecordingIfSlow {
public:
    RecordingIfSlow() = default;
    ~RecordingIfSlow();
    RecordingIfSlow(const RecordingIfSlow&) = delete;
    RecordingIfSlow& operator=(const RecordingIfSlow&) = delete;

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

} // namespace penumbra::opencl
