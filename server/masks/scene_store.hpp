// The kept scenes: for a while, within a budget.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string_view>

#include "masks/kept_scene.hpp"

namespace penumbra::server {

// The longest unused goes first. Safe to use from several threads at once.
class SceneStore {
public:
    using Clock = std::chrono::steady_clock;
    using Now = std::function<Clock::time_point()>;
    // At most `bytes`, as KeptScene counts them, and `most` scenes, each until `time` after its last use.
    SceneStore(std::uint64_t bytes, std::size_t most, Clock::duration time, Now now = Clock::now)
        : budget_(bytes), most_(most), time_(time), now_(std::move(now))
    {
    }

    // Nothing when there is none of that id, or no longer. `use`: it counts as used now.
    std::shared_ptr<KeptScene> find(std::string_view id, bool use);
    // Throws Problem 413 for one that is larger than the whole budget.
    void keep(const std::shared_ptr<KeptScene>& scene);
    bool forget(std::string_view id);
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
        std::shared_ptr<KeptScene> scene;
        Clock::time_point used;
    };
    std::list<Entry>::iterator at(std::string_view id);
    void tidy_locked();
    std::uint64_t bytes_locked() const;

    const std::uint64_t budget_;
    const std::size_t most_;
    const Clock::duration time_;
    const Now now_;
    std::mutex mutex_;
    std::list<Entry> entries_; // the last used in front
};

} // namespace penumbra::server
