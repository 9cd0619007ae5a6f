// How the work-items of kernels that are made for LANES receivers share them.
#pragma once

#include <array>
#include <cstdint>

#include "technique/receiver_points.hpp"

namespace penumbra {

// Rows of a tile that one work-item owns: all of them, or on devices that vectorise by themselves one.
inline int item_rows(int lanes) { return lanes == 1 ? 1 : tile_rows; }

// On a GPU a tile is a work-group; on a CPU device a work-item, and groups of one keep the share of each thread fine.
struct Tiling {
    std::array<std::size_t, 2> items, group;
    std::uint64_t bytes; // of the receivers and their mask
};
inline Tiling tiling_of(const ReceiverView& view, int lanes)
{
    const auto width = static_cast<std::size_t>(view.stride), height = static_cast<std::size_t>(view.rows);
    return {.items = {width / static_cast<std::size_t>(lanes), height / static_cast<std::size_t>(item_rows(lanes))},
            .group = lanes == 1 ? std::array<std::size_t, 2>{TILE_WIDTH, tile_rows} : std::array<std::size_t, 2>{1, 1},
            .bytes = width * height * 16};
}

} // namespace penumbra
