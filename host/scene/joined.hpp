// Lists in messages.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace penumbra {

// "a, b, c": what `text_of` makes of each of `items`, a function or a member.
template <class Items, class TextOf = std::identity>
std::string joined(const Items& items, TextOf text_of = {}, std::string_view between = ", ")
{
    std::string list;
    bool first = true;
    for (const auto& item : items) {
        if (!first) list += between;
        list += std::invoke(text_of, item);
        first = false;
    }
    return list;
}

} // namespace penumbra
