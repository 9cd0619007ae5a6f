#include "io/png_chunks.hpp"

#include <algorithm>

#include <libdeflate.h>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

constexpr std::size_t idat_size = std::size_t{1} << 20; // of the chunks that we write; PNG allows 2^31 - 1

Buffer deflated(std::span<const std::byte> bytes, int level)
{
    struct Free {
        void operator()(libdeflate_compressor* compressor) const { libdeflate_free_compressor(compressor); }
    };
    const std::unique_ptr<libdeflate_compressor, Free> compressor(libdeflate_alloc_compressor(level));
    if (!compressor) throw Error(ErrorCode::internal, "no memory to compress a PNG");
    Buffer result(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()));
    result.size = libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), result.bytes.get(), result.size);
    return result;
}

} // namespace

std::uint32_t png_checksum(std::span<const std::byte> bytes) { return libdeflate_crc32(0, bytes.data(), bytes.size()); }

std::uint32_t from_big_endian(std::span<const std::byte> bytes)
{
    std::uint32_t value = 0;
    for (const std::byte b : bytes.first(4)) value = value << 8 | std::to_integer<std::uint32_t>(b);
    return value;
}

std::array<std::byte, 4> big_endian(std::uint32_t value)
{
    return {std::byte(value >> 24), std::byte(value >> 16), std::byte(value >> 8), std::byte(value)};
}

void append_bytes(std::vector<std::byte>& png, std::span<const std::byte> bytes) { png.insert(png.end(), bytes.begin(), bytes.end()); }

void append_chunk(std::vector<std::byte>& png, std::string_view type, std::span<const std::byte> data)
{
    append_bytes(png, big_endian(static_cast<std::uint32_t>(data.size())));
    const std::size_t begin = png.size();
    append_bytes(png, std::as_bytes(std::span(type)));
    append_bytes(png, data);
    append_bytes(png, big_endian(png_checksum(std::span(png).subspan(begin))));
}

void append_rows(std::vector<std::byte>& png, std::span<const std::byte> rows, int level)
{
    const Buffer compressed = deflated(rows, level);
    const std::span<const std::byte> data = compressed;
    png.reserve(png.size() + data.size() + (data.size() / idat_size + 2) * png_frame_size);
    for (std::size_t at = 0; at < data.size(); at += idat_size)
        append_chunk(png, "IDAT", data.subspan(at, std::min(idat_size, data.size() - at)));
}

} // namespace penumbra
