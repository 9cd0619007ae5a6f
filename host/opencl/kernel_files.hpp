// The kernel files, embedded into the library.
#pragma once

#include <span>
#include <string_view>

namespace penumbra::opencl {

struct KernelFile {
    std::string_view name; // below kernels/, e.g. "common/light_space.clh"
    std::string_view text;
};

// All of them, by name. Generated from kernels/ by the build.
std::span<const KernelFile> kernel_files();

// The text of one. Throws internal for a name that is not there.
std::string_view kernel_file(std::string_view name);

} // namespace penumbra::opencl
