// What the materials of a glTF file cut out.
#pragma once

#include <map>

#include "io/gltf_primitive.hpp"

namespace penumbra {

class GltfMaterials {
public:
    GltfMaterials(const GltfFile& file, PolygonSoup& soup) : file_(file), soup_(soup) {}

    // Gives `part` its cut-out and texture coordinates, where its material has alphaMode MASK. False where nothing of it is left.
    bool cut(const tinygltf::Primitive& primitive, GltfPrimitive& part);

    std::size_t blended() const { return blended_; } // parts of alphaMode BLEND

private:
    std::uint32_t cut_of(int index);

    const GltfFile& file_;
    PolygonSoup& soup_;
    std::map<int, std::uint32_t> known_;
    std::size_t blended_ = 0;
};

} // namespace penumbra
