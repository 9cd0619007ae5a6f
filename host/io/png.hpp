// PNG files: made, and looked at before they are decoded.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include <penumbra/image.hpp>

namespace penumbra {

// 1 to 4 channels with 8 or 16 bits, linear (gAMA 1). Values are in [0, 1], or as good as: they are clamped. Always the same bytes for the
// same pixels. OpenImageIO takes several times as long: zlib at level 6, and all five filters tried (docs/bench.md has times and sizes).
std::vector<std::byte> encode_png(const Image& image, int bits);

// The file with nothing but the chunks that pixels are made of (IHDR, PLTE, tRNS, IDAT, IEND). Colour profiles, gamma, text and Exif go:
// samples are read as they stand, and libpng prints what it thinks of the others. Throws invalid_input for a file that is truncated or
// whose checksums are wrong.
std::vector<std::byte> pixel_chunks(std::span<const std::byte> png, std::string_view where);

} // namespace penumbra
