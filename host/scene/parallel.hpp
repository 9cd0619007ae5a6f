// A loop over rows on every core that the process may use.
#pragma once

#include <functional>

namespace penumbra {

// PENUMBRA_THREADS when set (1 to 1024), else the number of processors in the process's affinity mask.
unsigned thread_count();

// Calls body(i) for 0 <= i < count, each once, from several threads; rethrows the first exception.
void parallel_for(int count, const std::function<void(int)>& body);

} // namespace penumbra
