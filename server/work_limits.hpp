// How much work a scene may ask for.
#pragma once

#include <penumbra/scene.hpp>
#include <penumbra/technique.hpp>

#include "options.hpp"

namespace penumbra::server {

// Throws too_large for more work than the options allow, naming the key and the limit.
void check_work(const Occluders& occluders, const Receivers& receivers, const Technique& technique, const Options& options);

} // namespace penumbra::server
