// How much work a scene may ask for.
#pragma once

#include <functional>

#include "masks/masks.hpp"
#include "process/options.hpp"

namespace penumbra::server {

// Throws too_large where a task's sizes alone are over what the options allow, naming the key and the limit. The work of all its lights counts.
void check_work(const MaskTask& task, const Options& options);

// What MaskHooks::estimated is to do: throws too_large for more pairs or rays than the options allow, and for work that would certainly not end
// within the deadline. Nothing where the task's sizes tell that it cannot come to that: then nobody needs to estimate. `deadline` and `options`
// outlive it.
std::function<void(const WorkAmount&)> estimate_check(const MaskTask& task, const Options& options, const Deadline& deadline);

} // namespace penumbra::server
