#include "masks/crashes.hpp"

#include <algorithm>

#include "process/problem.hpp"

namespace penumbra::server {

std::list<Crashes::Entry>::iterator Crashes::at(const std::string& digest) { return std::ranges::find(entries_, digest, &Entry::digest); }

void Crashes::note(const std::string& digest)
{
    const std::scoped_lock lock(mutex_);
    auto entry = at(digest);
    if (entry == entries_.end()) entry = entries_.insert(entries_.begin(), {digest, 0, {}});
    entries_.splice(entries_.begin(), entries_, entry);
    ++entry->deaths;
    entry->last = now_();
    if (entries_.size() > most_requests) entries_.pop_back();
    any_ = true;
}

void Crashes::absolve(const std::string& digest)
{
    const std::scoped_lock lock(mutex_);
    if (const auto entry = at(digest); entry != entries_.end()) entries_.erase(entry);
    any_ = !entries_.empty();
}

void Crashes::tidy()
{
    std::erase_if(entries_, [now = now_()](const Entry& entry) { return now - entry.last >= time; });
    any_ = !entries_.empty();
}

void Crashes::check(const std::string& digest)
{
    const std::scoped_lock lock(mutex_);
    tidy();
    const auto entry = at(digest);
    if (entry == entries_.end() || entry->deaths < most_deaths) return;
    const auto left = std::chrono::duration_cast<std::chrono::seconds>(entry->last + time - now_()).count() + 1;
    throw Problem(422, "crashed", "this request ended " + std::to_string(entry->deaths) + " of the service's processes and is not tried again for a while",
                  static_cast<int>(left));
}

} // namespace penumbra::server
