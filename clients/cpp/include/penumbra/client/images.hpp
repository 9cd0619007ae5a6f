// What goes up beside the scene, and portable float maps (PFM), which carry float32 exactly.
#pragma once

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include <penumbra/image.hpp>

namespace penumbra::client {

// The bytes of EXR, PNG, TIFF or PFM files, by the names that the scene gives them.
using Images = std::map<std::string, std::string>;

// What the service takes as the name of an image.
inline bool is_part_name(std::string_view name)
{
    const auto allowed = [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '_' || c == '-';
    };
    return !name.empty() && name.size() <= 128 && name.front() != '.' && name != "scene" && std::ranges::all_of(name, allowed);
}

// A whole file. Throws std::system_error.
inline std::string file_bytes(const std::filesystem::path& path)
{
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) throw std::system_error(EISDIR, std::generic_category(), path.string());
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    std::string bytes(std::istreambuf_iterator<char>(in), {});
    if (!in.is_open() || in.bad()) throw std::system_error(errno == 0 ? EIO : errno, std::generic_category(), path.string());
    return bytes;
}

// The image as PFM. Throws std::invalid_argument for what is not width x height x 1 or 3 samples.
inline std::string pfm_bytes(const Image& image)
{
    const std::size_t row = static_cast<std::size_t>(std::max(image.width, 0)) * static_cast<std::size_t>(std::max(image.channels, 0));
    const std::size_t rows = static_cast<std::size_t>(std::max(image.height, 0));
    if (row == 0 || rows == 0 || (image.channels != 1 && image.channels != 3) || image.pixels.size() != row * rows)
        throw std::invalid_argument("an image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + " x " +
                                    std::to_string(image.channels) + " with " + std::to_string(image.pixels.size()) +
                                    " samples (expected 1 or 3 channels, and as many samples as that makes)");
    const bool little = std::endian::native == std::endian::little;
    std::string bytes = std::string(image.channels == 3 ? "PF" : "Pf") + "\n" + std::to_string(image.width) + " " +
                        std::to_string(image.height) + (little ? "\n-1.0\n" : "\n1.0\n");
    const auto* samples = reinterpret_cast<const char*>(image.pixels.data());
    for (std::size_t y = rows; y-- > 0;) bytes.append(samples + y * row * sizeof(float), row * sizeof(float)); // bottom up
    return bytes;
}

namespace detail {

// The next word of a PFM header; eats one character of white space behind it.
inline std::string_view next_word(std::string_view& rest)
{
    const auto space = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
    while (!rest.empty() && space(rest.front())) rest.remove_prefix(1);
    const auto end = static_cast<std::size_t>(std::ranges::find_if(rest, space) - rest.begin());
    const std::string_view word = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    return word;
}

template <class Number> bool parse(std::string_view word, Number& number)
{
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    return error == std::errc() && end == word.data() + word.size();
}

constexpr std::uint32_t swapped(std::uint32_t v) { return v >> 24 | (v >> 8 & 0xff00u) | (v << 8 & 0xff0000u) | v << 24; }

} // namespace detail

// The image that is PFM; nothing for what is not a whole one.
inline std::optional<Image> image_from_pfm(std::string_view bytes)
{
    const std::string_view kind = detail::next_word(bytes);
    Image image;
    double scale = 0;
    if ((kind != "PF" && kind != "Pf") || !detail::parse(detail::next_word(bytes), image.width) ||
        !detail::parse(detail::next_word(bytes), image.height) || !detail::parse(detail::next_word(bytes), scale))
        return {};
    image.channels = kind == "PF" ? 3 : 1;
    if (image.width < 1 || image.height < 1 || scale == 0 || !std::isfinite(scale)) return {};
    // Each is below 2^31 and channels below 4, so the product of all but one fits into 64 bits; the division keeps the last from
    // overflowing.
    const std::uint64_t row = static_cast<std::uint64_t>(image.width) * static_cast<std::uint64_t>(image.channels) * sizeof(float);
    if (bytes.size() % row != 0 || bytes.size() / row != static_cast<std::uint64_t>(image.height)) return {};

    image.pixels.resize(bytes.size() / sizeof(float));
    auto* samples = reinterpret_cast<char*>(image.pixels.data());
    for (std::size_t y = 0; y < static_cast<std::size_t>(image.height); ++y)
        std::memcpy(samples + (static_cast<std::size_t>(image.height) - 1 - y) * row, bytes.data() + y * row, row);
    if ((scale < 0) != (std::endian::native == std::endian::little))
        for (float& sample : image.pixels) sample = std::bit_cast<float>(detail::swapped(std::bit_cast<std::uint32_t>(sample)));
    return image;
}

} // namespace penumbra::client
