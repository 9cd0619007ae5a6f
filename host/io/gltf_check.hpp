// The types of what a glTF file says of its geometry. tinygltf takes a key of another type for one that is not there: a node would stand
// elsewhere without a word.
#pragma once

#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace penumbra {

// Throws invalid_input naming the first key that is of another type than glTF says.
void check_gltf_types(const nlohmann::json& document, std::string_view where);

} // namespace penumbra
