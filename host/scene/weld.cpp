#include "scene/weld.hpp"

#include <bit>

namespace penumbra {
namespace {

constexpr std::uint32_t empty = 0xffffffff;

// The finaliser of MurmurHash3, once for each half of the key.
std::uint64_t mix(std::uint64_t h)
{
    h = (h ^ (h >> 33)) * 0xff51afd7ed558ccdu;
    h = (h ^ (h >> 33)) * 0xc4ceb9fe1a85ec53u;
    return h ^ (h >> 33);
}

std::size_t hash(const Imath::V3f& p)
{
    const auto bits = [](float f) { return static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(f)); };
    return static_cast<std::size_t>(mix(mix(bits(p.x) << 32 | bits(p.y)) ^ bits(p.z)));
}

} // namespace

Welder::Welder(std::vector<Imath::V3f>& places, std::size_t expected) : places_(places), first_(places.size()) { reserve(expected); }

std::uint32_t Welder::operator()(const Imath::V3f& position)
{
    if (2 * (places_.size() - first_) >= slots_.size()) reserve(slots_.size());
    const Imath::V3f place(position.x + 0.0f, position.y + 0.0f, position.z + 0.0f); // -0 becomes 0
    std::uint32_t& slot = slots_[slot_of(place)];
    if (slot == empty) {
        slot = static_cast<std::uint32_t>(places_.size());
        places_.push_back(place);
    }
    return slot;
}

void Welder::reserve(std::size_t expected)
{
    const std::size_t size = std::bit_ceil(2 * expected + 1);
    if (size <= slots_.size()) return;
    slots_.assign(size, empty);
    for (std::size_t i = first_; i < places_.size(); ++i) slots_[slot_of(places_[i])] = static_cast<std::uint32_t>(i);
}

std::size_t Welder::slot_of(const Imath::V3f& place) const
{
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = hash(place) & mask;
    while (slots_[slot] != empty && places_[slots_[slot]] != place) slot = (slot + 1) & mask;
    return slot;
}

} // namespace penumbra
