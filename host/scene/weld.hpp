// Vertices at equal places become one, whatever their normals and texture coordinates: silhouettes need the surface, not its seams.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ImathVec.h>

namespace penumbra {

// Appends places to `places`, each once a welder, in the order in which they come first; those that were there before are none of its own.
// A hash table with linear probing, at most half full.
class Welder {
public:
    // Nobody else appends to `places` while it is used; `expected` places need no further memory for the table.
    explicit Welder(std::vector<Imath::V3f>& places, std::size_t expected = 0);

    // The index in `places` of that position, which is finite; -0 counts as 0.
    std::uint32_t operator()(const Imath::V3f& position);
    void reserve(std::size_t expected);

private:
    std::size_t slot_of(const Imath::V3f& place) const; // where it is, or would be

    std::vector<Imath::V3f>& places_;
    const std::size_t first_; // of its own
    std::vector<std::uint32_t> slots_;
};

} // namespace penumbra
