// The OpenCL devices of this machine, in the order of list_devices().
#pragma once

#include <string>
#include <vector>

#include "opencl/quirks.hpp"

#include <penumbra/engine.hpp>

namespace penumbra::opencl {

struct FoundDevice {
    cl::Device device;
    DeviceInfo info;
};

std::vector<FoundDevice> find_devices();

// What `penumbra info` shows of a device. Throws cl::Error.
DeviceInfo describe(const cl::Device& device, int index);

// The one that `selector` means: digits are an index; anything else a part of the name, in upper or lower case, where the first match
// counts; empty is the first device. Throws Error(device), which lists what there is.
FoundDevice choose_device(const std::string& selector);

} // namespace penumbra::opencl
