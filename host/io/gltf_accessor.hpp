// Numbers of a glTF file.
#pragma once

#include <cstdint>
#include <vector>

#include "io/gltf_file.hpp"

namespace penumbra {

// The numbers of an accessor whose type has `width` of them, one element after the other: strides and sparse replacements followed,
// integers divided by their range when they are normalised. Throws invalid_input unless they lie in their buffers.
std::vector<double> read_numbers(const GltfFile& file, int accessor, int width);

// The same for one number an element, which must be an integer.
std::vector<std::uint32_t> read_indices(const GltfFile& file, int accessor);

// How many elements it has.
std::size_t element_count(const GltfFile& file, int accessor);

} // namespace penumbra
