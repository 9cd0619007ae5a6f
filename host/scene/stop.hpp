// Where long work looks whether it is to end (penumbra/stop.hpp).
#pragma once

#include <penumbra/stop.hpp>

namespace penumbra {

// Of the innermost scope of this thread; null outside of any.
const std::shared_ptr<StopWord>& current_stop();

// Throws Stopped when the word says so.
void check_stop(const StopWord* word);
inline void check_stop() { check_stop(current_stop().get()); }

} // namespace penumbra
