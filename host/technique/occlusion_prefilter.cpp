#include "technique/occlusion_prefilter.hpp"

#include <algorithm>

#include <penumbra/error.hpp>

namespace penumbra {

void set_levels(MarkedSlices& marked, LevelKind kind, bool directional)
{
    for (OcclusionPlane& plane : marked.planes) {
        const double size = std::max(2.0 * plane.half_x / marked.taps[0], 2.0 * plane.half_y / marked.taps[1]);
        plane.levels = levels_for(directional && size > 0 ? 1e30 : size, marked.view.width, kind);
    }
}

LevelLayout layout_of(const MarkedSlices& marked, LevelKind kind)
{
    const std::uint64_t side = static_cast<std::uint64_t>(marked.view.width);
    if (kind == LevelKind::table) return {.levels = {}, .textures = {}, .elements = marked.planes.size() * (side + 1) * (side + 1)};
    std::vector<int> levels;
    levels.reserve(marked.planes.size());
    for (const OcclusionPlane& plane : marked.planes) levels.push_back(plane.levels);
    return level_layout(levels, marked.view.width, kind);
}

namespace {

// What the same slices would take with `side` texels: kernels have fewer texels in proportion.
std::uint64_t elements_at(MarkedSlices marked, int side, LevelKind kind, bool directional)
{
    const float scale = static_cast<float>(side) / static_cast<float>(marked.view.width);
    marked.view.width = marked.view.height = side;
    for (OcclusionPlane& plane : marked.planes) {
        plane.half_x *= scale;
        plane.half_y *= scale;
    }
    set_levels(marked, kind, directional);
    return layout_of(marked, kind).elements;
}

// A hint that holds: resolutions are tried, and slices counted as the largest of them, the nearest.
std::string what_fits(const MarkedSlices& marked, std::uint64_t most, LevelKind kind, bool directional, const OcclusionTexture& settings)
{
    int fits = 0;
    for (int low = 4, high = settings.resolution; low <= high;) {
        const int side = (low + high) / 2;
        if (elements_at(marked, side, kind, directional) <= most) {
            fits = side;
            low = side + 1;
        } else {
            high = side - 1;
        }
    }
    MarkedSlices nearest = marked;
    nearest.planes.resize(1);
    const bool layered = is_layered(settings);
    const std::uint64_t slices = most / layout_of(nearest, kind).elements / static_cast<std::uint64_t>(layered ? settings.layers : 1);
    if (fits == 0)
        return slices == 0 ? "expected fewer slices and a lower resolution" : "expected at most " + std::to_string(slices) + " slices";
    return "a resolution of " + std::to_string(fits) + " would fit" +
           (slices == 0 ? "" : ", or " + std::to_string(std::min(slices, static_cast<std::uint64_t>(settings.slices))) + " slices");
}

} // namespace

void check_memory(const opencl::Context& context, const MarkedSlices& marked, std::uint64_t elements, LevelKind kind, bool directional,
                  const OcclusionTexture& settings)
{
    const DeviceInfo& device = context.info();
    const std::uint64_t most = std::min(device.max_allocation_bytes, device.global_bytes), size = element_size(kind, settings);
    if (elements * size <= most) return;
    throw Error::at(ErrorCode::too_large, "technique.resolution",
                    std::to_string(settings.slices) + " slices of " + std::to_string(settings.resolution) + " texels each way take " +
                        std::to_string(elements * size) + " bytes, the device allows " + std::to_string(most),
                    what_fits(marked, most / size, kind, directional, settings));
}

void build_tables(opencl::Work& work, const opencl::Specialisation& program, const MarkedSlices& marked, const OcclusionTexture& settings,
                  const opencl::Buffer<OcclusionPlane>& planes, const opencl::Buffer<cl_uchar>& data)
{
    const std::size_t side = static_cast<std::size_t>(marked.view.width), count = marked.planes.size();
    work.launch(program, "table_rows", {side + 1, count}, {16, 1}, side * side * 8 + data.bytes(), size_of(marked.view),
                static_cast<cl_int>(count), static_cast<cl_int>(settings.layers - 1), static_cast<cl_int>(settings.leak_fix), planes,
                marked.occupancy, data);
    work.launch(program, "table_columns", {side + 1, count}, {16, 1}, 2 * data.bytes(), size_of(marked.view), static_cast<cl_int>(count),
                data);
}

void build_levels(opencl::Work& work, const opencl::Specialisation& program, const MarkedSlices& marked, const OcclusionTexture& settings,
                  LevelKind kind, const LevelLayout& layout, const opencl::Buffer<OcclusionPlane>& planes,
                  const opencl::Buffer<cl_uchar>& data)
{
    const std::uint64_t size = element_size(kind, settings);
    const auto grid = [&](std::size_t level) {
        return static_cast<std::size_t>(layout.levels[level].rows) * static_cast<std::size_t>(layout.textures[level]);
    };
    const auto bytes = [&](std::size_t level) { return grid(level) * static_cast<std::size_t>(layout.levels[level].stride) * size; };
    const std::size_t columns = work.context().quirks().lanes == 1 ? 1 : 16; // COLUMNS of occlusion_levels.cl
    work.launch(program, "first_level", {static_cast<std::size_t>(layout.levels[0].stride) / columns, grid(0)}, {1, 16}, bytes(0),
                size_of(marked.view), layout.textures[0], static_cast<cl_int>(settings.layers - 1), static_cast<cl_int>(settings.leak_fix),
                layout.levels[0], planes, marked.occupancy, data);
    for (std::size_t level = 1; level < layout.levels.size(); ++level) {
        const cl_int half = 1 << (level - 1), apart = kind == LevelKind::nbuffer ? half / 2 : half;
        const std::uint64_t below =
            bytes(level - 1) / static_cast<std::uint64_t>(layout.textures[level - 1]) * static_cast<std::uint64_t>(layout.textures[level]);
        work.launch(program, "next_level", {static_cast<std::size_t>(layout.levels[level].stride) / 16, grid(level)}, {1, 16},
                    below + bytes(level), layout.levels[level - 1], layout.levels[level], layout.textures[level], apart, data);
    }
}

} // namespace penumbra
