// The depth that a scene's receivers have, as the service reads it: small, for a client that wants to know how far things are.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <penumbra/image.hpp>
#include <penumbra/scene.hpp>

namespace penumbra::server {

constexpr int default_depth_side = 512, max_depth_side = 4096;

// The largest side that the query asks for. Throws Problem 400 for another parameter than side, and for what is no such number.
int depth_side_from(const std::vector<std::pair<std::string, std::string>>& query);

// Planar depth, +infinity where nothing is: pixels of the receivers' image, none between them, so many apart that no side is longer than
// `side`. Throws Error where the receivers have no depth image.
Image depth_view(const Receivers& receivers, int side);

} // namespace penumbra::server
