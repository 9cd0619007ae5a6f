// multipart/form-data (RFC 7578), read strictly: what is not exactly a form is refused with 400.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "masks/part.hpp"

namespace penumbra::server {

// The boundary of a Content-Type. Throws Problem 415 for another type, 400 for a boundary that is missing or not allowed.
std::string boundary_of(std::string_view content_type);

// Whether that is JSON, as it stands or as a merge patch (RFC 7396).
bool is_json(std::string_view content_type);

// A name that a part may have: 1 to 128 of A-Z a-z 0-9 . _ - and no . at the start. No path is one.
bool is_part_name(std::string_view name);

// The parts lie in `body`. Throws Problem 400: truncated, headers over 4096 bytes, no name, a name that is not allowed or stands twice;
// 413: more than `max_parts`. Linear in the body's size.
std::vector<Part> parse_multipart(std::string_view body, std::string_view boundary, std::size_t max_parts);

} // namespace penumbra::server
