// EXR files, before OpenEXR opens them: it allocates by what headers claim.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace penumbra {

// Looks at every part's data window, tile size and number of chunks. Throws too_large for more than max_samples pixels in a part or a tile
// or 1024 channels in a part, and invalid_input for a header that is broken or claims more than a file of this size can hold.
void check_exr_header(std::span<const std::byte> exr, std::string_view where, std::uint64_t max_samples);

} // namespace penumbra
