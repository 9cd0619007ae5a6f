// Words and numbers of text formats (PLY, OBJ, STL), whatever the locale.
#pragma once

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

namespace penumbra {

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf"; // of UTF-8, as editors on Windows put it before a text

inline std::string_view without_byte_order_mark(std::string_view text)
{
    return text.starts_with(byte_order_mark) ? text.substr(byte_order_mark.size()) : text;
}

inline bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// The next word, taken off `rest`; empty at the end.
inline std::string_view next_word(std::string_view& rest)
{
    while (!rest.empty() && is_space(rest.front())) rest.remove_prefix(1);
    std::size_t end = 0;
    while (end < rest.size() && !is_space(rest[end])) ++end;
    const std::string_view word = rest.substr(0, end);
    rest.remove_prefix(end);
    return word;
}

// The whole word as a number, rounded once; "+1" too. Infinities and NaN are numbers here.
inline std::optional<double> number_of(std::string_view word)
{
    if (word.starts_with('+')) word.remove_prefix(1);
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return number;
}

// Whether the word is `lower`, which has small letters alone, in any case.
inline bool is_word(std::string_view word, std::string_view lower)
{
    if (word.size() != lower.size()) return false;
    for (std::size_t i = 0; i < word.size(); ++i) {
        const char c = word[i] >= 'A' && word[i] <= 'Z' ? static_cast<char>(word[i] - 'A' + 'a') : word[i];
        if (c != lower[i]) return false;
    }
    return true;
}

// Another program's message in one of ours: one line of ASCII, cut when long.
inline std::string one_line(std::string text)
{
    text.resize(std::min<std::size_t>(text.size(), 200));
    for (char& c : text)
        if (c < 0x20 || c > 0x7e) c = ' ';
    return text;
}

} // namespace penumbra
