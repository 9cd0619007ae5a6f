// PNG files: read by libspng; written by code of our own, which libdeflate makes several times as fast as zlib would.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <penumbra/image.hpp>

namespace penumbra {

// 1 to 4 channels with 8 or 16 bits, as they stand; the file says that they are linear (gAMA 1) or sRGB. Values are in [0, 1], or as good
// as: they are clamped. Always the same bytes for the same pixels. OpenImageIO takes several times as long: zlib at level 6, and all five
// filters tried (docs/bench.md has times and sizes).
std::vector<std::byte> encode_png(const Image& image, int bits, bool srgb = false);

struct PngImage {
    int width = 0, height = 0;
    int channels = 1;           // grey or RGB, and alpha behind it
    int bits = 8;               // 8 or 16
    std::vector<float> samples; // integers
    double pixel_aspect = 1;    // a pixel's width over its height
};

// Samples as they stand: colour profiles and gamma are not applied. Palettes become colours, a transparent colour becomes alpha, and 1, 2
// and 4 bits become 8. Throws too_large for more than max_samples samples, before any is decoded, and invalid_input for a file that is
// truncated or broken.
PngImage decode_png(std::span<const std::byte> png, std::string_view where, std::uint64_t max_samples);

} // namespace penumbra
