#include "io/png.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

constexpr std::size_t signature_size = 8;
constexpr std::size_t frame_size = 12; // length, type and checksum around each chunk's data

// CRC-32 of ISO 3309, byte by byte (PNG specification, annex D).
constexpr std::array<std::uint32_t, 256> crc_table = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t n = 0; n < 256; ++n) {
        std::uint32_t c = n;
        for (int bit = 0; bit < 8; ++bit) c = (c & 1) != 0 ? 0xedb88320u ^ (c >> 1) : c >> 1;
        table[n] = c;
    }
    return table;
}();

std::uint32_t crc(std::span<const std::byte> bytes)
{
    std::uint32_t c = 0xffffffffu;
    for (const std::byte b : bytes) c = crc_table[(c ^ std::to_integer<std::uint32_t>(b)) & 0xff] ^ (c >> 8);
    return ~c;
}

std::uint32_t big_endian(std::span<const std::byte> bytes)
{
    std::uint32_t value = 0;
    for (const std::byte b : bytes.first(4)) value = value << 8 | std::to_integer<std::uint32_t>(b);
    return value;
}

} // namespace

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
        if (std::ranges::find(kept, type) != kept.end()) result.insert(result.end(), chunk.begin(), chunk.end());
        if (type == "IEND") return result;
        rest = rest.subspan(chunk.size());
    }
    throw Error(ErrorCode::invalid_input, std::string(where) + " is truncated or broken: the PNG has no end");
}

} // namespace penumbra
