// Material libraries of OBJ files: what they cut out.
#include <algorithm>

#include "io/obj.hpp"
#include "io/words.hpp"

namespace penumbra {

namespace {

std::string_view trimmed(std::string_view text)
{
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
    return text;
}

// Up to three numbers, as -o, -s and -t have them; the first two count.
void read_numbers(std::string_view& rest, Imath::V2f* into)
{
    for (int i = 0; i < 3; ++i) {
        std::string_view after = rest;
        const auto number = number_of(next_word(after));
        if (!number) return;
        if (into && i < 2) (*into)[i] = static_cast<float>(*number);
        rest = after;
    }
}

// "-clamp on -s 2 2 1 leaf mask.png": options, then a name that may have spaces.
OpacityMap opacity_map(std::string_view rest)
{
    OpacityMap map;
    for (std::string_view after = rest;; rest = after) {
        const std::string_view option = next_word(after);
        if (!option.starts_with('-')) break;
        if (option == "-o" || option == "-s" || option == "-t") {
            read_numbers(after, option == "-o" ? &map.offset : option == "-s" ? &map.scale : nullptr);
            continue;
        }
        const std::string_view value = next_word(after);
        if (option == "-mm") next_word(after);
        if (option == "-clamp") map.clamp = value == "on";
        if (option == "-imfchan" && !value.empty()) map.channel = value.front();
    }
    map.file = std::string(trimmed(rest));
    std::ranges::replace(map.file, '\\', '/'); // as Windows writes it
    return map;
}

} // namespace

std::map<std::string, OpacityMap, std::less<>> opacity_maps(std::string_view library)
{
    std::map<std::string, OpacityMap, std::less<>> maps;
    std::string material;
    library = without_byte_order_mark(library);
    while (!library.empty()) {
        const std::size_t end = std::min(library.find_first_of("\r\n"), library.size());
        std::string_view line = library.substr(0, end);
        library.remove_prefix(std::min(end + 1, library.size()));
        const std::string_view key = next_word(line);
        if (is_word(key, "newmtl")) material = std::string(trimmed(line));
        if (!is_word(key, "map_d")) continue;
        OpacityMap map = opacity_map(line);
        if (!map.file.empty()) maps.insert_or_assign(material, std::move(map));
    }
    return maps;
}

} // namespace penumbra
