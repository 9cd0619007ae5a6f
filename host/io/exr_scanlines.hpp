// EXR pixels of the kind that renderers write, straight from memory. OpenEXR takes several times as long: it inflates with zlib, and on one
// thread.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "io/exr_header.hpp"

namespace penumbra {

// Whether read_exr_channel reads this kind of file: plain, uncompressed or ZIP.
bool has_plain_scanlines(const ExrHeader& header);

// The samples of one channel (an index into header.channels), row 0 at the top, on every core; integers as stored. `header` is that of
// `exr`, of which has_plain_scanlines is true. Nothing for a file that is broken: OpenImageIO says best what is wrong with it. What is read
// here is what OpenImageIO reads, bit for bit.
std::optional<std::vector<float>> read_exr_channel(std::span<const std::byte> exr, const ExrHeader& header, std::size_t channel);

} // namespace penumbra
