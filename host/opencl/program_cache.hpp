// Built programs of one device: in memory, and as binaries on disk.
#pragma once

#include <atomic>
#include <future>
#include <map>
#include <mutex>
#include <string>

#include "opencl/program_file.hpp"
#include "opencl/quirks.hpp"
#include "opencl/specialisation.hpp"

namespace penumbra::opencl {

// Safe from several threads; two that need the same program build it once.
class ProgramCache {
public:
    // `folder`: where binaries are kept; empty: nowhere. One that cannot be used is left alone, and nothing is kept.
    ProgramCache(cl::Context context, cl::Device device, const std::string& folder);

    // The built program. Time spent building, or waiting for another thread that builds it, is added to `compile_ms`. A build failure is
    // Error(device) with the build log's first error line; the next call tries again.
    cl::Program program(const Specialisation& specialisation, double& compile_ms);

    // The same for a text of its own; `name` is for messages.
    cl::Program program(const std::string& name, const std::string& text, double& compile_ms);

    // What this object did so far.
    int built_from_source() const { return built_from_source_; }
    int loaded_from_disk() const { return loaded_from_disk_; }
    // Those that had to read the driver's own header although quirks.hpp has one that is shorter.
    int built_with_header() const { return built_with_header_; }

private:
    template <class MakeText>
    cl::Program find_or_build(const std::string& id, const std::string& name, MakeText&& make_text, double& compile_ms);
    cl::Program build(const std::string& name, const std::string& text);
    cl::Program build_from_source(const std::string& name, const std::string& text);
    // A null program when there is no binary, or the driver does not take it.
    cl::Program load(const ProgramKey& key) const;
    void store(const ProgramKey& key, const cl::Program& program) const;

    cl::Context context_;
    cl::Device device_;
    std::string folder_;
    bool driver_keeps_ = false; // Quirks::driver_cache
    std::string builtins_;      // Quirks::builtins
    std::string device_id_; // name, driver and platform versions
    std::atomic<int> built_from_source_ = 0, loaded_from_disk_ = 0, built_with_header_ = 0;

    std::mutex mutex_;
    std::map<std::string, std::shared_future<cl::Program>> programs_; // by id: specialisation, or text
};

} // namespace penumbra::opencl
