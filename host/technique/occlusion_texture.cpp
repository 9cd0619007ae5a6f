#include "technique/occlusion_texture.hpp"

#include <algorithm>
#include <cmath>

#include <penumbra/error.hpp>

#include "technique/keys.hpp"
#include "technique/occlusion_levels.hpp"
#include "technique/occlusion_prefilter.hpp"
#include "technique/work_estimate.hpp"

namespace penumbra {
namespace {

constexpr WorkKind lookups{"technique.slices", WorkAmount::Unit::pairs, "pairs of slice and receiver"};

constexpr Names<3> placement_names{"uniform", "reciprocal", "occupied"};
constexpr Names<3> prefilter_names{"nbuffer", "mipmap", "summed_area"};
constexpr Names<4> level_names{"nbuffer", "mipmap", "table", "smooth"}; // of LevelKind
constexpr Names<2> storage_names{"binary32", "normalized16"};
constexpr Names<5> combine_names{"product", "sum", "max", "layered", "layered_max"};
constexpr Names<2> projection_centre_names{"light", "behind_light"};
constexpr Names<4> self_shadow_names{"auto", "fade", "own", "omit"};

static_assert(static_cast<int>(Combine::product) == COMBINE_PRODUCT && static_cast<int>(Combine::sum) == COMBINE_SUM);
static_assert(static_cast<int>(Combine::max) == COMBINE_MAX && static_cast<int>(Combine::layered) == COMBINE_LAYERED);
static_assert(static_cast<int>(Combine::layered_max) == COMBINE_LAYERED_MAX);

// Half the side of a square of the disc's variance, for each unit of its radius: sqrt(3) / 2.
constexpr double square_of_disc = 0.86602540378443865;

opencl::Specialisation program(int lanes, LevelKind kind, const OcclusionTexture& settings)
{
    return {"occlusion_texture.cl",
            {{"LANES", std::to_string(lanes)},
             {"TILE_ROWS", std::to_string(tile_rows)},
             choice_constant("PREFILTER", level_names, kind),
             choice_constant("STORAGE", storage_names,
                             element_size(kind, settings) == 2 ? LevelStorage::normalized16 : LevelStorage::binary32)}};
}

[[noreturn]] void refuse(const std::string& key, const std::string& what, const std::string& expected)
{
    throw Error::at(ErrorCode::invalid_input, "technique." + key, what, expected);
}

void check_light(const LightFrame& light, const OcclusionTexture& settings)
{
    if (settings.light_splits > 1 && light.shape == LightShape::disc)
        refuse("light_splits", "is " + std::to_string(settings.light_splits) + " and the light a disc", "expected 1: only rectangles are split");
    if (settings.placement == Placement::reciprocal && light.directional)
        refuse("placement", "is reciprocal and the light directional", "expected uniform or occupied: such a light has no nearest depth");
}

PreparedOcclusionTexture::Part part_of(opencl::Work& work, const opencl::Specialisation& program, const SliceScenery& scenery,
                                       const SlicePart& part, float share, const OcclusionTexture& settings, std::string& note)
{
    const LevelKind kind = level_kind(scenery.light.directional, settings);
    work.stage("slices");
    MarkedSlices marked = marked_slices(work, program, scenery, part, settings);
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

// As published.
OcclusionTexture paper_settings()
{
    OcclusionTexture settings;
    settings.preset = Preset::paper;
    settings.projection_centre = ProjectionCentre::behind_light;
    settings.prefilter = Prefilter::nbuffer;
    settings.combine = Combine::product;
    settings.self_shadow = SelfShadow::fade;
    settings.tolerance = 0;
    return settings;
}

} // namespace

TechniqueRow row(const OcclusionTexture&)
{
    using S = OcclusionTexture;
    return {.kind = "occlusion_texture",
            .summary = "Slices of the casters, prefiltered: smooth and plausible, at a cost that neither the light's size nor the casters' "
                       "number moves.",
            .source = "Eisemann, Decoret: Occlusion Textures for Plausible Soft Shadows, Computer Graphics Forum 2008",
            .keys = {preset_key<S>(paper_settings()),
                 integer_key<S>("slices", &S::slices, {1, 64}, "slices", "along the light's axis"),
                     choice_key<S>("placement", &S::placement, placement_names,
                                   "slices of even depth, of even 1 / depth, or with as much of the casters' area in each"),
                     integer_key<S>("resolution", &S::resolution, {4, 4096}, "texels", "along each side of a slice"),
                     choice_key<S>("projection_centre", &S::projection_centre, projection_centre_names,
                                   "where slices are seen from: the light's centre, or behind it (3.4), so that its edges' frustum holds the casters"),
                     choice_key<S>("prefilter", &S::prefilter, prefilter_names,
                                   "how a slice's mean over any rectangle is had: summed_area is exact; the others interpolate between squares"),
                     choice_key<S>("storage", &S::storage, storage_names, "of N-buffers and mip-maps"),
                     choice_key<S>("combine", &S::combine, combine_names,
                                   "of slices: Eq. 5, for comparison the sum and the greatest; layered: the sum within a depth layer, the "
                                   "product (or the greatest) across"),
                     integer_key<S>("layers", &S::layers, {1, 8}, "layers", "layered: depth layers; the last one takes what lies behind"),
                     flag_key<S>("leak_fix", &S::leak_fix, "each slice is seen in the next one away from the light too (3.4.1)"),
                     choice_key<S>(
                         "self_shadow", &S::self_shadow, self_shadow_names,
                         "near a receiver's own slice: fade (3.4.2) leaves it out and has the one before fade in; own has it fade in; omit leaves "
                         "it out at once; auto is own where no receiver casts, else fade"),
                     integer_key<S>("light_splits", &S::light_splits, {1, 16}, "parts",
                                    "n x n parts of a rectangle, each with slices of its own"),
                 tolerance_key<S>()},
            .lights = {"rectangle", "sphere", "point", "directional"},
            .textured_lights = false,
            .inputs =
                "objects that cast, or front occluder depth from the light's centre (and back: the solid between; and layers); receiver "
                "depth (or objects)",
            .defaults = OcclusionTexture{}};
}

void check_together(const OcclusionTexture& settings)
{
    if (settings.leak_fix && settings.combine != Combine::product && settings.combine != Combine::max)
        refuse("leak_fix", "is true and combine adds slices up", "expected combine product or max: a sum would count each surface twice");
}

PreparedOcclusionTexture prepare_occlusion_texture(opencl::Work& work, const Light& light, std::span<const TriangleMesh* const> meshes,
                                                   const SolidMaps* solid, const OcclusionTexture& settings, bool receivers_cast)
{
    work.stage("casters");
    LightFrame frame = light_frame(light);
    check_together(settings);
    check_light(frame, settings);
    const LevelKind kind = level_kind(frame.directional, settings);
    if (frame.shape == LightShape::disc && kind != LevelKind::smooth) {
        frame.half_u *= square_of_disc;
        frame.half_v *= square_of_disc;
    }
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
    const SliceScenery scenery = slice_scenery(work, frame, meshes, solid, settings, receivers_cast);
    if (scenery.depths.empty()) {
        prepared.warnings.emplace_back("nothing that casts lies before the light: nothing casts shadows");
        return prepared;
    }
    if (scenery.range.near == scenery.range.far)
        prepared.warnings.emplace_back("all that casts lies in one plane parallel to the light: one slice holds it");
    if (scenery.casters.left_out > 0)
        prepared.warnings.push_back(std::to_string(scenery.casters.left_out) +
                                    " triangles with vertices that are not finite were left out");
    if (scenery.range.cut > 0)
        prepared.warnings.push_back(std::to_string(scenery.range.cut) + " triangles reach nearer to the light's plane than " +
                                    std::to_string(scenery.range.near) + ": what is nearer casts nothing");
    const int splits = frame.half_u > 0 || frame.half_v > 0 ? settings.light_splits : 1;
    const int parts = splits * splits;
    float before = 0; // as the device adds the shares up; the last one makes them 1 to the bit
    for (const SlicePart& part : slice_parts(frame, splits)) {
        std::string note;
        const bool last = prepared.parts.size() + 1 == static_cast<std::size_t>(parts);
        const float share = last ? 1 - before : 1.0F / static_cast<float>(parts);
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
                    width * height * 16, view, static_cast<float>(receivers.precision), light, size, planes, levels, data, receivers.xi, receivers.eta, receivers.d, visibility, work.stop());
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
        surfaces = surfaces_of(maps, true);
        for (const TriangleMesh& mesh : surfaces) meshes.push_back(&mesh);
    }
    std::optional<SolidMaps> solid;
    if (casting.meshes.empty() && maps.back) solid.emplace(SolidMaps{*maps.front, *maps.back, maps.camera});

