#include "masks/mask_cache.hpp"

#include <algorithm>
#include <vector>

#include <penumbra/describe.hpp>

namespace penumbra::server {
namespace {

// The entry of that key, moved to the front.
template <class List> auto find(List& list, const std::string& key)
{
    const auto found = std::ranges::find(list, key, &List::value_type::first);
    if (found != list.end()) list.splice(list.begin(), list, found);
    return found;
}

template <class List, class Value> void put(List& list, const std::string& key, Value&& value, std::size_t most)
{
    if (key.empty()) return;
    if (const auto found = find(list, key); found != list.end()) {
        found->second = std::forward<Value>(value);
        return;
    }
    list.emplace_front(key, std::forward<Value>(value));
    if (list.size() > most) list.pop_back();
}

} // namespace

std::optional<Prepared> MaskCache::prepared(const std::string& key)
{
    const std::scoped_lock lock(mutex_);
    const auto found = find(prepared_, key);
    return found == prepared_.end() ? std::nullopt : std::optional(found->second);
}

void MaskCache::keep(const std::string& key, const Prepared& prepared)
{
    const std::scoped_lock lock(mutex_);
    put(prepared_, key, prepared, most_);
}

std::shared_ptr<const Receivers> MaskCache::receivers(const std::string& key)
{
    const std::scoped_lock lock(mutex_);
    const auto found = find(receivers_, key);
    return found == receivers_.end() ? nullptr : found->second;
}

void MaskCache::keep(const std::string& key, std::shared_ptr<const Receivers> receivers)
{
    const std::scoped_lock lock(mutex_);
    put(receivers_, key, std::move(receivers), most_);
}

void MaskCache::clear()
{
    const std::scoped_lock lock(mutex_);
    prepared_.clear();
    receivers_.clear();
}

std::uint64_t MaskCache::host_bytes() const
{
    const std::scoped_lock lock(mutex_);
    std::uint64_t bytes = 0;
    for (const auto& [key, receivers] : receivers_)
        if (receivers->depth) bytes += receivers->depth->depth.size() * sizeof(float);
    return bytes;
}

std::uint64_t MaskCache::device_bytes() const
{
    const std::scoped_lock lock(mutex_);
    std::vector<Prepared> all;
    for (const auto& [key, prepared] : prepared_) all.push_back(prepared);
    return penumbra::device_bytes(all);
}

} // namespace penumbra::server
