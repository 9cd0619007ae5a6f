// The image formats that are read and written.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <penumbra/image.hpp>

namespace penumbra {

// No deflate stream becomes more than this many times longer (zlib's documentation).
constexpr std::size_t most_inflated = 1032;

enum class ImageFormat { unknown, exr, tiff, png, pfm, hdr, jpeg }; // jpeg: pictures to look at, never depth

// By the first bytes.
ImageFormat sniff(std::span<const std::byte> bytes);

ImageFormat format_of(const OutputFormat& output);

// `output` with its format in the short spelling and its bits filled in. Throws usage for a format or bits that do not exist, listing those
// that do.
OutputFormat checked(const OutputFormat& output, std::string_view where);

// Where the format is left out, the one that the extension of `path` names.
OutputFormat by_extension(OutputFormat output, const std::string& path);

} // namespace penumbra
