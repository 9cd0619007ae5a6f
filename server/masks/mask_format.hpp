// The formats that masks are sent in, and the one that a request asks for.
#pragma once

#include <span>
#include <string_view>

#include "masks/mask_choice.hpp"

namespace penumbra::server {

struct MaskFormat {
    std::string_view media_type, format; // `format` as in OutputFormat
};
std::span<const MaskFormat> mask_formats(); // the first is the default

// Those that such an image is sent in, the first by default: bounds have two named channels, which only EXR holds.
std::span<const MaskFormat> formats_of(MaskImage image);

// By the Accept header (RFC 9110, 12.5.1); of equal weights the first format of formats_of(image). Throws Problem 406.
const MaskFormat& negotiate(std::string_view accept, MaskImage image);

} // namespace penumbra::server
