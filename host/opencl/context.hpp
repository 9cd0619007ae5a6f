// One OpenCL device with its context and its built programs. Shared by everything that computes on it; safe from several threads.
#pragma once

#define CL_HPP_ENABLE_EXCEPTIONS
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#include <CL/opencl.hpp>

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include <penumbra/engine.hpp>

#include "opencl/quirks.hpp"
#include "opencl/specialisation.hpp"

namespace penumbra::opencl {

class ProgramCache;
class Ledger;

class Context {
public:
    // `selector`: an index or a part of a device's name; empty: PENUMBRA_DEVICE, else the first device. Throws Error(device).
    static std::shared_ptr<Context> open(const std::string& selector);
    static std::shared_ptr<Context> wrap(cl_context context, cl_device_id device);
    ~Context();

    const cl::Context& context() const { return context_; }
    const cl::Device& device() const { return device_; }
    const DeviceInfo& info() const { return info_; }
    const Quirks& quirks() const { return quirks_; }
    Quirks& quirks() { return quirks_; } // tests run the kernels of other devices on this one

    // A queue of its own for one piece of work: in order, profiling on.
    cl::CommandQueue queue() const;

    // A kernel object for the caller alone (clSetKernelArg is not thread-safe). Builds its program on first use; time spent building is
    // added to `compile_ms`. A build failure is Error(device) with the build log's first error line.
    cl::Kernel kernel(const Specialisation& specialisation, const char* name, double& compile_ms) const;

    // True the first time for a kernel's program, name and work-group shape: drivers finish compiling at that launch.
    bool first_launch(const cl::Kernel& kernel, const std::string& name, const std::array<std::size_t, 2>& local) const;

    // What lives on the device by this context's doing.
    const std::shared_ptr<Ledger>& ledger() const { return ledger_; }

    // Tests turn this on: every buffer gets a guard tail, checked when the buffer is read or dropped.
    bool canaries = false;

    // Something was launched that the driver may have compiled while nobody waited for it (driver_cache.hpp).
    mutable std::atomic<bool> unrecorded = false;

private:
    Context(cl::Context context, cl::Device device, DeviceInfo info);
    cl::Context context_;
    cl::Device device_;
    DeviceInfo info_;
    Quirks quirks_;
    std::unique_ptr<ProgramCache> programs_;
    std::shared_ptr<Ledger> ledger_;
    mutable std::mutex launched_mutex_;
    mutable std::set<std::string> launched_;
};

// A device that is opened when something first needs it. Safe from several threads.
class LateContext {
public:
    explicit LateContext(std::string selector) : selector_(std::move(selector)) {}
    explicit LateContext(std::shared_ptr<const Context> context) : context_(std::move(context)) {}

    // Throws what Context::open throws; the next call tries again.
    std::shared_ptr<const Context> get() const;

private:
    std::string selector_;
    mutable std::mutex opening_;
    mutable std::shared_ptr<const Context> context_;
};

} // namespace penumbra::opencl
