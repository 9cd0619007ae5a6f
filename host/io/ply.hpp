// Polygon files (PLY): Assimp 5.2 hangs or aborts on truncated ones, so they are ours.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "io/polygon_soup.hpp"

namespace penumbra {

// Ascii, binary little-endian and big-endian; x, y, z of "vertex", vertex_indices (or vertex_index) of "face" and of "tristrips" (strips that -1
// ends); everything else is skipped. Throws invalid_input, messages starting with `where`.
PolygonSoup decode_ply(std::span<const std::byte> bytes, std::string_view where);

} // namespace penumbra
