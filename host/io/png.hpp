// PNG files: made, and looked at before they are decoded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <penumbra/image.hpp>

namespace penumbra {

// 1 to 4 channels with 8 or 16 bits, linear (gAMA 1). Values are in [0, 1], or as good as: they are clamped. Always the same bytes for the
// same pixels. OpenImageIO takes several times as long: zlib at level 6, and all five filters tried (docs/bench.md has times and sizes).
std::vector<std::byte> encode_png(const Image& image, int bits);

// The same pixels as a PNG that libpng reads without a complaint, which it would print: nothing but IHDR, PLTE, tRNS, IDAT (unpacked and
// checked: libdeflate is faster than zlib) and IEND. Colour profiles, gamma, text and Exif go: samples are read as they stand. `png` begins
// with PNG's signature. Throws too_large for more than max_samples samples, before anything is unpacked, and invalid_input for a file that
// is truncated or broken.
std::vector<std::byte> unpacked_png(std::span<const std::byte> png, std::string_view where, std::uint64_t max_samples);

} // namespace penumbra
