// What was made on the way to the last masks of one scene, so that the next one starts from it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <penumbra/engine.hpp>

namespace penumbra::server {

// Keys are texts that say all that the value was made from; an empty key is never kept. The longest unused goes first. Safe to use from
// several threads at once.
class MaskCache {
public:
    explicit MaskCache(std::size_t lights) : most_(4 * std::max<std::size_t>(lights, 1)) {}
    std::optional<Prepared> prepared(const std::string& key);
    void keep(const std::string& key, const Prepared& prepared);
    std::shared_ptr<const Receivers> receivers(const std::string& key);
    void keep(const std::string& key, std::shared_ptr<const Receivers> receivers);

    void clear();
    std::uint64_t host_bytes() const, device_bytes() const;

private:
    const std::size_t most_; // of each: a few techniques side by side, as a comparison needs, for each light
    mutable std::mutex mutex_;
    std::list<std::pair<std::string, Prepared>> prepared_; // the last used in front
    std::list<std::pair<std::string, std::shared_ptr<const Receivers>>> receivers_;
};

} // namespace penumbra::server
