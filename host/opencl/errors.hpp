// OpenCL's error numbers by name, and cl::Error turned into the library's own. No cl::Error leaves this room.
#pragma once

#include <string>
#include <string_view>

#define CL_HPP_ENABLE_EXCEPTIONS
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#include <CL/opencl.hpp>

#include <penumbra/error.hpp>

namespace penumbra::opencl {

// "CL_OUT_OF_RESOURCES (-5)"; "error -9999" for a number that no specification names.
std::string error_name(cl_int code);

// "WHERE: CALL failed with NAME (NUMBER)". `where` says what was done to what, with the numbers: "kernel shade, global 64 x 64, local 16 x
// 16".
Error device_error(const cl::Error& error, std::string_view where, std::string hint = {});

// Calls OpenCL; what fails is an Error(device).
template <class Call> decltype(auto) translated(std::string_view where, Call&& call)
{
    try {
        return call();
    } catch (const cl::Error& error) {
        throw device_error(error, where);
    }
}

// "1073741824 bytes (1.00 GiB)"; below 1 KiB without the second form.
std::string bytes_text(unsigned long long bytes);

} // namespace penumbra::opencl
