// An order in which groups of WEDGE_GROUP things, and groups of as many groups, take little room each.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

#include "common/shared.h"
#include "scene/stop.hpp"

namespace penumbra {

// What lies beside each other comes beside each other: ranges are cut in two, in whole groups (of groups), where `Keys` spread most.
template <std::size_t count> class SpatialOrder {
public:
    using Keys = std::array<float, count>;

    explicit SpatialOrder(std::vector<Keys> keys) : keys_(std::move(keys)), order_(keys_.size())
    {
        std::iota(order_.begin(), order_.end(), 0U);
        cut(0, order_.size());
    }
    const std::vector<std::uint32_t>& get() const { return order_; }

private:
    void cut(std::size_t begin, std::size_t end)
    {
        const std::size_t size = end - begin;
        if (size <= WEDGE_GROUP) return;
        if (size > 65536) check_stop();
        Keys low = keys_[order_[begin]], high = low;
        for (std::size_t i = begin; i < end; ++i)
            for (std::size_t k = 0; k < count; ++k) {
                low[k] = std::min(low[k], keys_[order_[i]][k]);
                high[k] = std::max(high[k], keys_[order_[i]][k]);
            }
        std::size_t widest = 0;
        for (std::size_t k = 1; k < count; ++k)
            if (high[k] - low[k] > high[widest] - low[widest]) widest = k;
        constexpr std::size_t group = WEDGE_GROUP;
        const std::size_t unit = size > group * group ? group * group : group;
        const std::size_t middle = begin + (size / 2 + unit - 1) / unit * unit;
        const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
        std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
            return keys_[a][widest] != keys_[b][widest] ? keys_[a][widest] < keys_[b][widest] : a < b;
        });
        cut(begin, middle);
        cut(middle, end);
    }

    std::vector<Keys> keys_;
    std::vector<std::uint32_t> order_;
};

} // namespace penumbra
