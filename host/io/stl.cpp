#include "io/stl.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string>

#include "io/words.hpp"

namespace penumbra {

namespace {

constexpr std::size_t header_size = 84, record_size = 50; // 80 bytes of anything, a count; normal, three corners, 2 bytes

std::uint32_t little_32(std::string_view bytes)
{
    std::uint32_t number = 0;
    for (std::size_t i = 4; i-- > 0;) number = number << 8 | static_cast<unsigned char>(bytes[i]);
    return number;
}

// The triangle of the last three positions.
void add_triangle(PolygonSoup& soup)
{
    const auto end = static_cast<std::uint32_t>(soup.positions.size());
    soup.add(std::array{end - 3, end - 2, end - 1});
}

PolygonSoup decode_binary(std::string_view bytes, std::string_view where)
{
    const std::size_t count = little_32(bytes.substr(80));
    if ((bytes.size() - header_size) / record_size < count)
        throw broken_mesh(where, "is truncated: its header counts " + std::to_string(count) + " triangles, there are bytes for " +
                                     std::to_string((bytes.size() - header_size) / record_size));
    PolygonSoup soup;
    soup.positions.reserve(3 * count);
    for (std::size_t i = 0; i < count; ++i) {
        const std::string_view corners = bytes.substr(header_size + i * record_size + 12);
        for (std::size_t k = 0; k < 3; ++k) {
            const auto at = [&](std::size_t axis) { return std::bit_cast<float>(little_32(corners.substr(12 * k + 4 * axis))); };
            soup.positions.emplace_back(at(0), at(1), at(2));
        }
        add_triangle(soup);
    }
    return soup;
}

// Words count, not lines: (facet normal x y z, outer loop, vertex x y z three times, endloop, endfacet) endsolid; but for the name after
// solid.
PolygonSoup decode_text(std::string_view text, std::string_view where)
{
    PolygonSoup soup;
    std::size_t corners = 0;
    const auto drop_line = [&] { text.remove_prefix(std::min(text.find_first_of("\r\n"), text.size())); };
    drop_line();
    for (std::string_view word = next_word(text); !word.empty(); word = next_word(text)) {
        if (is_word(word, "solid") || is_word(word, "endsolid")) drop_line();
        if (is_word(word, "endloop")) {
            if (corners != 3) throw broken_mesh(where, "has an STL loop of " + std::to_string(corners) + " vertices, expected 3");
            add_triangle(soup);
            corners = 0;
        }
        if (!is_word(word, "vertex")) continue;
        Vec3 position;
        for (int axis = 0; axis < 3; ++axis) {
            const auto number = number_of(next_word(text));
            if (!number) throw broken_mesh(where, "has an STL vertex without three numbers");
            position[axis] = *number;
        }
        soup.positions.push_back(position);
        ++corners;
    }
    if (corners != 0) throw broken_mesh(where, "is truncated: an STL loop has no end");
    return soup;
}

} // namespace

PolygonSoup decode_stl(std::span<const std::byte> bytes, std::string_view where)
{
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    // Binary files may begin with "solid" too: one whose size is what its count says is binary.
    const bool counted = text.size() >= header_size && (text.size() - header_size) / record_size == little_32(text.substr(80)) &&
                         (text.size() - header_size) % record_size == 0;
    std::string_view rest = without_byte_order_mark(text);
    if (!counted && is_word(next_word(rest), "solid")) return decode_text(rest, where);
    if (text.size() < header_size) throw broken_mesh(where, "is no STL file: it is shorter than a header and does not begin with solid");
    return decode_binary(text, where);
}

} // namespace penumbra
