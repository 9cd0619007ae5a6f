// What the library asks of OpenImageIO. It pulls in some 250 shared libraries, which take longer to load than a small mask to compute; so
// the code that calls it is a module of its own, and is loaded when a file needs it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <penumbra/image.hpp>

#include "io/depth_channel.hpp"
#include "io/image_format.hpp"
#include "io/raw_planes.hpp"

namespace penumbra {

// The module's functions. They throw penumbra::Error; messages about files start with `where`.
struct OpenImageIO {
    const char* version; // the library's: module and library share structs, so both must be of one build
    Image (*decode_image)(std::span<const std::byte> bytes, ImageFormat format, std::string_view where, std::uint64_t max_samples);
    RawPlanes (*decode_planes)(std::span<const std::byte> bytes, ImageFormat format, const PlaneRequest& request, std::string_view where,
                               std::uint64_t max_samples);
    // TIFF (8 and 16 bits are integers, 32 floats), or Radiance with three channels; samples that the format holds.
    std::vector<std::byte> (*encode)(const Image& image, ImageFormat format, int bits);
};

// Loads the module at the first call. Throws Error(internal) when it is missing, cannot be loaded or is of another version.
const OpenImageIO& openimageio();

// The only symbol that is looked up in it: a function that returns a const OpenImageIO*.
inline constexpr const char* openimageio_symbol = "penumbra_openimageio";

} // namespace penumbra
