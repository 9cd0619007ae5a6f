// EXR files, through OpenEXRCore: OpenImageIO would have to be loaded first (openimageio/openimageio.hpp).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <penumbra/image.hpp>

namespace penumbra {

// 1 to 4 channels with these names, 16 or 32 bits, ZIP at libdeflate's fastest level (docs/bench.md has times and sizes). Always the same
// bytes for the same pixels.
std::vector<std::byte> encode_exr(const Image& image, int bits, std::span<const char* const> names);

} // namespace penumbra
