// Portable float maps. OpenImageIO 2.4 writes 8-bit integers when asked for one, so they are ours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <penumbra/image.hpp>

namespace penumbra {

// "Pf" (1 channel) or "PF" (3), either byte order. The scale's magnitude is a unit that writers disagree on; only its sign, the byte order,
// counts. Throws invalid_input or too_large (more than max_samples); messages start with `where`.
Image decode_pfm(std::span<const std::byte> bytes, std::string_view where, std::uint64_t max_samples);

// 1 or 3 channels, little-endian.
std::vector<std::byte> encode_pfm(const Image& image);

} // namespace penumbra
