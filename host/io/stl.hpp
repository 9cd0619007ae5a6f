// Stereolithography (STL): loose triangles, binary or as text. Text keeps its digits, which survey coordinates need.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "io/polygon_soup.hpp"

namespace penumbra {

// Keywords of the text may be in any case. Throws invalid_input, messages starting with `where`.
PolygonSoup decode_stl(std::span<const std::byte> bytes, std::string_view where);

} // namespace penumbra
