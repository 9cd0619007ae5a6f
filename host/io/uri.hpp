// URIs as glTF has them: names of files beside the asset, and data in the text itself.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace penumbra {

// "my%20mesh.bin" is "my mesh.bin". A % without two hexadecimal digits stays what it is.
std::string percent_decoded(std::string_view uri);

bool is_data_uri(std::string_view uri);

// The bytes of a "data:[TYPE];base64,..." (RFC 2397, RFC 4648, with or without = at the end) or of one in percent encoding; nothing when it
// is broken.
std::optional<std::vector<std::byte>> data_of(std::string_view uri);

} // namespace penumbra
