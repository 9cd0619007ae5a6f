#include "io/png.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>

#include <libdeflate.h>

#include <penumbra/error.hpp>

#include "scene/parallel.hpp"

namespace penumbra {

namespace {

constexpr std::size_t signature_size = 8;
constexpr std::size_t frame_size = 12;                  // length, type and checksum around each chunk's data
constexpr std::size_t idat_size = std::size_t{1} << 20; // of the chunks that we write; PNG allows 2^31 - 1

std::uint32_t crc(std::span<const std::byte> bytes) { return libdeflate_crc32(0, bytes.data(), bytes.size()); }

std::uint32_t big_endian(std::span<const std::byte> bytes)
{
    std::uint32_t value = 0;
    for (const std::byte b : bytes.first(4)) value = value << 8 | std::to_integer<std::uint32_t>(b);
    return value;
}

std::array<std::byte, 4> big_endian(std::uint32_t value)
{
    return {std::byte(value >> 24), std::byte(value >> 16), std::byte(value >> 8), std::byte(value)};
}

constexpr std::array signature{std::byte{0x89}, std::byte{'P'},  std::byte{'N'},  std::byte{'G'},
                               std::byte{'\r'}, std::byte{'\n'}, std::byte{0x1a}, std::byte{'\n'}};

void append(std::vector<std::byte>& png, std::span<const std::byte> bytes) { png.insert(png.end(), bytes.begin(), bytes.end()); }

void append_chunk(std::vector<std::byte>& png, std::string_view type, std::span<const std::byte> data)
{
    append(png, big_endian(static_cast<std::uint32_t>(data.size())));
    const std::size_t begin = png.size();
    append(png, std::as_bytes(std::span(type)));
    append(png, data);
    append(png, big_endian(crc(std::span(png).subspan(begin))));
}

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

// Memory that is written before it is read, unlike a vector's, which would be filled with zeros first.
struct Buffer {
    std::unique_ptr<std::byte[]> bytes;
    std::size_t size = 0;
    explicit Buffer(std::size_t capacity) : bytes(std::make_unique_for_overwrite<std::byte[]>(capacity)), size(capacity) {}
    operator std::span<const std::byte>() const { return {bytes.get(), size}; }
};

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

// A zlib stream at libdeflate's fastest level, which still makes masks as small as zlib's default.
Buffer deflated(std::span<const std::byte> bytes)
{
    struct Free {
        void operator()(libdeflate_compressor* compressor) const { libdeflate_free_compressor(compressor); }
    };
    constexpr int fastest = 1;
    const std::unique_ptr<libdeflate_compressor, Free> compressor(libdeflate_alloc_compressor(fastest));
    if (!compressor) throw Error(ErrorCode::internal, "no memory to compress a PNG");
    Buffer result(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()));
    result.size = libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), result.bytes.get(), result.size);
    return result;
}

} // namespace

std::vector<std::byte> encode_png(const Image& image, int bits)
{
    // Grey, RGB; with alpha 4 more.
    constexpr std::array colour_types{std::byte{0}, std::byte{4}, std::byte{2}, std::byte{6}};
    std::array<std::byte, 13> header{};
    std::ranges::copy(big_endian(static_cast<std::uint32_t>(image.width)), header.begin());
    std::ranges::copy(big_endian(static_cast<std::uint32_t>(image.height)), header.begin() + 4);
    header[8] = static_cast<std::byte>(bits);
    header[9] = colour_types[static_cast<std::size_t>(image.channels - 1)];

    const Buffer compressed = deflated(filtered(image, bits));
    const std::span<const std::byte> data = compressed;
    std::vector<std::byte> png;
    png.reserve(data.size() + data.size() / idat_size * frame_size + 128);
    append(png, signature);
    append_chunk(png, "IHDR", header);
    append_chunk(png, "gAMA", big_endian(100000)); // 1: linear
    for (std::size_t at = 0; at < data.size(); at += idat_size)
        append_chunk(png, "IDAT", data.subspan(at, std::min(idat_size, data.size() - at)));
    append_chunk(png, "IEND", {});
    return png;
}

std::vector<std::byte> pixel_chunks(std::span<const std::byte> png, std::string_view where)
{
    constexpr std::array<std::string_view, 5> kept{"IHDR", "PLTE", "tRNS", "IDAT", "IEND"};
    std::vector<std::byte> result(png.begin(), png.begin() + signature_size);
    result.reserve(png.size());
    std::span<const std::byte> rest = png.subspan(signature_size);
    while (rest.size() >= frame_size) {
        const std::size_t length = big_endian(rest);
        if (length > rest.size() - frame_size) break;
        const std::span<const std::byte> chunk = rest.first(length + frame_size);
        const std::string_view type(reinterpret_cast<const char*>(chunk.data()) + 4, 4);
        if (crc(chunk.subspan(4, length + 4)) != big_endian(chunk.last(4)))
            throw Error(ErrorCode::invalid_input, std::string(where) + " is broken: a PNG chunk has a wrong checksum");
        // libpng prints its complaint about these.
        if ((type == "IHDR") != (result.size() == signature_size))
            throw Error(ErrorCode::invalid_input, std::string(where) + " is broken: expected one IHDR, the PNG's first chunk");
        if (std::ranges::find(kept, type) != kept.end()) result.insert(result.end(), chunk.begin(), chunk.end());
        if (type == "IEND") return result;
        rest = rest.subspan(chunk.size());
    }
    throw Error(ErrorCode::invalid_input, std::string(where) + " is truncated or broken: the PNG has no end");
}

} // namespace penumbra
