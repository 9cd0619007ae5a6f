#include "scene/stop.hpp"

#include <utility>

namespace penumbra {
namespace {

thread_local std::shared_ptr<StopWord> current;

} // namespace

StopScope::StopScope(std::shared_ptr<StopWord> word) : before_(std::exchange(current, std::move(word))) {}

StopScope::~StopScope() { current = std::move(before_); }

const std::shared_ptr<StopWord>& current_stop() { return current; }

void check_stop(const StopWord* word)
{
    if (word && word->asked.load(std::memory_order_relaxed) != 0) throw Stopped();
}

} // namespace penumbra
