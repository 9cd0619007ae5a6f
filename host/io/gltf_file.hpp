// A glTF file: its structure, and the bytes that it speaks of.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/polygon_soup.hpp"
#include "io/tiny_gltf.hpp"

namespace penumbra {

struct GltfFile {
    const MeshSource& source;
    tinygltf::Model model; // without buffers and images
    std::vector<Bytes> buffers;
    struct Image {
        std::string uri;
        int buffer_view = -1;
    };
    std::vector<Image> images;

    // The error that the file is broken: "box.gltf has ...".
    Error broken(const std::string& what) const { return broken_mesh(source.where, what); }

    // The entry of a list that an index in the file stands for; throws when there is none.
    template <class List> auto& entry(List& list, std::int64_t index, const char* name) const
    {
        if (index < 0 || static_cast<std::uint64_t>(index) >= list.size())
            throw broken("names " + std::string(name) + "[" + std::to_string(index) + "] of " + std::to_string(list.size()));
        return list[static_cast<std::size_t>(index)];
    }
};

// Throws what decode_gltf throws.
GltfFile open_gltf(std::span<const std::byte> bytes, const MeshSource& source);

// The bytes of a view; throws unless they lie in its buffer.
std::span<const std::byte> view_bytes(const GltfFile& file, int index);

// The file's bytes of one of its images.
Bytes image_bytes(const GltfFile& file, int index);

} // namespace penumbra
