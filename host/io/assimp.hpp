// Meshes through Assimp: 3DS, whose coordinates are float32 in the file.
#pragma once

#include <string>
#include <string_view>

#include "io/polygon_soup.hpp"

namespace penumbra {

// Throws invalid_input.
PolygonSoup read_3ds(const std::string& path, std::string_view where);

} // namespace penumbra
