// EXR files, before OpenEXR opens them: it allocates by what headers claim.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/image.hpp>

namespace penumbra {

struct ExrChannel {
    std::string name;
    SampleType type = SampleType::float32; // uint32, float16 or float32
};

// What exr_scanlines.hpp reads pixels by.
struct ExrHeader {
    // One part of scanlines without subsampling, neither cropped nor turned, with all the attributes that the format demands, each once.
    // The rest is meaningful only then.
    bool plain = false;
    int compression = 0; // as in the file: 0 none, 1 run lengths, 2 ZIP by rows, 3 ZIP by 16 rows, and others
    int width = 0, height = 0;
    std::int32_t first_row = 0;       // of the data window
    std::vector<ExrChannel> channels; // in the order in which they lie in a row
    std::size_t end = 0;              // the table of chunks begins here
};

// Looks at every part's data window, tile size and number of chunks. Throws too_large for more than max_samples pixels in a part or a tile,
// and invalid_input for a header that is broken or claims more than a file of this size can hold.
ExrHeader check_exr_header(std::span<const std::byte> exr, std::string_view where, std::uint64_t max_samples);

} // namespace penumbra
