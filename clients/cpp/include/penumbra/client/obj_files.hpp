// Which files a Wavefront OBJ names that count for shadows: its material libraries, and the images that cut out what it uses of them.
#pragma once

#include <algorithm>
#include <charconv>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace penumbra::client::detail {

// A file by the name that a mesh has for it, relative to the mesh.
struct NamedFile {
    std::string name;
    bool needed; // false: without it the service computes, and warns
};
using FindBytes = std::function<std::optional<std::string_view>(const std::string& name)>; // nothing: it is not there

inline bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

inline std::string_view without_blanks(std::string_view text)
{
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
    return text;
}

// The next word, taken off `rest`; empty at the end.
inline std::string_view take_word(std::string_view& rest)
{
    while (!rest.empty() && is_blank(rest.front())) rest.remove_prefix(1);
    const auto end = static_cast<std::size_t>(std::ranges::find_if(rest, is_blank) - rest.begin());
    const std::string_view word = rest.substr(0, end);
    rest.remove_prefix(end);
    return word;
}

inline std::string_view take_line(std::string_view& rest)
{
    const std::size_t end = std::min(rest.find_first_of("\r\n"), rest.size());
    const std::string_view line = rest.substr(0, end);
    const bool both = rest.substr(end).starts_with("\r\n");
    rest.remove_prefix(std::min(end + (both ? 2 : 1), rest.size()));
    return line;
}

// The next line of an OBJ without its comment, with those that a backslash at its end joins to it.
inline std::string take_joined_line(std::string_view& rest)
{
    const auto line_of = [&rest] {
        const std::string_view line = take_line(rest);
        return line.substr(0, line.find('#'));
    };
    std::string_view line = line_of();
    std::string joined;
    for (; line.ends_with('\\') && !rest.empty(); line = line_of()) joined.append(line.substr(0, line.size() - 1)).push_back(' ');
    return joined.append(line);
}

inline std::string_view without_mark(std::string_view text)
{
    constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
    return text.starts_with(byte_order_mark) ? text.substr(byte_order_mark.size()) : text;
}

inline bool is_number(std::string_view word)
{
    if (word.starts_with('+')) word.remove_prefix(1);
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    return error == std::errc() && end == word.data() + word.size();
}

// The name in "-clamp on -s 2 2 1 leaf mask.png", which may have spaces.
inline std::string map_name(std::string_view rest)
{
    for (std::string_view after = rest;; rest = after) {
        const std::string_view option = take_word(after);
        if (!option.starts_with('-')) break;
        if (option != "-o" && option != "-s" && option != "-t") {
            take_word(after);
            if (option == "-mm") take_word(after);
            continue;
        }
        for (int i = 0; i < 3; ++i) {
            std::string_view behind = after;
            if (!is_number(take_word(behind))) break;
            after = behind;
        }
    }
    std::string name(without_blanks(rest));
    std::ranges::replace(name, '\\', '/'); // as Windows writes it
    return name;
}

inline bool is_keyword(std::string_view word, std::string_view lower)
{
    return std::ranges::equal(word, lower, [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; });
}

// The images that a material library (MTL) cuts these materials out with.
inline void add_maps(std::string_view library, const std::set<std::string, std::less<>>& used, std::vector<NamedFile>& files)
{
    std::string_view material;
    for (library = without_mark(library); !library.empty();) {
        std::string_view line = take_line(library);
        const std::string_view key = take_word(line);
        if (is_keyword(key, "newmtl")) material = without_blanks(line);
        if (!is_keyword(key, "map_d") || !used.contains(material)) continue;
        if (std::string name = map_name(line); !name.empty()) files.push_back({std::move(name), false});
    }
}

// One name with spaces, or several names.
inline std::vector<std::string> library_names(const std::string& line, const FindBytes& find)
{
    if (find(line)) return {line};
    std::vector<std::string> names;
    std::string_view rest = line;
    for (std::string_view name = take_word(rest); !name.empty(); name = take_word(rest)) names.emplace_back(name);
    return names;
}

inline std::vector<NamedFile> files_of_obj(std::string_view text, const FindBytes& find)
{
    if (text.find("mtllib") == std::string_view::npos) return {};
    std::set<std::string, std::less<>> used;
    std::vector<std::string> libraries;
    for (text = without_mark(text); !text.empty();) {
        const std::string joined = take_joined_line(text);
        std::string_view line = joined;
        const std::string_view key = take_word(line);
        line = without_blanks(line);
        if (key == "usemtl") used.emplace(line);
        if (key == "mtllib" && !line.empty()) libraries.emplace_back(line);
    }
    std::vector<NamedFile> files;
    for (const std::string& line : libraries)
        for (const std::string& name : library_names(line, find)) {
            files.push_back({name, false});
            if (const auto library = find(name)) add_maps(*library, used, files);
        }
    return files;
}

} // namespace penumbra::client::detail
