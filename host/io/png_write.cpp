#include "io/png.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include "io/png_chunks.hpp"
#include "scene/parallel.hpp"

namespace penumbra {

namespace {

// The nearest integer, halves up; exact in double for 16 bits.
std::uint32_t quantized(float value, double largest) { return static_cast<std::uint32_t>(std::clamp(value, 0.0f, 1.0f) * largest + 0.5); }

// A row as PNG's filter 1 (Sub) leaves it: each byte as its difference to the same byte of the pixel on the left. Of the five filters it
// makes masks about the smallest, and costs nothing.
template <std::size_t sample_bytes> void filter_row(std::span<const float> row, std::size_t channels, std::byte* out)
{
    constexpr double largest = sample_bytes == 2 ? 65535 : 255;
    std::array<std::uint32_t, 4> left{};
    *out++ = std::byte{1};
    for (std::size_t i = 0; i < row.size(); i += channels)
        for (std::size_t c = 0; c < channels; ++c) {
            const std::uint32_t sample = quantized(row[i + c], largest);
            if constexpr (sample_bytes == 2) *out++ = std::byte((sample >> 8) - (left[c] >> 8));
            *out++ = std::byte(sample - left[c]);
            left[c] = sample;
        }
}

Buffer filtered(const Image& image, int bits)
{
    const std::size_t samples = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels);
    const std::size_t row_bytes = 1 + samples * static_cast<std::size_t>(bits / 8);
    Buffer rows(row_bytes * static_cast<std::size_t>(image.height));
    constexpr int rows_together = 64; // as many as take longer than it takes to start a thread
    parallel_for((image.height + rows_together - 1) / rows_together, [&](int run) {
        const int end = std::min(image.height, (run + 1) * rows_together);
        for (int y = run * rows_together; y < end; ++y) {
            const std::span row = std::span(image.pixels).subspan(static_cast<std::size_t>(y) * samples, samples);
            std::byte* const out = rows.bytes.get() + static_cast<std::size_t>(y) * row_bytes;
            if (bits == 16)
                filter_row<2>(row, static_cast<std::size_t>(image.channels), out);
            else
                filter_row<1>(row, static_cast<std::size_t>(image.channels), out);
        }
    });
    return rows;
}

} // namespace

std::vector<std::byte> encode_png(const Image& image, int bits, bool srgb)
{
    // Grey, RGB; with alpha 4 more.
    constexpr std::array colour_types{std::byte{0}, std::byte{4}, std::byte{2}, std::byte{6}};
    std::array<std::byte, 13> header{};
    std::ranges::copy(big_endian(static_cast<std::uint32_t>(image.width)), header.begin());
    std::ranges::copy(big_endian(static_cast<std::uint32_t>(image.height)), header.begin() + 4);
    header[8] = static_cast<std::byte>(bits);
    header[9] = colour_types[static_cast<std::size_t>(image.channels - 1)];

    // libdeflate's fastest level still makes masks as small as zlib's default.
    constexpr int fastest = 1;
    std::vector<std::byte> png(png_signature.begin(), png_signature.end());
    append_chunk(png, "IHDR", header);
    // Of sRGB the intent is 0, perceptual; gAMA stands beside it for who knows no sRGB (PNG 2nd edition, 11.3.3.5). Else 1: linear.
    constexpr std::array perceptual{std::byte{0}};
    if (srgb) append_chunk(png, "sRGB", perceptual);
    append_chunk(png, "gAMA", big_endian(srgb ? 45455 : 100000));
    append_rows(png, filtered(image, bits), fastest);
    append_chunk(png, "IEND", {});
    return png;
}

} // namespace penumbra
