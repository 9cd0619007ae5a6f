// Is the device fit to work? A tiny mask that is known in closed form, and every technique's kernels built and launched once.
#pragma once

#include <penumbra/engine.hpp>

namespace penumbra::server {

// Throws device when the known mask comes out wrong; and whatever the engine throws.
void check_known_mask(const Engine& engine);

// Launches every technique in every choice of its settings, so that no request pays for a compiler.
void warm(const Engine& engine);

} // namespace penumbra::server
