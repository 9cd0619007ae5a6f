#include "opencl/context.hpp"

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <utility>

#include "opencl/cache_folder.hpp"
#include "opencl/devices.hpp"
#include "opencl/driver_cache.hpp"
#include "opencl/errors.hpp"
#include "opencl/ledger.hpp"
#include "opencl/program_cache.hpp"

namespace penumbra::opencl {

std::shared_ptr<Context> Context::open(const std::string& selector)
{
    std::string chosen = selector;
    if (chosen.empty()) {
        if (const char* variable = std::getenv("PENUMBRA_DEVICE")) chosen = variable;
    }
    FoundDevice found = choose_device(chosen);
    return translated("device " + found.info.name, [&] {
        if (!found.device.getInfo<CL_DEVICE_AVAILABLE>() || !found.device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>()) {
            throw Error(ErrorCode::device, "device " + found.info.name + " is not available, or has no compiler");
        }
        return std::shared_ptr<Context>(new Context(cl::Context(found.device), found.device, std::move(found.info)));
    });
}

std::shared_ptr<Context> Context::wrap(cl_context context, cl_device_id device)
{
    if (!context || !device) throw Error(ErrorCode::usage, "an OpenCL context and a device of it are needed; one of them is null");
    return translated("the caller's OpenCL context", [&] {
        cl::Context wrapped(context, true);
        const auto devices = wrapped.getInfo<CL_CONTEXT_DEVICES>();
        if (std::none_of(devices.begin(), devices.end(), [device](const cl::Device& one) { return one() == device; })) {
            throw Error(ErrorCode::usage, "the OpenCL device is not one of the context's " + std::to_string(devices.size()));
        }

        // A part of a device is in no list: -1.
        const cl::Device chosen(device, true);
        const std::vector<FoundDevice> found = find_devices();
        const auto at = std::find_if(found.begin(), found.end(), [device](const FoundDevice& one) { return one.device() == device; });
        DeviceInfo info = describe(chosen, at == found.end() ? -1 : at->info.index);
        return std::shared_ptr<Context>(new Context(std::move(wrapped), chosen, std::move(info)));
    });
}

Context::Context(cl::Context context, cl::Device device, DeviceInfo info)
    : context_(std::move(context)), device_(std::move(device)), info_(std::move(info)), quirks_(quirks_of(device_)),
      ledger_(std::make_shared<Ledger>())
{
    const std::string folder = cache_folder();
    programs_ = std::make_unique<ProgramCache>(context_, device_, quirks_.keep_binaries && !folder.empty() ? folder + "/programs" : "");
}

Context::~Context()
{
    // Launches on a caller's queue are not waited for: what they made is recorded here.
    if (!unrecorded) return;
    try {
        driver_cache().record();
    } catch (const std::exception&) {
        // What is not recorded is built again.
    }
}

std::shared_ptr<const Context> LateContext::get() const
{
    const std::lock_guard lock(opening_);
    if (!context_) context_ = Context::open(selector_);
    return context_;
}

cl::CommandQueue Context::queue() const
{
    return translated("device " + info_.name, [&] { return cl::CommandQueue(context_, device_, CL_QUEUE_PROFILING_ENABLE); });
}

cl::Kernel Context::kernel(const Specialisation& specialisation, const char* name, double& compile_ms) const
{
    const cl::Program program = programs_->program(specialisation, compile_ms);
    try {
        return cl::Kernel(program, name);
    } catch (const cl::Error& error) {
        // A name that the file does not have is our mistake.
        const Error told = device_error(error, specialisation.file + ", kernel " + name);
        throw error.err() == CL_INVALID_KERNEL_NAME ? Error(ErrorCode::internal, told.message()) : told;
    }
}

bool Context::first_launch(const cl::Kernel& kernel, const std::string& name, const std::array<std::size_t, 2>& local) const
{
    // The cache keeps programs as long as this context lives, so that their addresses tell them apart.
    const auto program = reinterpret_cast<std::uintptr_t>(kernel.getInfo<CL_KERNEL_PROGRAM>()());
    const std::string id = std::to_string(program) + ' ' + name + ' ' + std::to_string(local[0]) + 'x' + std::to_string(local[1]);
    const std::lock_guard lock(launched_mutex_);
    return launched_.insert(id).second;
}

} // namespace penumbra::opencl
