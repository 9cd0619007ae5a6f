// Walking through a topology's edges and sides.
#pragma once

#include <cstddef>

#include "scene/stop.hpp"
#include "silhouette/silhouette.hpp"

namespace penumbra {

// A triangle's side as one number, 3 triangle + corner.
constexpr std::uint32_t no_side = 0xffffffff;
inline std::uint32_t side_of(const Topology::EdgeUse& use) { return 3 * use.triangle + use.corner; }

// Calls f with the uses of one edge after the other.
template <class F> void for_each_edge(std::span<const Topology::EdgeUse> uses, F&& f)
{
    for (std::size_t begin = 0; begin < uses.size();) {
        std::size_t end = begin + 1;
        while (end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high) ++end;
        if (begin / 4096 != end / 4096) check_stop();
        f(uses.subspan(begin, end - begin));
        begin = end;
    }
}

} // namespace penumbra
