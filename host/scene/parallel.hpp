// A loop over rows on every core that the process may use.
#pragma once

#include <functional>

namespace penumbra {

// How many processors this process may use (taskset, batch systems, containers), by its affinity mask; where the system hides that, how
// many there are.
unsigned processor_count();

// PENUMBRA_THREADS when set (1 to 1024), else processor_count().
unsigned thread_count();

// Calls body(i) for 0 <= i < count, each once, from several threads; rethrows the first exception. Between calls it ends where it
// is to stop (scene/stop.hpp).
void parallel_for(int count, const std::function<void(int)>& body);

} // namespace penumbra
