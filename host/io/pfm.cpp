#include "io/pfm.hpp"
#include "scene/memory.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// The next word of the header; eats one character of white space behind it, as the samples follow the last word at once.
std::string_view next_word(std::string_view& rest)
{
    while (!rest.empty() && is_space(rest.front())) rest.remove_prefix(1);
    std::size_t end = 0;
    while (end < rest.size() && !is_space(rest[end])) ++end;
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

constexpr bool host_is_little = std::endian::native == std::endian::little;

} // namespace

Image decode_pfm(std::span<const std::byte> bytes, std::string_view where, std::uint64_t max_samples)
{
    const auto fail = [&](const std::string& what) { return Error(ErrorCode::invalid_input, std::string(where) + " " + what); };
    std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());

    const std::string_view kind = next_word(rest);
    if (kind != "PF" && kind != "Pf") throw fail("is not a portable float map");
    Image image;
    image.channels = kind == "PF" ? 3 : 1;
    double scale = 0;
    if (!parse(next_word(rest), image.width) || !parse(next_word(rest), image.height) || !parse(next_word(rest), scale))
        throw fail("has a broken header: expected width, height and scale");
    if (image.width < 1 || image.height < 1)
        throw fail("has a size of " + std::to_string(image.width) + " x " + std::to_string(image.height));
    if (!std::isfinite(scale) || scale == 0) throw fail("has a broken header: the scale must not be 0");

    const std::uint64_t samples = static_cast<std::uint64_t>(image.width) * static_cast<std::uint64_t>(image.height);
    if (samples > max_samples / static_cast<std::uint64_t>(image.channels))
        throw Error(ErrorCode::too_large, std::string(where) + " is " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                                              " x " + std::to_string(image.channels) + " samples; the limit is " +
                                              std::to_string(max_samples));
    const std::size_t row = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels);
    const std::size_t expected = row * static_cast<std::size_t>(image.height) * sizeof(float);
    // A header in the lines of Windows ends in CR LF. Samples may begin with what is LF, so the size has to allow for it.
    if (rest.size() > expected && *(rest.data() - 1) == '\r' && rest.front() == '\n') rest.remove_prefix(1);
    if (rest.size() < expected)
        throw fail("is truncated: " + std::to_string(rest.size()) + " bytes of samples, expected " + std::to_string(expected));

    require_memory(static_cast<double>(expected), where);
    // Rows stand bottom up.
    image.pixels.resize(row * static_cast<std::size_t>(image.height));
    for (std::size_t y = 0; y < static_cast<std::size_t>(image.height); ++y)
        std::memcpy(&image.pixels[(static_cast<std::size_t>(image.height) - 1 - y) * row], rest.data() + y * row * sizeof(float),
                    row * sizeof(float));
    if ((scale < 0) != host_is_little)
        for (float& sample : image.pixels) sample = std::bit_cast<float>(swapped(std::bit_cast<std::uint32_t>(sample)));
    return image;
}

std::vector<std::byte> encode_pfm(const Image& image)
{
    const std::string header = std::string(image.channels == 3 ? "PF" : "Pf") + "\n" + std::to_string(image.width) + " " +
                               std::to_string(image.height) + (host_is_little ? "\n-1.0\n" : "\n1.0\n");
    const std::size_t row = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels) * sizeof(float);
    const std::size_t rows = static_cast<std::size_t>(image.height);
    std::vector<std::byte> bytes(header.size() + row * rows);
    std::memcpy(bytes.data(), header.data(), header.size());
    const std::byte* pixels = reinterpret_cast<const std::byte*>(image.pixels.data());
    for (std::size_t y = 0; y < rows; ++y) std::memcpy(bytes.data() + header.size() + y * row, pixels + (rows - 1 - y) * row, row);
    return bytes;
}

} // namespace penumbra
