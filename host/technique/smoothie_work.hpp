// What the search for smoothies' edges takes, counted on the host for some of the kernel's work-items.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "technique/work_estimate.hpp"

namespace penumbra {

constexpr WorkKind smoothie_pairs{"occluders.resolution", WorkAmount::Unit::pairs, "pairs of texel and edge"};

// Work-items of smoothie_buffer: each owns `lanes` x `item_rows` texels.
struct SmoothieGrid {
    static constexpr int item_rows = 8;
    int lanes, columns, rows;
    std::size_t items() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
    int item_texels() const { return lanes * item_rows; }
};

// SmoothieEdges::boxes and edge_boxes.
struct SmoothieBoxes {
    std::vector<float> groups, edges;
};

// So few take some seconds at the most, and are not worth a sample.
constexpr double few_smoothie_pairs = 0x1p33;

struct SmoothieSample {
    double pairs, seconds;
};
// Pairs a second, of search(rows): the first rows of work-items, as many as take a few milliseconds. Infinite where they met no edge.
double smoothie_rate(std::size_t all_rows, const std::function<SmoothieSample(std::size_t rows)>& search);

// `nearest`, `furthest`: of the receivers of each texel, as bits.
WorkAmount estimate_smoothie(const SmoothieView& view, const SmoothieGrid& grid, const SmoothieBoxes& boxes, const std::vector<cl_int>& nearest,
                             const std::vector<cl_int>& furthest);

} // namespace penumbra
