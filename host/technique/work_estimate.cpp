#include "technique/work_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace penumbra {

// Along a sequence that fills the plane evenly: its steps are powers of 1 over the plastic number, 1.3247.
std::vector<int> spread_numbers(int columns, int rows, int count)
{
    constexpr double step_x = 0.7548776662466927, step_y = 0.5698402909980532;
    const auto place = [](double step, int k, int size) { return std::min(static_cast<int>(std::fmod(0.5 + step * k, 1.0) * size), size - 1); };
    std::vector<int> numbers;
    numbers.reserve(static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k) numbers.push_back(place(step_y, k, rows) * columns + place(step_x, k, columns));
    return numbers;
}

int tile_count(const ReceiverView& view) { return view.stride / TILE_WIDTH * (view.rows / tile_rows); }

ChosenTiles chosen_tiles(opencl::Work& work, const ReceiverPoints& points, const opencl::Specialisation& program, int count)
{
    const int columns = points.view.stride / TILE_WIDTH, rows = points.view.rows / tile_rows;
    const std::vector<cl_int> numbers = spread_numbers(columns, rows, count);
    const auto tiles = work.upload(std::span<const cl_int>(numbers), "tiles of a sample");

    ChosenTiles chosen{.points = {.view = points.view, .precision = points.precision, .xi = {}, .eta = {}, .d = {}, .planes = {}, .has_planes = points.has_planes, .is_list = points.is_list},
                       .times = static_cast<double>(tile_count(points.view)) / count};
    ReceiverPoints& some = chosen.points;
    some.view.width = some.view.stride = TILE_WIDTH;
    some.view.height = some.view.rows = count * tile_rows;
    const auto room = [&] { return work.buffer<float>(static_cast<std::size_t>(count) * TILE_WIDTH * tile_rows, "receivers of a sample"); };
    some.xi = room();
    some.eta = room();
    some.d = room();
    if (points.has_planes) some.planes = work.buffer<float>(3 * some.d.count(), "receivers' planes of a sample");
    work.launch(program, "chosen_tiles", {TILE_WIDTH, static_cast<std::size_t>(some.view.rows)}, {TILE_WIDTH, tile_rows}, some.d.bytes() * 6, points.view, tiles,
                static_cast<cl_int>(count), static_cast<cl_int>(points.has_planes), points.xi, points.eta, points.d, points.planes, some.xi, some.eta, some.d,
                some.planes);
    return chosen;
}

} // namespace penumbra
