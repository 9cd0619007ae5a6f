#include "opencl/devices.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

#include "opencl/driver_cache.hpp"
#include "opencl/errors.hpp"
#include "opencl/machine_memory.hpp"
#include "scene/joined.hpp"

namespace penumbra::opencl {
namespace {

// Drivers pad names with blanks and zeros.
std::string trimmed(const std::string& text)
{
    const auto keep = [](unsigned char c) { return c != 0 && !std::isspace(c); };
    const auto first = std::find_if(text.begin(), text.end(), keep);
    const auto last = std::find_if(text.rbegin(), std::make_reverse_iterator(first), keep).base();
    return std::string(first, last);
}

std::string lower(std::string text)
{
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

std::string type_name(cl_device_type type)
{
    if (type & CL_DEVICE_TYPE_CPU) return "CPU";
    if (type & CL_DEVICE_TYPE_GPU) return "GPU";
    if (type & CL_DEVICE_TYPE_ACCELERATOR) return "accelerator";
    return "other";
}

// "0: pthread-skylake-avx512, 1: NVIDIA H200"
std::string listing(const std::vector<FoundDevice>& devices)
{
    return joined(devices, [](const FoundDevice& found) { return std::to_string(found.info.index) + ": " + found.info.name; });
}

const FoundDevice* find(const std::vector<FoundDevice>& devices, const std::string& selector)
{
    if (std::all_of(selector.begin(), selector.end(), [](unsigned char c) { return std::isdigit(c); })) {
        std::size_t index = 0;
        const auto [end, error] = std::from_chars(selector.data(), selector.data() + selector.size(), index);
        return error == std::errc() && index < devices.size() ? &devices[index] : nullptr;
    }
    const auto at = std::find_if(devices.begin(), devices.end(), [part = lower(selector)](const FoundDevice& found) {
        return lower(found.info.name).find(part) != std::string::npos;
    });
    return at == devices.end() ? nullptr : &*at;
}

} // namespace

DeviceInfo describe(const cl::Device& device, int index)
{
    const cl::Platform platform(device.getInfo<CL_DEVICE_PLATFORM>());
    DeviceInfo info;
    info.index = index;
    info.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
    info.vendor = trimmed(device.getInfo<CL_DEVICE_VENDOR>());
    info.driver = trimmed(device.getInfo<CL_DRIVER_VERSION>());
    info.version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
    info.platform = trimmed(platform.getInfo<CL_PLATFORM_NAME>()) + ", " + trimmed(platform.getInfo<CL_PLATFORM_VERSION>());
    info.type = type_name(device.getInfo<CL_DEVICE_TYPE>());
    info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
    info.global_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
    // A device of this machine's own memory knows nothing of what this process may use of it.
    if (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) info.global_bytes = std::min<std::uint64_t>(info.global_bytes, machine_memory());
    info.max_allocation_bytes = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
    info.local_bytes = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
    info.max_work_group = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>();
    info.lanes = static_cast<unsigned>(quirks_of(device).lanes);
    return info;
}

std::vector<FoundDevice> find_devices()
{
    // Before PoCL loads anything from there. Where no folder can be used it gives no device.
    if (driver_folder().problem.empty()) driver_cache();
    std::vector<cl::Platform> platforms;
    try {
        cl::Platform::get(&platforms);
    } catch (const cl::Error&) {
        return {}; // the loader's way to say that no driver is installed
    }

    std::vector<FoundDevice> found;
    for (const cl::Platform& platform : platforms) {
        try {
            std::vector<cl::Device> devices;
            platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
            for (const cl::Device& device : devices) found.push_back({device, describe(device, static_cast<int>(found.size()))});
        } catch (const cl::Error&) {
            // A driver without hardware, or one that does not work, must not hide the others.
        }
    }
    return found;
}

FoundDevice choose_device(const std::string& selector)
{
    const std::vector<FoundDevice> devices = find_devices();
    if (devices.empty() && !driver_folder().problem.empty()) {
        throw Error(ErrorCode::device, "no folder can be used for compiled kernels: " + driver_folder().problem,
                    "name one that can be written to in PENUMBRA_CACHE_DIR");
    }
    if (devices.empty()) {
        throw Error(
            ErrorCode::device, "no OpenCL device found",
            "install a driver, for CPUs the package pocl-opencl-icd; drivers are registered in /etc/OpenCL/vendors or OCL_ICD_VENDORS");
    }
    if (selector.empty()) return devices.front();
    if (const FoundDevice* device = find(devices, selector)) return *device;
    throw Error(ErrorCode::device, "no OpenCL device matches \"" + selector + "\"; there is " + listing(devices),
                "select by index or by a part of the name");
}

} // namespace penumbra::opencl

namespace penumbra {

std::vector<DeviceInfo> list_devices()
{
    std::vector<DeviceInfo> infos;
    for (opencl::FoundDevice& found : opencl::find_devices()) infos.push_back(std::move(found.info));
    return infos;
}

} // namespace penumbra
