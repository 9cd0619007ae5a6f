// PNG files, before they are decoded.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace penumbra {

// The file with nothing but the chunks that pixels are made of (IHDR, PLTE, tRNS, IDAT, IEND). Colour profiles, gamma, text and Exif go:
// samples are read as they stand, and libpng prints what it thinks of the others. Throws invalid_input for a file that is truncated or
// whose checksums are wrong.
std::vector<std::byte> pixel_chunks(std::span<const std::byte> png, std::string_view where);

} // namespace penumbra
