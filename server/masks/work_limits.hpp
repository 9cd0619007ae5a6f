// How much work a scene may ask for.
#pragma once

#include "masks/masks.hpp"
#include "process/options.hpp"

namespace penumbra::server {

// Throws too_large for more work than the options allow, naming the key and the limit. The work of all the task's lights counts.
void check_work(const MaskTask& task, const Options& options);

} // namespace penumbra::server
