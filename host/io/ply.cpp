#include "io/ply.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>

#include <penumbra/error.hpp>

#include "io/words.hpp"

namespace penumbra {

namespace {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class Layout { ascii, little, big };

struct Property {
    std::string name;
    Scalar type = Scalar::float32;
    std::optional<Scalar> count; // of a list
};

struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties;
};

struct Header {
    Layout layout = Layout::ascii;
    std::vector<Element> elements;
};

std::size_t size_of(Scalar type)
{
    constexpr std::array<std::size_t, 8> sizes{1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[static_cast<std::size_t>(type)];
}

class Reader {
public:
    Reader(std::string_view rest, std::string_view where) : rest_(rest), where_(where) {}

    PolygonSoup read()
    {
        header_ = read_header();
        PolygonSoup soup;
        for (const Element& element : header_.elements) read_element(element, soup);
        for (const std::uint32_t corner : soup.corners)
            if (corner >= soup.positions.size())
                throw fail("has a face with vertex " + std::to_string(corner) + " of " + std::to_string(soup.positions.size()));
        return soup;
    }

private:
    Error fail(const std::string& what) const { return {ErrorCode::invalid_input, std::string(where_) + " " + what}; }

    std::string_view next_line()
    {
        const std::size_t end = rest_.find('\n');
        if (end == std::string_view::npos) throw fail("is truncated or broken: its PLY header has no end");
        std::string_view line = rest_.substr(0, end);
        rest_.remove_prefix(end + 1);
        if (line.ends_with('\r')) line.remove_suffix(1);
        return line;
    }

    Scalar scalar(std::string_view word) const
    {
        constexpr std::array<std::string_view, 8> names{"char", "uchar", "short", "ushort", "int", "uint", "float", "double"};
        constexpr std::array<std::string_view, 8> sized{"int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"};
        for (std::size_t i = 0; i < names.size(); ++i)
            if (word == names[i] || word == sized[i]) return static_cast<Scalar>(i);
        throw fail("has a PLY property of an unknown type");
    }

    Layout layout(std::string_view word) const
    {
        if (word == "ascii") return Layout::ascii;
        if (word == "binary_little_endian") return Layout::little;
        if (word == "binary_big_endian") return Layout::big;
        throw fail("has an unknown PLY format");
    }

    Header read_header()
    {
        if (without_byte_order_mark(next_line()) != "ply") throw fail("is not a PLY file");
        Header header;
        for (;;) {
            std::string_view line = next_line();
            const std::string_view word = next_word(line);
            if (word == "end_header") return header;
            if (word == "format") header.layout = layout(next_word(line));
            if (word == "element") {
                Element element{std::string(next_word(line)), 0, {}};
                const std::string_view count = next_word(line);
                const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
                if (error != std::errc() || end != count.data() + count.size()) throw fail("has a PLY element without a count");
                header.elements.push_back(std::move(element));
            }
            if (word == "property") {
                if (header.elements.empty()) throw fail("has a PLY property outside of any element");
                Property property;
                const std::string_view type = next_word(line);
                if (type == "list") property.count = scalar(next_word(line));
                property.type = scalar(type == "list" ? next_word(line) : type);
                property.name = std::string(next_word(line));
                header.elements.back().properties.push_back(std::move(property));
            }
        }
    }

    double value(Scalar type) { return header_.layout == Layout::ascii ? ascii_value() : binary_value(type); }

    double ascii_value()
    {
        const std::string_view word = next_word(rest_);
        if (word.empty()) throw fail("is truncated: its PLY data end early");
        const std::optional<double> number = number_of(word);
        if (!number) throw fail("has a broken number in its PLY data");
        return *number;
    }

    double binary_value(Scalar type)
    {
        const std::size_t size = size_of(type);
        if (rest_.size() < size) throw fail("is truncated: its PLY data end early");
        std::array<char, 8> bytes{};
        std::copy_n(rest_.data(), size, bytes.begin());
        rest_.remove_prefix(size);
        const bool little = header_.layout == Layout::little;
        if (little != (std::endian::native == std::endian::little))
            std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        const auto as = [&](auto number) {
            std::memcpy(&number, bytes.data(), sizeof number);
            return static_cast<double>(number);
        };
        switch (type) {
        case Scalar::int8:
            return as(std::int8_t{});
        case Scalar::uint8:
            return as(std::uint8_t{});
        case Scalar::int16:
            return as(std::int16_t{});
        case Scalar::uint16:
            return as(std::uint16_t{});
        case Scalar::int32:
            return as(std::int32_t{});
        case Scalar::uint32:
            return as(std::uint32_t{});
        case Scalar::float32:
            return as(float{});
        case Scalar::float64:
            return as(double{});
        }
        return 0;
    }

    std::uint32_t index(Scalar type) { return as_index(value(type)); }

    std::uint32_t as_index(double number) const
    {
        if (!(number >= 0 && number <= 4294967295.0) || number != std::floor(number))
            throw fail("has a PLY list with a broken index or count");
        return static_cast<std::uint32_t>(number);
    }

    void read_element(const Element& element, PolygonSoup& soup)
    {
        // What takes no bytes cannot end early: a count of billions would only burn time.
        if (element.properties.empty() || element.count == 0) return;
        const bool vertex = element.name == "vertex";
        if (vertex) check_has_positions(element);
        for (std::uint64_t i = 0; i < element.count; ++i) {
            Vec3 position(0, 0, 0);
            for (const Property& property : element.properties) {
                if (property.count) {
                    read_list(property, list_of(element, property), soup);
                    continue;
                }
                const double number = value(property.type);
                if (vertex && property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
                    position[property.name[0] - 'x'] = number;
            }
            if (vertex) soup.positions.push_back(position);
        }
    }

    void check_has_positions(const Element& element) const
    {
        for (const char* axis : {"x", "y", "z"})
            if (std::ranges::none_of(element.properties, [&](const Property& p) { return p.name == axis && !p.count; }))
                throw fail(std::string("has PLY vertices without ") + axis);
    }

    enum class List { other, polygon, strips };

    static List list_of(const Element& element, const Property& property)
    {
        if (property.name != "vertex_indices" && property.name != "vertex_index") return List::other;
        return element.name == "face" ? List::polygon : element.name == "tristrips" ? List::strips : List::other;
    }

    void read_list(const Property& property, List list, PolygonSoup& soup)
    {
        const std::uint32_t count = index(*property.count);
        if (list == List::strips) return read_strips(property, count, soup);
        for (std::uint32_t i = 0; i < count; ++i) {
            if (list == List::polygon)
                soup.corners.push_back(index(property.type));
            else
                value(property.type);
        }
        if (list == List::polygon) soup.sizes.push_back(count);
    }

    // Strips one after the other, -1 between them. Every other triangle of a strip turns the other way.
    void read_strips(const Property& property, std::uint32_t count, PolygonSoup& soup)
    {
        std::array<std::uint32_t, 2> before{};
        std::uint32_t length = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
            const double number = value(property.type);
            if (number == -1) {
                length = 0;
                continue;
            }
            const std::uint32_t corner = as_index(number);
            if (length >= 2) {
                const bool odd = length % 2 != 0;
                soup.add(std::array{before[odd ? 1 : 0], before[odd ? 0 : 1], corner});
            }
            before = {before[1], corner};
            ++length;
        }
    }

    std::string_view rest_, where_;
    Header header_;
};

} // namespace

PolygonSoup decode_ply(std::span<const std::byte> bytes, std::string_view where)
{
    return Reader({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, where).read();
}

} // namespace penumbra
