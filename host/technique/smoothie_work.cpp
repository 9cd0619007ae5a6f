#include "technique/smoothie_work.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace penumbra {
namespace {

// Texels of a work-item: between which places, and the furthest receiver's disparity.
struct Item {
    float x0, x1, y0, y1, furthest;
};

Item item_at(const SmoothieView& view, const SmoothieGrid& grid, int column, int row, const std::vector<cl_int>& nearest, const std::vector<cl_int>& furthest)
{
    const int x = column * grid.lanes, y = row * SmoothieGrid::item_rows;
    Item item{.x0 = view.left + static_cast<float>(x) * view.step_x,
              .x1 = view.left + static_cast<float>(x + grid.lanes - 1) * view.step_x,
              .y0 = view.top - static_cast<float>(y + SmoothieGrid::item_rows - 1) * view.step_y,
              .y1 = view.top - static_cast<float>(y) * view.step_y,
              .furthest = NO_RECEIVER};
    for (int j = y; j < std::min(y + SmoothieGrid::item_rows, view.height); ++j)
        for (int i = x; i < std::min(x + grid.lanes, view.width); ++i) {
            const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(i);
            item.furthest = std::min(item.furthest, nearest[at] == 0 ? 0.0F : std::bit_cast<float>(furthest[at]));
        }
    return item;
}

// The kernel's `reach`, of box number `i` of a block of 16.
bool reaches(const SmoothieView& view, const float* boxes, int i, const Item& item)
{
    const float near = boxes[64 + i];
    if (!(near > 0)) return false;
    float width = view.fixed_width;
    if (width == 0) width = view.light * (view.orthographic ? 1 / std::max(item.furthest, 0x1p-120F) : near);
    return boxes[16 + i] + width >= item.x0 && boxes[i] - width <= item.x1 && boxes[48 + i] + width >= item.y0 && boxes[32 + i] - width <= item.y1;
}

std::size_t edges_met(const SmoothieView& view, const SmoothieBoxes& boxes, const Item& item)
{
    std::size_t met = 0;
    for (int group = 0; group < view.groups; ++group) {
        if (!reaches(view, boxes.groups.data() + static_cast<std::ptrdiff_t>(group / 16) * 80, group % 16, item)) continue;
        const float* const own = boxes.edges.data() + static_cast<std::ptrdiff_t>(group) * 80;
        for (int i = 0; i < SMOOTHIE_GROUP; ++i) met += reaches(view, own, i, item);
    }
    return met;
}

} // namespace

double smoothie_rate(std::size_t all_rows, const std::function<SmoothieSample(std::size_t rows)>& search)
{
    constexpr double enough_seconds = 0.02;
    for (std::size_t rows = 1;; rows *= 2) {
        const SmoothieSample sample = search(std::min(rows, all_rows));
        // The first launch loads the kernel.
        if (rows > 1 && sample.pairs > 0 && sample.seconds >= enough_seconds) return sample.pairs / sample.seconds;
        if (rows >= all_rows) return sample.pairs > 0 ? sample.pairs / sample.seconds : HUGE_VAL;
    }
}

WorkAmount estimate_smoothie(const SmoothieView& view, const SmoothieGrid& grid, const SmoothieBoxes& boxes, const std::vector<cl_int>& nearest,
                             const std::vector<cl_int>& furthest)
{
    // As many as a few milliseconds allow where there are hundreds of thousands of edges.
    const std::vector<int> some = spread_numbers(grid.columns, grid.rows, static_cast<int>(std::min<std::size_t>(grid.items(), 64)));
    double pairs = 0;
    for (const int number : some)
        pairs += static_cast<double>(edges_met(view, boxes, item_at(view, grid, number % grid.columns, number / grid.columns, nearest, furthest)));
    return smoothie_pairs.of(pairs * grid.item_texels() * static_cast<double>(grid.items()) / static_cast<double>(some.size()));
}

} // namespace penumbra
