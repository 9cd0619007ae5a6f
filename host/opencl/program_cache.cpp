#include "opencl/program_cache.hpp"

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "opencl/cache_folder.hpp"
#include "opencl/driver_cache.hpp"
#include "opencl/errors.hpp"
#include "opencl/kernel_files.hpp"
#include "opencl/program_text.hpp"
#include "scene/stop.hpp"

namespace penumbra::opencl {
namespace {

// Nothing that lets a compiler assume finite numbers or approximate: depth holds infinities, and results are compared bit by bit.
// No warnings: on processors without AVX-512 clang warns of each float16 that a function takes, as its way in differs from that of other
// programs, and PoCL prints their number on standard error. What is worth a warning stops the project's own build.
constexpr const char* build_options = "-cl-std=CL1.2 -w";

// With the built-in functions declared by us (quirks.hpp): opencl-c.h has been read, it is told.
constexpr const char* without_header = "-cl-std=CL1.2 -w -D_OPENCL_H_";

// For the test that every program anybody asks for is among those that the build compiles: a line for each goes to the file that
// PENUMBRA_PROGRAM_LOG names. One write a line, so that many processes may share the file.
void note_program(const std::string& id)
{
    const char* const path = std::getenv("PENUMBRA_PROGRAM_LOG");
    if (!path) return;
    if (std::ofstream log(path, std::ios::app); log) log << id + '\n' << std::flush;
}

// The first line that tells of an error, or the first line at all.
std::string first_error_line(const std::string& log)
{
    std::string first;
    for (std::size_t begin = 0; begin < log.size();) {
        const std::size_t end = std::min(log.find('\n', begin), log.size());
        std::string line = log.substr(begin, end - begin);
        if (line.find("error") != std::string::npos) return line;
        if (first.empty()) first = line;
        begin = end + 1;
    }
    return first.empty() ? "the build log is empty" : first;
}

} // namespace

ProgramCache::ProgramCache(cl::Context context, cl::Device device, const std::string& folder)
    : context_(std::move(context)), device_(std::move(device))
{
    const cl::Platform platform(device_.getInfo<CL_DEVICE_PLATFORM>());
    for (const std::string& part : {device_.getInfo<CL_DEVICE_NAME>(), device_.getInfo<CL_DRIVER_VERSION>(),
                                    device_.getInfo<CL_DEVICE_VERSION>(), platform.getInfo<CL_PLATFORM_VERSION>()}) {
        device_id_ += part + '\n';
    }
    const Quirks quirks = quirks_of(device_);
    driver_keeps_ = quirks.driver_cache;
    builtins_ = quirks.builtins;
    if (!folder.empty() && make_private_folder(folder)) folder_ = folder;
}

cl::Program ProgramCache::program(const Specialisation& specialisation, double& compile_ms)
{
    // The embedded files do not change while the process runs, so names and values say it all.
    const std::string id = specialisation.file + ' ' + specialisation.options();
    return find_or_build(
        id, specialisation.file,
        [&] {
            note_program(id);
            return program_text(specialisation);
        },
        compile_ms);
}

cl::Program ProgramCache::program(const std::string& name, const std::string& text, double& compile_ms)
{
    return find_or_build(
        '\n' + text, name, [&] { return text; }, compile_ms);
}

template <class MakeText>
cl::Program ProgramCache::find_or_build(const std::string& id, const std::string& name, MakeText&& make_text, double& compile_ms)
{
    // The first thread to ask leaves a promise; the others wait for it outside the lock.
    std::promise<cl::Program> promise;
    std::shared_future<cl::Program> future;
    bool ours = false;
    {
        const std::lock_guard lock(mutex_);
        const auto [at, added] = programs_.try_emplace(id);
        if (added) at->second = promise.get_future().share();
        future = at->second;
        ours = added;
    }

    using Clock = std::chrono::steady_clock;
    const Clock::time_point start = Clock::now();
    if (!ours) {
        if (future.wait_for(std::chrono::seconds(0)) == std::future_status::ready) return future.get();
        future.wait();
    } else {
        try {
            promise.set_value(build(name, make_text()));
        } catch (...) {
            {
                const std::lock_guard lock(mutex_);
                programs_.erase(id);
            }
            promise.set_exception(std::current_exception());
        }
    }
    compile_ms += std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    return future.get();
}

cl::Program ProgramCache::build(const std::string& name, const std::string& text)
{
    const ProgramKey key = program_key({text, build_options, device_id_, std::to_string(program_file_format)});
    if (!folder_.empty()) {
        if (cl::Program program = load(key); program()) {
            ++loaded_from_disk_;
            return program;
        }
    }
    cl::Program program = build_from_source(name, text);
    ++built_from_source_;
    if (!folder_.empty()) store(key, program);
    return program;
}

cl::Program ProgramCache::build_from_source(const std::string& name, const std::string& text)
{
    if (driver_keeps_) driver_cache().require_room();
    const Deaf compiling(current_stop());
    if (!builtins_.empty()) {
        // Of a caller's own program, which may use what is not declared there: then the driver's header is read.
        cl::Program program = translated(name, [&] { return cl::Program(context_, std::string(kernel_file(builtins_)).append(text)); });
        try {
            program.build(device_, without_header);
            return program;
        } catch (const cl::Error&) {
            ++built_with_header_;
        }
    }
    cl::Program program = translated(name, [&] { return cl::Program(context_, text); });
    try {
        program.build(device_, build_options);
    } catch (const cl::Error& error) {
        std::string log;
        try {
            log = program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device_);
        } catch (const cl::Error&) {
            // The build's own error says more than this one.
        }
        throw Error(ErrorCode::device, device_error(error, name).message() + ": " + first_error_line(log));
    }
    return program;
}

cl::Program ProgramCache::load(const ProgramKey& key) const
{
    const auto binary = read_program_file(folder_, key);
    if (!binary) return {};
    try {
        cl::Program program(context_, {device_}, cl::Program::Binaries{*binary});
        program.build(device_, build_options);
        return program;
    } catch (const cl::Error&) {
        return {}; // of another processor or driver build: the source is compiled instead, and the file replaced
    }
}

void ProgramCache::store(const ProgramKey& key, const cl::Program& program) const
{
    try {
        // A caller's context may have further devices, for which nothing was built.
        const auto devices = program.getInfo<CL_PROGRAM_DEVICES>();
        const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
        for (std::size_t i = 0; i < devices.size() && i < binaries.size(); ++i) {
            if (devices[i]() == device_() && !binaries[i].empty()) write_program_file(folder_, key, binaries[i]);
        }
    } catch (const cl::Error&) {
        // A driver without binaries; the program itself is good.
    }
}

} // namespace penumbra::opencl
