#include "technique/occlusion_texture.hpp"

#include <algorithm>
#include <cmath>

#include <penumbra/error.hpp>

#include "technique/keys.hpp"
#include "technique/occlusion_levels.hpp"

namespace penumbra {
namespace {

constexpr double most_taps = 16;

constexpr Names<3> placement_names{"uniform", "reciprocal", "occupied"};
constexpr Names<3> prefilter_names{"nbuffer", "mipmap", "summed_area"};
constexpr Names<4> level_names{"nbuffer", "mipmap", "table", "smooth"}; // of LevelKind
constexpr Names<2> storage_names{"binary32", "normalized16"};
constexpr Names<5> combine_names{"product", "sum", "max", "layered", "layered_max"};
constexpr Names<3> self_shadow_names{"fade", "own", "omit"};

static_assert(static_cast<int>(Combine::product) == COMBINE_PRODUCT && static_cast<int>(Combine::sum) == COMBINE_SUM);
static_assert(static_cast<int>(Combine::max) == COMBINE_MAX && static_cast<int>(Combine::layered) == COMBINE_LAYERED);
static_assert(static_cast<int>(Combine::layered_max) == COMBINE_LAYERED_MAX);

LevelKind level_kind(bool directional, const OcclusionTexture& settings)
{
    if (settings.prefilter == Prefilter::summed_area) return LevelKind::table;
    if (settings.prefilter == Prefilter::mipmap) return LevelKind::mipmap;
    return directional ? LevelKind::smooth : LevelKind::nbuffer;
}

std::size_t element_size(LevelKind kind, const OcclusionTexture& settings)
{
    return kind != LevelKind::table && settings.storage == LevelStorage::normalized16 ? 2 : 4;
}

opencl::Specialisation program(int lanes, LevelKind kind, const OcclusionTexture& settings)
{
    return {"occlusion_texture.cl",
            {{"LANES", std::to_string(lanes)},
             {"TILE_ROWS", std::to_string(tile_rows)},
             choice_constant("PREFILTER", level_names, kind),
             choice_constant("STORAGE", storage_names,
                             element_size(kind, settings) == 2 ? LevelStorage::normalized16 : LevelStorage::binary32)}};
}

bool is_layered(const OcclusionTexture& settings)
{
    return settings.combine == Combine::layered || settings.combine == Combine::layered_max;
}

void check_settings(const LightFrame& light, const OcclusionTexture& settings)
{
    const auto refuse = [](const std::string& key, const std::string& what, const std::string& expected) {
        throw Error::at(ErrorCode::invalid_input, "technique." + key, what, expected);
    };
    if (settings.light_splits > 1 && light.directional)
        refuse("light_splits", "is " + std::to_string(settings.light_splits) + " and the light directional",
               "expected 1: only rectangles are split");
    if (settings.leak_fix && (settings.combine != Combine::product && settings.combine != Combine::max))
        refuse("leak_fix", "is true and combine adds slices up", "expected combine product or max: a sum would count each surface twice");
    if (settings.placement == Placement::reciprocal && light.directional)
        refuse("placement", "is reciprocal and the light directional", "expected uniform or occupied: such a light has no nearest depth");
}

// The slices' planes as shading needs them, all layers of each.
std::vector<OcclusionPlane> planes_of(const SliceView& view, const std::vector<float>& depths, const SlicePart& part,
                                      const OcclusionTexture& settings)
{
    const bool layered = is_layered(settings);
    std::vector<OcclusionPlane> planes;
    for (std::size_t k = 0; k + 1 < depths.size(); ++k) {
        const double near = depths[k], far = depths[k + 1], next = k + 2 < depths.size() ? depths[k + 2] : far + (far - near);
        const double per = view.orthographic ? 1 : 1 / (far + static_cast<double>(view.behind));
        const double along = view.orthographic ? 1 : far * per;
        // A receiver on the plane itself does not count as beyond it, whatever rounding made of its depth.
        const double beyond = far + 0x1p-20 * std::abs(far);
        const bool own = settings.self_shadow == SelfShadow::own;
        const double from = own ? near : beyond, to = settings.self_shadow == SelfShadow::omit ? beyond : own ? far : next;
        OcclusionPlane plane{.slice = static_cast<int>(k),
                             .layer = -1,
                             .levels = 1,
                             .at_x = static_cast<float>(along * view.per_x),
                             .at_y = static_cast<float>(along * view.per_y),
                             .half_x = static_cast<float>(part.half_u * per * view.per_x),
                             .half_y = static_cast<float>(part.half_v * per * view.per_y),
                             .far = static_cast<float>(far),
                             .fade_from = static_cast<float>(from),
                             .per_fade = to > from ? static_cast<float>(std::min(1 / (to - from), 1e30)) : 1e30F};
        for (int layer = 0; layer < (layered ? settings.layers : 1); ++layer) {
            if (layered) plane.layer = layer;
            planes.push_back(plane);
        }
    }
    return planes;
}

// Lookups along each axis: kernels that are longer than wide are made of square ones.
std::array<int, 2> taps_of(const std::vector<OcclusionPlane>& planes)
{
    double x = 1, y = 1;
    for (const OcclusionPlane& plane : planes) {
        x = std::max(x, 2.0 * plane.half_x);
        y = std::max(y, 2.0 * plane.half_y);
    }
    const auto taps = [](double ratio) { return static_cast<int>(std::clamp(std::ceil(ratio * (1 - 0x1p-20)), 1.0, most_taps)); };
    return {taps(x / y), taps(y / x)};
}

// The marked slices of one part.
struct Marked {
    SliceView view{};
    std::vector<OcclusionPlane> planes; // those that hold anything
    std::array<int, 2> taps{1, 1};
    opencl::Buffer<cl_uint> occupancy;
};

struct Scenery {
    const LightFrame& light;
    SliceCasters casters;
    SliceRange range;
    std::vector<float> depths;
    opencl::Buffer<float> vertices, planes;
    opencl::Buffer<cl_int> triangles, large;
    const SolidMaps* solid;
    opencl::Buffer<float> front, back;
};

cl_int2 size_of(const SliceView& view) { return {{view.width, view.height}}; }

void mark_triangles(opencl::Work& work, const opencl::Specialisation& program, const Scenery& scenery, const SliceView& view,
                    const opencl::Buffer<cl_uint>& occupancy)
{
    const std::size_t count = scenery.casters.triangles.size() / 3;
    if (count == 0) return;
    const cl_int none = 0;
    const auto listed = work.upload(std::span<const cl_int>(&none, 1), "number of large triangles");
    work.launch(program, "slice_triangles", {count, 1}, {64, 1}, count * 48, view, static_cast<cl_int>(count), scenery.vertices,
                scenery.triangles, scenery.planes, occupancy, scenery.large, listed);
    work.launch(program, "slice_large", {4096, 1}, {64, 1}, 0, view, scenery.vertices, scenery.triangles, scenery.planes, occupancy,
                scenery.large, listed);
}

void mark_solid(opencl::Work& work, const opencl::Specialisation& program, const Scenery& scenery, const SliceView& view,
                const opencl::Buffer<cl_uint>& occupancy)
{
    if (!scenery.solid) return;
    const auto& [front, back, camera] = *scenery.solid;
    const cl_float2 per{
        {static_cast<float>(front.width / (2 * camera.half_extent.x)), static_cast<float>(front.height / (2 * camera.half_extent.y))}};
    const Vec3 origin = light_from_world(scenery.light, camera.frame.origin);
    const cl_float4 from{{static_cast<float>(origin.x), static_cast<float>(origin.y), static_cast<float>(origin.z), 0}};
    const std::size_t side = static_cast<std::size_t>(view.width);
    work.launch(program, "fill_between", {side, side}, {16, 1}, side * side * 8, view, cl_int2{{front.width, front.height}}, per, from,
                scenery.front, scenery.back, scenery.planes, occupancy);
}

Marked marked_slices(opencl::Work& work, const opencl::Specialisation& program, const Scenery& scenery, const SlicePart& part,
                     const OcclusionTexture& settings)
{
    Marked marked;
    marked.view = slice_view(scenery.casters, scenery.range, part, settings.resolution, settings.slices, scenery.light.directional);
    const std::size_t side = static_cast<std::size_t>(settings.resolution);
    marked.occupancy = work.upload(std::span<const cl_uint>(std::vector<cl_uint>(2 * side * side)), "slices");
    mark_triangles(work, program, scenery, marked.view, marked.occupancy);
    mark_solid(work, program, scenery, marked.view, marked.occupancy);

    const std::vector<OcclusionPlane> all = planes_of(marked.view, scenery.depths, part, settings);
    marked.taps = taps_of(all);
    const auto planes = work.upload(std::span<const OcclusionPlane>(all), "planes of slices");
    const auto counts = work.upload(std::span<const cl_int>(std::vector<cl_int>(all.size())), "filled texels");
    work.launch(program, "count_filled", {side, all.size()}, {16, 1}, side * side * 8 * all.size(), size_of(marked.view),
                static_cast<cl_int>(all.size()), static_cast<cl_int>(settings.layers - 1), static_cast<cl_int>(settings.leak_fix), planes,
                marked.occupancy, counts);
    const std::vector<cl_int> filled = work.read(counts);
    for (std::size_t i = 0; i < all.size(); ++i)
        if (filled[i] > 0) marked.planes.push_back(all[i]);
    return marked;
}

// How many levels each plane needs, for receivers however far away.
void set_levels(Marked& marked, LevelKind kind, bool directional)
{
    for (OcclusionPlane& plane : marked.planes) {
        const double size = std::max(2.0 * plane.half_x / marked.taps[0], 2.0 * plane.half_y / marked.taps[1]);
        plane.levels = levels_for(directional && size > 0 ? 1e30 : size, marked.view.width, kind);
    }
}

LevelLayout layout_of(const Marked& marked, LevelKind kind)
{
    const std::uint64_t side = static_cast<std::uint64_t>(marked.view.width);
    if (kind == LevelKind::table) return {.levels = {}, .textures = {}, .elements = marked.planes.size() * (side + 1) * (side + 1)};
    std::vector<int> levels;
    for (const OcclusionPlane& plane : marked.planes) levels.push_back(plane.levels);
    return level_layout(levels, marked.view.width, kind);
}

// What the same slices would take with `side` texels: kernels have fewer texels in proportion.
std::uint64_t elements_at(Marked marked, int side, LevelKind kind, bool directional)
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
std::string what_fits(const Marked& marked, std::uint64_t most, LevelKind kind, bool directional, const OcclusionTexture& settings)
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
    Marked nearest = marked;
    nearest.planes.resize(1);
    const bool layered = is_layered(settings);
    const std::uint64_t slices = most / layout_of(nearest, kind).elements / static_cast<std::uint64_t>(layered ? settings.layers : 1);
    if (fits == 0)
        return slices == 0 ? "expected fewer slices and a lower resolution" : "expected at most " + std::to_string(slices) + " slices";
    return "a resolution of " + std::to_string(fits) + " would fit" +
           (slices == 0 ? "" : ", or " + std::to_string(std::min(slices, static_cast<std::uint64_t>(settings.slices))) + " slices");
}

void check_memory(const opencl::Context& context, const Marked& marked, std::uint64_t elements, LevelKind kind, bool directional,
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

void build_tables(opencl::Work& work, const opencl::Specialisation& program, const Marked& marked, const OcclusionTexture& settings,
                  const opencl::Buffer<OcclusionPlane>& planes, const opencl::Buffer<cl_uchar>& data)
{
    const std::size_t side = static_cast<std::size_t>(marked.view.width), count = marked.planes.size();
    work.launch(program, "table_rows", {side + 1, count}, {16, 1}, side * side * 8 + data.bytes(), size_of(marked.view),
                static_cast<cl_int>(count), static_cast<cl_int>(settings.layers - 1), static_cast<cl_int>(settings.leak_fix), planes,
                marked.occupancy, data);
    work.launch(program, "table_columns", {side + 1, count}, {16, 1}, 2 * data.bytes(), size_of(marked.view), static_cast<cl_int>(count),
                data);
}

void build_levels(opencl::Work& work, const opencl::Specialisation& program, const Marked& marked, const OcclusionTexture& settings,
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

PreparedOcclusionTexture::Part part_of(opencl::Work& work, const opencl::Specialisation& program, const Scenery& scenery,
                                       const SlicePart& part, float share, const OcclusionTexture& settings, std::string& note)
{
    const LevelKind kind = level_kind(scenery.light.directional, settings);
    work.stage("slices");
    Marked marked = marked_slices(work, program, scenery, part, settings);
    set_levels(marked, kind, scenery.light.directional);
    const LevelLayout layout = layout_of(marked, kind);
    const std::uint64_t bytes = layout.elements * element_size(kind, settings);
    check_memory(work.context(), marked, layout.elements, kind, scenery.light.directional, settings);

    work.stage("prefilter");
    PreparedOcclusionTexture::Part prepared{.light = {.centre_x = static_cast<float>(part.centre_x),
                                                      .centre_y = static_cast<float>(part.centre_y),
                                                      .zero_x = -marked.view.low_x * marked.view.per_x,
                                                      .zero_y = -marked.view.low_y * marked.view.per_y,
                                                      .share = share,
                                                      .first = 0,
                                                      .orthographic = marked.view.orthographic,
                                                      .planes = static_cast<int>(marked.planes.size()),
                                                      .taps_x = marked.taps[0],
                                                      .taps_y = marked.taps[1],
                                                      .combine = static_cast<int>(settings.combine)},
                                            .planes = work.upload(std::span<const OcclusionPlane>(marked.planes), "planes of slices"),
                                            .levels = work.upload(std::span<const OcclusionLevel>(layout.levels), "levels"),
                                            .data = work.buffer<cl_uchar>(bytes, "prefiltered slices")};
    note = std::to_string(marked.planes.size()) + " occlusion textures hold anything";
    if (marked.planes.empty()) return prepared;
    if (kind == LevelKind::table) {
        build_tables(work, program, marked, settings, prepared.planes, prepared.data);
        note += "; summed-area tables";
    } else {
        build_levels(work, program, marked, settings, kind, layout, prepared.planes, prepared.data);
        note += "; " + std::to_string(layout.levels.size()) + " levels of the nearest, " + std::to_string(marked.planes.back().levels) +
                " of the furthest";
    }
    return prepared;
}

std::vector<SlicePart> parts_of(const LightFrame& light, int splits)
{
    std::vector<SlicePart> parts;
    const double half_u = light.half_u / splits, half_v = light.half_v / splits;
    for (int j = 0; j < splits; ++j)
        for (int i = 0; i < splits; ++i)
            parts.push_back(
                {.centre_x = (2 * i + 1 - splits) * half_u, .centre_y = (2 * j + 1 - splits) * half_v, .half_u = half_u, .half_v = half_v});
    return parts;
}

Scenery scenery_of(opencl::Work& work, const LightFrame& frame, std::span<const TriangleMesh* const> meshes, const SolidMaps* solid,
                   const OcclusionTexture& settings)
{
    Scenery scenery{.light = frame,
                    .casters = slice_casters(frame, meshes),
                    .range = {},
                    .depths = {},
                    .vertices = {},
                    .planes = {},
                    .triangles = {},
                    .large = {},
                    .solid = solid,
                    .front = {},
                    .back = {}};
    scenery.range = slice_range(scenery.casters, frame.directional);
    if (!(scenery.range.near <= scenery.range.far) || (!frame.directional && !(scenery.range.far > 0))) return scenery;
    scenery.depths = slice_depths(scenery.casters, scenery.range, settings.slices, settings.placement, frame.directional);
    scenery.vertices = work.upload(std::span<const float>(scenery.casters.vertices), "vertices");
    scenery.triangles = work.upload(std::span<const cl_int>(scenery.casters.triangles), "triangles");
    scenery.large = work.buffer<cl_int>(scenery.casters.triangles.size() / 3, "large triangles");
    scenery.planes = work.upload(std::span<const float>(scenery.depths), "depths of slices");
    if (solid) {
        scenery.front = work.upload(std::span<const float>(solid->front.depth), "front occluder depth");
        scenery.back = work.upload(std::span<const float>(solid->back.depth), "back occluder depth");
    }
    return scenery;
}

// What the maps show as triangles: of both sides of the solid, and of further layers.
std::vector<TriangleMesh> surfaces_of(const LightDepth& maps)
{
    std::vector<TriangleMesh> meshes{mesh_of_texels(*maps.front, maps.camera)};
    if (maps.back) meshes.push_back(mesh_of_texels(*maps.back, maps.camera));
    for (const DepthMap& layer : maps.layers) meshes.push_back(mesh_of_texels(layer, maps.camera));
    return meshes;
}

} // namespace

TechniqueRow row(const OcclusionTexture&)
{
    using S = OcclusionTexture;
    return {.kind = "occlusion_texture",
            .summary = "Slices of the casters, prefiltered: smooth and plausible, at a cost that neither the light's size nor the casters' "
                       "number moves.",
            .source = "Eisemann, Decoret: Occlusion Textures for Plausible Soft Shadows, Computer Graphics Forum 2008",
            .keys = {integer_key<S>("slices", &S::slices, {1, 64}, "slices", "along the light's axis"),
                     choice_key<S>("placement", &S::placement, placement_names,
                                   "slices of even depth, of even 1 / depth, or with as much of the casters' area in each"),
                     integer_key<S>("resolution", &S::resolution, {4, 4096}, "texels", "along each side of a slice"),
                     choice_key<S>("prefilter", &S::prefilter, prefilter_names,
                                   "how a slice's mean over any square is had; summed_area is exact and takes rectangles"),
                     choice_key<S>("storage", &S::storage, storage_names, "of N-buffers and mip-maps"),
                     choice_key<S>("combine", &S::combine, combine_names,
                                   "of slices: Eq. 5, for comparison the sum and the greatest; layered: the sum within a depth layer, the "
                                   "product (or the greatest) across"),
                     integer_key<S>("layers", &S::layers, {1, 8}, "layers", "layered: depth layers; the last one takes what lies behind"),
                     flag_key<S>("leak_fix", &S::leak_fix, "each slice is seen in the next one away from the light too (3.4.1)"),
                     choice_key<S>(
                         "self_shadow", &S::self_shadow, self_shadow_names,
                         "near a slice: the one before the receiver's own fades in, the own one fades in, or the own one is left out at "
                         "once (3.4.2)"),
                     integer_key<S>("light_splits", &S::light_splits, {1, 16}, "parts",
                                    "n x n parts of a rectangle, each with slices of its own")},
            .lights = {"rectangle", "point", "directional"},
            .textured_lights = false,
            .inputs =
                "objects that cast, or front occluder depth from the light's centre (and back: the solid between; and layers); receiver "
                "depth (or objects)",
            .defaults = OcclusionTexture{}};
}

PreparedOcclusionTexture prepare_occlusion_texture(opencl::Work& work, const Light& light, std::span<const TriangleMesh* const> meshes,
                                                   const SolidMaps* solid, const OcclusionTexture& settings)
{
    work.stage("casters");
    LightFrame frame = light_frame(light);
    check_settings(frame, settings);
    const LevelKind kind = level_kind(frame.directional, settings);
    PreparedOcclusionTexture prepared{.settings = settings,
                                      .program = program(work.context().quirks().lanes, kind, settings),
                                      .view = light_camera(frame, {1, 1}, frame.origin),
                                      .parts = {},
                                      .warnings = {},
                                      .notes = {}};
    if (frame.directional) {
        // Depth counts from before all that casts: what is nearer still has nothing between it and the light.
        const SliceRange range = slice_range(slice_casters(frame, meshes), true);
        if (range.near <= range.far) {
            const double room = std::max(range.far - range.near, std::abs(range.near) * 0x1p-16);
            frame.origin += frame.direction * (range.near - (room > 0 ? room : 1));
            prepared.view = light_camera(frame, {1, 1}, frame.origin);
        }
    }
    const Scenery scenery = scenery_of(work, frame, meshes, solid, settings);
    if (scenery.depths.empty()) {
        prepared.warnings.push_back("nothing that casts lies before the light: nothing casts shadows");
        return prepared;
    }
    if (scenery.range.near == scenery.range.far)
        prepared.warnings.push_back("all that casts lies in one plane parallel to the light: one slice holds it");
    if (scenery.casters.left_out > 0)
        prepared.warnings.push_back(std::to_string(scenery.casters.left_out) +
                                    " triangles with vertices that are not finite were left out");
    if (scenery.range.cut > 0)
        prepared.warnings.push_back(std::to_string(scenery.range.cut) + " triangles reach nearer to the light's plane than " +
                                    std::to_string(scenery.range.near) + ": what is nearer casts nothing");
    const int splits = frame.half_u > 0 || frame.half_v > 0 ? settings.light_splits : 1;
    float before = 0; // as the device adds the shares up; the last one makes them 1 to the bit
    for (const SlicePart& part : parts_of(frame, splits)) {
        std::string note;
        const bool last = prepared.parts.size() + 1 == static_cast<std::size_t>(splits * splits);
        const float share = last ? 1 - before : 1.0F / static_cast<float>(splits * splits);
        before += share;
        prepared.parts.push_back(part_of(work, prepared.program, scenery, part, share, settings, note));
        prepared.parts.back().light.first = prepared.parts.size() == 1;
        if (prepared.notes.empty()) prepared.notes.push_back(note);
    }
    return prepared;
}

void shade_occlusion_texture(opencl::Work& work, const PreparedOcclusionTexture& prepared, const ReceiverPoints& receivers,
                             const cl::Buffer& visibility, ShadeCounts* counts)
{
    const ReceiverView& view = receivers.view;
    const std::size_t lanes = static_cast<std::size_t>(work.context().quirks().lanes), width = static_cast<std::size_t>(view.stride),
                      height = static_cast<std::size_t>(view.height);
    const cl_int2 size{{prepared.settings.resolution, prepared.settings.resolution}};
    OcclusionLight nothing{};
    nothing.share = 1;
    nothing.first = 1;
    const auto launch = [&](const OcclusionLight& light, const auto& planes, const auto& levels, const auto& data) {
        work.launch(prepared.program, "occlusion_texture", {width / lanes, height}, {lanes == 1 ? std::size_t{64} : std::size_t{4}, 1},
                    width * height * 16, view, light, size, planes, levels, data, receivers.xi, receivers.eta, receivers.d, visibility);
    };
    if (prepared.parts.empty()) launch(nothing, cl::Buffer(), cl::Buffer(), cl::Buffer());
    for (const PreparedOcclusionTexture::Part& part : prepared.parts) launch(part.light, part.planes, part.levels, part.data);
    if (!counts) return;
    for (const PreparedOcclusionTexture::Part& part : prepared.parts)
        counts->pairs += static_cast<std::uint64_t>(view.width) * height * static_cast<std::uint64_t>(part.light.planes);
}

Needs needs(const OcclusionTexture&) { return {.casters = Needs::Casters::or_front}; }

PreparedOcclusionTexture prepare(opencl::Work& work, const Casting& casting, const OcclusionTexture& settings, Findings& findings)
{
    const LightDepth& maps = casting.depth;
    std::vector<TriangleMesh> surfaces;
    std::vector<const TriangleMesh*> meshes = casting.meshes;
    if (meshes.empty()) {
        work.stage("surfaces of depth maps");
        surfaces = surfaces_of(maps);
        for (const TriangleMesh& mesh : surfaces) meshes.push_back(&mesh);
    }
    std::optional<SolidMaps> solid;
    if (casting.meshes.empty() && maps.back) solid.emplace(*maps.front, *maps.back, maps.camera);

    PreparedOcclusionTexture prepared = prepare_occlusion_texture(work, casting.light, meshes, solid ? &*solid : nullptr, settings);
    findings.view = prepared.view;
    findings.warnings.insert(findings.warnings.end(), prepared.warnings.begin(), prepared.warnings.end());
    findings.notes = prepared.notes;
    return prepared;
}

void shade(opencl::Work& work, const PreparedOcclusionTexture& prepared, const Receiving& receivers, Shaded& shaded)
{
    const ReceiverPoints points = points_of(work, receivers, prepared.program);
    work.stage("shade");
    shade_occlusion_texture(work, prepared, points, shaded.visibility, shaded.counts);
}

std::vector<WorkAmount> work(const OcclusionTexture& settings, const MaskShape& shape)
{
    // Lookups of a receiver, and texels of the slices that are prefiltered.
    const double textures =
        shape.lights() * settings.light_splits * settings.light_splits * settings.slices * (is_layered(settings) ? settings.layers : 1);
    return {
        {"technique.slices", textures * shape.pixels(), WorkAmount::Unit::pairs, "pairs of slice and receiver"},
        {"technique.resolution", textures * settings.resolution * settings.resolution, WorkAmount::Unit::slice_texels, "texels of slices"}};
}

std::vector<opencl::Specialisation> specialisations(const OcclusionTexture& settings, int lanes)
{
    std::vector<opencl::Specialisation> programs;
    for (const bool directional : {false, true}) programs.push_back(program(lanes, level_kind(directional, settings), settings));
    return programs;
}

DeviceBuffers device_buffers(const OcclusionTexture&)
{
    return {.prepare = Error(ErrorCode::unsupported,
                             "occlusion_texture makes surfaces of depth maps on the host and cannot prepare from device buffers",
                             "prepare it from objects, or from depth maps in memory"),
            .shade = {}};
}

} // namespace penumbra
