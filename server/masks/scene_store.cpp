#include "masks/scene_store.hpp"

#include <algorithm>
#include <string>

#include "process/problem.hpp"

namespace penumbra::server {

std::list<SceneStore::Entry>::iterator SceneStore::at(std::string_view id)
{
    return std::ranges::find_if(entries_, [id](const Entry& entry) { return entry.scene->id() == id; });
}

std::shared_ptr<KeptScene> SceneStore::find(std::string_view id, bool use)
{
    const std::scoped_lock lock(mutex_);
    tidy_locked();
    const auto found = at(id);
    if (found == entries_.end()) return nullptr;
    if (use) {
        found->used = now_();
        entries_.splice(entries_.begin(), entries_, found);
    }
    return found->scene;
}

void SceneStore::keep(const std::shared_ptr<KeptScene>& scene)
{
    const std::uint64_t bytes = scene->bytes();
    if (bytes > budget_)
        throw Problem(413, "scenes_bytes",
                      "the scene takes " + std::to_string(bytes) + " bytes to keep; all kept scenes together may take " +
                          std::to_string(budget_));
    const std::scoped_lock lock(mutex_);
    if (const auto found = at(scene->id()); found != entries_.end()) entries_.erase(found);
    entries_.push_front({scene, now_()});
    tidy_locked();
}

bool SceneStore::forget(std::string_view id)
{
    const std::scoped_lock lock(mutex_);
    const auto found = at(id);
    if (found == entries_.end()) return false;
    entries_.erase(found);
    return true;
}

std::int64_t SceneStore::seconds_left(std::string_view id)
{
    const std::scoped_lock lock(mutex_);
    const auto found = at(id);
    if (found == entries_.end()) return 0;
    return std::max<std::int64_t>(0, std::chrono::duration_cast<std::chrono::seconds>(found->used + time_ - now_()).count());
}

void SceneStore::tidy()
{
    const std::scoped_lock lock(mutex_);
    tidy_locked();
}

SceneStore::Counts SceneStore::counts()
{
    const std::scoped_lock lock(mutex_);
    tidy_locked();
    Counts counts{entries_.size(), bytes_locked(), 0};
    for (const Entry& entry : entries_) counts.device_bytes += entry.scene->device_bytes();
    return counts;
}

std::uint64_t SceneStore::bytes_locked() const
{
    std::uint64_t bytes = 0;
    for (const Entry& entry : entries_) bytes += entry.scene->bytes();
    return bytes;
}

void SceneStore::tidy_locked()
{
    const Clock::time_point now = now_();
    std::erase_if(entries_, [&](const Entry& entry) { return now - entry.used >= time_; });
    while (entries_.size() > most_ || (entries_.size() > 1 && bytes_locked() > budget_)) entries_.pop_back();
    // The last one fitted when it came; what its use has added goes.
    if (bytes_locked() > budget_) entries_.front().scene->forget_results();
}

} // namespace penumbra::server
