// What the writer and the reader of PNG files share: chunks (length, type, data, checksum) and big-endian numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace penumbra {

inline constexpr std::array png_signature{std::byte{0x89}, std::byte{'P'},  std::byte{'N'},  std::byte{'G'},
                                          std::byte{'\r'}, std::byte{'\n'}, std::byte{0x1a}, std::byte{'\n'}};

inline constexpr std::size_t png_frame_size = 12; // length, type and checksum around each chunk's data

std::uint32_t png_checksum(std::span<const std::byte> bytes);

std::uint32_t from_big_endian(std::span<const std::byte> bytes);
std::array<std::byte, 4> big_endian(std::uint32_t value);

void append_bytes(std::vector<std::byte>& png, std::span<const std::byte> bytes);
void append_chunk(std::vector<std::byte>& png, std::string_view type, std::span<const std::byte> data);

// Memory that is written before it is read, unlike a vector's, which would be filled with zeros first.
struct Buffer {
    std::unique_ptr<std::byte[]> bytes;
    std::size_t size = 0;
    explicit Buffer(std::size_t capacity) : bytes(std::make_unique_for_overwrite<std::byte[]>(capacity)), size(capacity) {}
    operator std::span<const std::byte>() const { return {bytes.get(), size}; }
};

// Rows as IDAT chunks: a zlib stream at libdeflate's level 0 (stored) or 1 (fastest).
void append_rows(std::vector<std::byte>& png, std::span<const std::byte> rows, int level);

} // namespace penumbra
