// The kept scenes: for a while, within a budget.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <algorithm>
#include <string>
#include <string_view>

#include "masks/kept_scene.hpp"
#include "process/problem.hpp"

namespace penumbra::server {

// `Scene` has an id(), bytes() and device_bytes() that it holds now, and forget_results() to hold less. The longest unused goes first. Safe to use from several threads at once.
template <class Scene> class StoreOf {
public:
    using Clock = std::chrono::steady_clock;
    using Now = std::function<Clock::time_point()>;
    // At most `bytes`, as the scenes count them, and `most` scenes, each until `time` after its last use.
    StoreOf(std::uint64_t bytes, std::size_t most, Clock::duration time, Now now = Clock::now)
        : budget_(bytes), most_(most), time_(time), now_(std::move(now))
    {
    }

    // Nothing when there is none of that id, or no longer. `use`: it counts as used now.
    std::shared_ptr<Scene> find(std::string_view id, bool use);
    // Throws Problem 413 for one that is larger than the whole budget.
    void keep(const std::shared_ptr<Scene>& scene);
    bool forget(std::string_view id);
    void clear();
    // Lets go of the longest unused; false when there is none.
    bool forget_one();
    // Whole seconds that the scene has left.
    std::int64_t seconds_left(std::string_view id);
    // Lets go what is too old or too much; to be called when a scene has grown by its use.
    void tidy();

    struct Counts {
        std::size_t scenes;
        std::uint64_t bytes, device_bytes;
    };
    Counts counts();

private:
    struct Entry {
        std::shared_ptr<Scene> scene;
        Clock::time_point used;
    };
    typename std::list<Entry>::iterator at(std::string_view id);
    void tidy_locked();
    std::uint64_t bytes_locked() const;

    const std::uint64_t budget_;
    const std::size_t most_;
    const Clock::duration time_;
    const Now now_;
    std::mutex mutex_;
    std::list<Entry> entries_; // the last used in front
};

template <class Scene> typename std::list<typename StoreOf<Scene>::Entry>::iterator StoreOf<Scene>::at(std::string_view id)
{
    return std::ranges::find_if(entries_, [id](const Entry& entry) { return entry.scene->id() == id; });
}

template <class Scene> std::shared_ptr<Scene> StoreOf<Scene>::find(std::string_view id, bool use)
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

template <class Scene> void StoreOf<Scene>::keep(const std::shared_ptr<Scene>& scene)
{
    const std::uint64_t bytes = scene->bytes();
    if (bytes > budget_)
        throw Problem(413, "scenes_bytes",
                      "the scene takes " + std::to_string(bytes) + " bytes to keep; the scenes that a worker keeps may take together " +
                          std::to_string(budget_));
    const std::scoped_lock lock(mutex_);
    if (const auto found = at(scene->id()); found != entries_.end()) entries_.erase(found);
    entries_.push_front({scene, now_()});
    tidy_locked();
}

template <class Scene> bool StoreOf<Scene>::forget(std::string_view id)
{
    const std::scoped_lock lock(mutex_);
    const auto found = at(id);
    if (found == entries_.end()) return false;
    entries_.erase(found);
    return true;
}

template <class Scene> void StoreOf<Scene>::clear()
{
    const std::scoped_lock lock(mutex_);
    entries_.clear();
}

template <class Scene> bool StoreOf<Scene>::forget_one()
{
    std::shared_ptr<Scene> gone; // after the lock
    const std::scoped_lock lock(mutex_);
    if (entries_.empty()) return false;
    gone = std::move(entries_.back().scene);
    entries_.pop_back();
    return true;
}

template <class Scene> std::int64_t StoreOf<Scene>::seconds_left(std::string_view id)
{
    const std::scoped_lock lock(mutex_);
    const auto found = at(id);
    if (found == entries_.end()) return 0;
    return std::max<std::int64_t>(0, std::chrono::duration_cast<std::chrono::seconds>(found->used + time_ - now_()).count());
}

template <class Scene> void StoreOf<Scene>::tidy()
{
    const std::scoped_lock lock(mutex_);
    tidy_locked();
}

template <class Scene> typename StoreOf<Scene>::Counts StoreOf<Scene>::counts()
{
    const std::scoped_lock lock(mutex_);
    tidy_locked();
    Counts counts{entries_.size(), bytes_locked(), 0};
    for (const Entry& entry : entries_) counts.device_bytes += entry.scene->device_bytes();
    return counts;
}

template <class Scene> std::uint64_t StoreOf<Scene>::bytes_locked() const
{
    std::uint64_t bytes = 0;
    for (const Entry& entry : entries_) bytes += entry.scene->bytes();
    return bytes;
}

template <class Scene> void StoreOf<Scene>::tidy_locked()
{
    const Clock::time_point now = now_();
    std::erase_if(entries_, [&](const Entry& entry) { return now - entry.used >= time_; });
    while (entries_.size() > most_ || (entries_.size() > 1 && bytes_locked() > budget_)) entries_.pop_back();
    // The last one fitted when it came; what its use has added goes.
    if (bytes_locked() > budget_) entries_.front().scene->forget_results();
}

// What a worker keeps, decoded and prepared.
using SceneStore = StoreOf<KeptScene>;

} // namespace penumbra::server
