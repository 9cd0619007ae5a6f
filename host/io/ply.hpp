// Polygon files (PLY): Assimp 5.2 hangs or aborts on truncated ones, so they are ours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <Imath/ImathVec.h>

namespace penumbra {

struct PolygonSoup {
    std::vector<Imath::V3f> positions;
    std::vector<std::uint32_t> corners; // of all polygons, one after the other
    std::vector<std::uint32_t> sizes;   // corners of each polygon
};

// Ascii, binary little-endian and big-endian; x, y, z of "vertex" and vertex_indices (or vertex_index) of "face", everything else is
// skipped. Throws invalid_input, messages starting with `where`.
PolygonSoup decode_ply(std::span<const std::byte> bytes, std::string_view where);

} // namespace penumbra
