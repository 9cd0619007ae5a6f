// Images of what is cut out of a surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <penumbra/scene.hpp>

namespace penumbra {

// Which channel of an image is meant: its alpha, its colour as one number, or alpha where there is one that varies and else colour.
enum class AlphaOf { alpha, colour, either };

// That channel; nothing where alpha is asked for and there is none. A PNG, EXR, TIFF or JPEG. Throws invalid_input and too_large, messages
// starting with `where`.
std::optional<Image> cut_image(std::span<const std::byte> bytes, std::string_view where, AlphaOf from, std::uint64_t max_samples);

// Whether every texel stays.
bool cuts_nothing(const CutOut& cut);

} // namespace penumbra
