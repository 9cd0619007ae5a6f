// Wavefront OBJ: polygons with the digits that they have in the file, and what its materials cut out. Assimp reads coordinates as float32.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>

#include "io/polygon_soup.hpp"

namespace penumbra {

// v, vt, f (indices from 1, or from the end when negative), l and p, usemtl, mtllib, and lines that a backslash continues; what else there
// is (normals, groups, curves) is skipped. Materials matter for their map_d alone: a library that is not there is warned of. Throws
// invalid_input, messages with the line's number.
PolygonSoup decode_obj(std::span<const std::byte> bytes, const MeshSource& source);

// A map_d of a material library (MTL): which image, and how the texture coordinates lead to it.
struct OpacityMap {
    std::string file;
    char channel = 0; // of -imfchan: r, g, b, m (the matte: alpha), l (luminance); 0: alpha where it varies, else luminance
    bool clamp = false;
    Imath::V2f scale{1, 1}, offset{0, 0};
};

// Those of a library by the names of their materials.
std::map<std::string, OpacityMap, std::less<>> opacity_maps(std::string_view library);

} // namespace penumbra
