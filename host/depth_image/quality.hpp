// What is said of a depth image's quality.
#pragma once

#include <string>
#include <vector>

#include "depth_image/fit.hpp"

namespace penumbra {

// One line for the report, and warnings where it matters. `where`: the image's key.
std::string quality_note(const DepthQuality& quality, const std::string& where);
std::vector<std::string> quality_warnings(const DepthQuality& quality, const std::string& where);

} // namespace penumbra
