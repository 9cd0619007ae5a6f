// What shading will take, told by a spread sample of the receivers: what culls and searches in kernels cannot be counted by anything else.
#pragma once

#include <algorithm>
#include <chrono>
#include <string_view>

#include <penumbra/mask_job.hpp>

#include "technique/receiver_points.hpp"
#include "technique/verbs.hpp"

namespace penumbra {

// What a technique counts.
struct WorkKind {
    std::string_view key; // of the scene file, that asks for it
    WorkAmount::Unit unit;
    std::string_view what;
    constexpr WorkAmount of(double amount, double seconds = 0) const { return {.key = key, .amount = amount, .unit = unit, .what = what, .seconds = seconds}; }
};

// Numbers of `count` of columns x rows things, row by row, spread evenly.
std::vector<int> spread_numbers(int columns, int rows, int count);

// Some tiles of the receivers, as receivers of their own.
struct ChosenTiles {
    ReceiverPoints points;
    double times; // as many are there in all
};

// Of a sample: one tile of 16, but 16 to 256 of them. The first few tell whether more are worth their time.
constexpr int few_tiles = 16, many_tiles = 256;
constexpr double quick_seconds = 0.05;
int tile_count(const ReceiverView& view);

// So many, spread evenly over the mask. `program`: one that has the kernel.
ChosenTiles chosen_tiles(opencl::Work& work, const ReceiverPoints& points, const opencl::Specialisation& program, int count);

// Shades `count` tiles by shade(points, visibility, counts), and takes what that took for all.
template <class Shade>
WorkAmount estimate_by_tiles(opencl::Work& work, const ReceiverPoints& points, const opencl::Specialisation& program, int count, int channels, const WorkKind& kind, const Shade& shade)
{
    const ChosenTiles chosen = chosen_tiles(work, points, program, count);
    const auto visibility = work.buffer<float>(chosen.points.d.count() * static_cast<std::size_t>(channels), "visibility of a sample");
    ShadeCounts counts;
    const double compiled_ms = work.compile_ms();
    const auto start = std::chrono::steady_clock::now();
    shade(chosen.points, visibility.memory(), counts);
    work.read(visibility); // waits for the device
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() - (work.compile_ms() - compiled_ms) / 1000;
    return kind.of(static_cast<double>(counts.pairs) * chosen.times, seconds * chosen.times);
}

template <class Shade>
WorkAmount estimate_by_sample(opencl::Work& work, const ReceiverPoints& points, const opencl::Specialisation& program, int channels, const WorkKind& kind, const Shade& shade)
{
    const int all = tile_count(points.view), few = std::min(all, few_tiles), many = std::min(all, std::clamp(all / 16, few_tiles, many_tiles));
    const WorkAmount first = estimate_by_tiles(work, points, program, few, channels, kind, shade);
    if (many == few || first.seconds * few > quick_seconds * all) return first;
    return estimate_by_tiles(work, points, program, many, channels, kind, shade);
}

} // namespace penumbra
