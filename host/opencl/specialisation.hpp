// A program to build: a kernel file and the values of its specialisation constants.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace penumbra::opencl {

// One typed struct a kernel file turns into one of these, by one function; the text of the -D list and the cache key both come from it.
struct Specialisation {
    std::string file; // below kernels/, e.g. "soft_shadow_map.cl"
    std::vector<std::pair<std::string, std::string>> constants;

    // "-DLANES=16 -DTILE=16", in the order of `constants`.
    std::string options() const;
};

} // namespace penumbra::opencl
