// The formats that masks are sent in, and the one that a request asks for.
#pragma once

#include <span>
#include <string_view>

namespace penumbra::server {

struct MaskFormat {
    std::string_view media_type, format; // `format` as in OutputFormat
};
std::span<const MaskFormat> mask_formats(); // the first is the default

// By the Accept header (RFC 9110, 12.5.1); of equal weights the first format of mask_formats(). Throws Problem 406.
const MaskFormat& negotiate(std::string_view accept);

} // namespace penumbra::server
