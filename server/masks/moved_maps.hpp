// Maps that were sent as a light's view, after a patch that moves the light: they move with it, and what they show does, too.
#pragma once

#include <string>
#include <vector>

#include "masks/masks.hpp"

namespace penumbra::server {

// A warning for each light of `after` that stands or looks elsewhere than in `before`, over the same sent maps.
std::vector<std::string> warnings_of_moved_maps(const MaskJob& before, const MaskJob& after);

} // namespace penumbra::server