    PreparedOcclusionTexture prepared = prepare_occlusion_texture(work, casting.light, meshes, solid ? &*solid : nullptr, settings, casting.receivers_cast);
    findings.view = prepared.view;
    findings.warnings.insert(findings.warnings.end(), prepared.warnings.begin(), prepared.warnings.end());
    findings.notes = prepared.notes;
    return prepared;
}

void shade(opencl::Work& work, const PreparedOcclusionTexture& prepared, const Receiving& receivers, Shaded& shaded)
{
    const ReceiverPoints points = points_of(work, receivers, prepared.program);
    work.stage("shade");
    if (shaded.estimated)
        shaded.estimated(estimate_by_sample(work, points, prepared.program, 1, lookups, [&](const ReceiverPoints& some, const cl::Buffer& to, ShadeCounts& counts) {
            shade_occlusion_texture(work, prepared, some, to, &counts);
        }));
    shade_occlusion_texture(work, prepared, points, shaded.visibility, shaded.counts);
}

std::vector<WorkAmount> work(const OcclusionTexture& settings, const MaskShape& shape)
{
    // Lookups of a receiver, and texels of the slices that are prefiltered.
    const double textures =
        shape.lights() * settings.light_splits * settings.light_splits * settings.slices * (is_layered(settings) ? settings.layers : 1);
    return {
        lookups.of(textures * shape.pixels()),
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
