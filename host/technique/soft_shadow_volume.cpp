#include "technique/soft_shadow_volume.hpp"

#include <algorithm>
#include <cmath>

#include <penumbra/error.hpp>

#include "scene/memory.hpp"
#include "scene/parallel.hpp"
#include "technique/coverage_table.hpp"
#include "technique/keys.hpp"
#include "technique/linear_wedges.hpp"
#include "technique/receiver_silhouettes.hpp"
#include "technique/work_estimate.hpp"

namespace penumbra {
namespace {

constexpr WorkKind shares{"technique.light_splits", WorkAmount::Unit::pairs, "pairs of edge and receiver"};

constexpr Names<3> coverage_names{"linear", "analytic", "texture"};
constexpr Names<2> silhouettes_names{"centre", "per_receiver"};
constexpr Names<4> overlap_names{"sum", "max", "half_min", "product"};
constexpr Names<3> lookup_names{"nearest", "bilinear", "quadrilinear"};
constexpr Names<4> buffer_names{"binary32", "int16", "six_bits", "twelve_bits"};
constexpr Names<4> culling_names{"none", "loose", "far_depth", "tight"};
constexpr Names<2> shape_names{"rectangle", "disc"}; // of LightShape

static_assert(static_cast<int>(Overlap::sum) == OVERLAP_SUM && static_cast<int>(Overlap::max) == OVERLAP_MAX);
static_assert(static_cast<int>(Overlap::half_min) == OVERLAP_HALF_MIN && static_cast<int>(Overlap::product) == OVERLAP_PRODUCT);

void check_settings(const Light& light, const SoftShadowVolume& settings)
{
    check_together(settings);
    const LightFrame frame = light_frame(light);
    const auto refuse = [&](const std::string& key, const std::string& what, const std::string& expected) {
        throw Error::at(ErrorCode::invalid_input, "technique." + key, what + " and the light a " + kind_of(light), expected);
    };
    if (settings.silhouettes == Silhouettes::per_receiver && (frame.shape != LightShape::rectangle || emission_of(light)))
        refuse("silhouettes", "is per_receiver", emission_of(light) ? "expected a light without emission, or silhouettes centre"
                                                                    : "expected a rectangle or a point, or silhouettes centre");
    if (settings.light_splits > 1 && frame.shape != LightShape::rectangle)
        refuse("light_splits", "is " + std::to_string(settings.light_splits), "expected 1: only rectangles are split");
    if (settings.coverage == Coverage::texture && !std::holds_alternative<RectangleLight>(light))
        refuse("coverage", "is texture", "expected a rectangle, or coverage analytic");
    if (settings.coverage == Coverage::texture && settings.table % 2 != 0)
        throw Error::at(ErrorCode::invalid_input, "technique.table", "is " + std::to_string(settings.table),
                        "expected an even number from 4 to 64");
    if (emission_of(light) && settings.coverage != Coverage::texture)
        throw Error::at(ErrorCode::invalid_input, "light.emission", "needs coverage texture", "set technique.coverage to \"texture\"");
}

int item_rows(int lanes) { return lanes == 1 ? 1 : tile_rows; }

// Linear coverage takes every light for a sphere; only a table is looked up.
opencl::Specialisation program(int lanes, LightShape light, const SoftShadowVolume& settings, int channels)
{
    const bool table = settings.coverage == Coverage::texture;
    return {"soft_shadow_volume.cl",
            {{"LANES", std::to_string(lanes)},
             {"ITEM_ROWS", std::to_string(item_rows(lanes))},
             {"TILE_ROWS", std::to_string(tile_rows)},
             choice_constant("LIGHT", shape_names, settings.coverage == Coverage::linear ? LightShape::rectangle : light),
             choice_constant("COVERAGE", coverage_names, settings.coverage),
             {"CHANNELS", std::to_string(channels)},
             choice_constant("LOOKUP", lookup_names, table ? settings.lookup : Lookup::quadrilinear),
             choice_constant("ACCUMULATOR", buffer_names, settings.buffer)}};
}

opencl::Specialisation counting_program(int lanes)
{
    return {"soft_shadow_silhouettes.cl",
            {{"LANES", std::to_string(lanes)}, {"ITEM_ROWS", std::to_string(item_rows(lanes))}, {"TILE_ROWS", std::to_string(tile_rows)}, {"CHANNELS", "1"}}};
}

// What the kernel culls by. Depth ranges are the host's affair.
int kernel_culling(WedgeCulling culling)
{
    if (culling == WedgeCulling::none) return CULLING_NONE;
    return culling == WedgeCulling::loose ? CULLING_LOOSE : CULLING_TIGHT;
}

WedgeLight wedge_light(const LightFrame& light, const LightPart& part, const Casters& casters, const SoftShadowVolume& settings, int sheets)
{
    const bool disc = light.shape == LightShape::disc;
    // A bounding sphere of the rectangle, for loose wedges (Paper IV, 4.1, says what they were).
    const double sphere = settings.culling == WedgeCulling::loose && !disc ? std::hypot(part.half.x, part.half.y) : 0;
    const auto reach = [&](double half) { return static_cast<float>(sphere > 0 ? sphere / half : 1); };
    const double bias = settings.bias / 2;
    return {.scale_x = static_cast<float>(part.half.z / part.half.x),
            .scale_y = static_cast<float>(part.half.z / part.half.y),
            .scale_d = static_cast<float>(part.half.z),
            .centre_x = static_cast<float>(part.centre_x / part.half.z),
            .centre_y = static_cast<float>(part.centre_y / part.half.z),
            .reach_x = reach(part.half.x),
            .reach_y = reach(part.half.y),
            .bias_x = static_cast<float>(bias * casters.texel.x * part.half.z / part.half.x),
            .bias_y = static_cast<float>(bias * casters.texel.y * part.half.z / part.half.y),
            .precision = 0,
            .depth_error = 0,
            .position_error = 0,
            .share = {static_cast<float>(part.share), static_cast<float>(part.share), static_cast<float>(part.share)},
            .sheets = sheets,
            .overlap = static_cast<int>(settings.overlap),
            .culling = kernel_culling(settings.culling),
            .first = 0};
}

// What of a part goes to the device.
double bytes_of(const WedgeData& data)
{
    const std::size_t words = data.sheet_boxes.size() + data.edge_boxes.size() + data.edge_ends.size() + data.edges.size() +
                              data.triangle_boxes.size() + data.triangle_groups.size();
    return static_cast<double>(words) * sizeof(float) + static_cast<double>(data.sheets.size()) * sizeof(Sheet);
}

PreparedSoftShadowVolume::Part upload(opencl::Work& work, const WedgeData& data, const WedgeLight& light)
{
    const auto floats = [&](const std::vector<float>& values, const char* what) {
        return work.upload(std::span<const float>(values), what);
    };
    return {.light = light,
            .sheets = work.upload(std::span<const Sheet>(data.sheets), "sheets"),
            .coverage = {},
            .sheet_boxes = floats(data.sheet_boxes, "boxes of sheets"),
            .edge_boxes = floats(data.edge_boxes, "boxes of edges"),
            .edge_ends = floats(data.edge_ends, "ends of edges"),
            .edges = floats(data.edges, "edges"),
            .triangle_boxes = floats(data.triangle_boxes, "boxes of triangles"),
            .triangle_groups = work.upload(std::span<const cl_int>(data.triangle_groups), "facing triangles")};
}

PreparedSoftShadowVolume::Counted upload(opencl::Work& work, const ReceiverSilhouettes& data, const WedgeLight& light)
{
    const auto floats = [&](const std::vector<float>& values, const char* what) {
        return work.upload(std::span<const float>(values), what);
    };
    return {.light = light,
            .edges = {{data.edge_supers, data.edge_groups}},
            .triangles = {{data.triangle_supers, data.triangle_groups}},
            .edge_supers = floats(data.edge_super_boxes, "boxes of groups of edges"),
            .edge_groups = floats(data.edge_group_boxes, "boxes of edges"),
            .edge_sets = floats(data.edge_sets, "edges"),
            .triangle_supers = floats(data.triangle_super_boxes, "boxes of groups of triangles"),
            .triangle_groups = floats(data.triangle_group_boxes, "boxes of triangles"),
            .triangle_sets = floats(data.triangle_sets, "triangles")};
}

// What the host finds out for a part.
struct PartWedges {
    LinearWedges linear;
    WedgeData data;
    std::size_t sheets = 0;
};

PartWedges wedges_of(const Topology& topology, const WedgeTriangles& triangles, const LightFrame& frame, const LightPart& part,
                     const SoftShadowVolume& settings)
{
    const bool extent = frame.half_u > 0 || frame.half_v > 0;
    PartWedges wedges;
    Silhouette silhouette = silhouette_of(topology, part.centre);
    if (extent && settings.coverage == Coverage::linear) {
        wedges.linear = linear_wedges(topology, std::move(silhouette), frame, part, settings.smooth, settings.corner_wedges);
        silhouette = wedges.linear.silhouette;
    }
    wedges.sheets = silhouette.sheets();
    wedges.data = wedge_data(topology, triangles, silhouette, frame, part, settings.overlap != Overlap::sum, extent);
    return wedges;
}

// What the linear wedges of all parts leave to be said.
std::vector<std::string> linear_warnings(const LightFrame& frame, const PreparedSoftShadowVolume& prepared, std::uint64_t left_out,
                                         std::uint64_t unshared)
{
    std::vector<std::string> warnings;
    if (frame.shape != LightShape::disc)
        warnings.emplace_back("linear coverage takes the rectangle for the sphere around it: penumbrae are as wide as of that sphere");
    if (left_out > 0)
        warnings.push_back(std::to_string(left_out) + " of " + std::to_string(prepared.edges) +
                           " silhouette edges point at the light's centre and have no wedge");
    if (unshared > 0)
        warnings.push_back(std::to_string(unshared) + " of " + std::to_string(prepared.edges) +
                           " neighbouring wedges share no side plane that holds their fronts and backs: light may leak along it");
    return warnings;
}

// The kernel adds the parts in this order and rounds each time: the last share becomes what the others leave, so that the whole light comes
// out as 1 to the bit. Where the others round to more, the largest gives way.
void complete_shares(std::vector<PreparedSoftShadowVolume::Part>& parts)
{
    for (std::size_t c = 0; c < std::size(WedgeLight{}.share); ++c) {
        const auto share = [&](std::size_t i) -> float& { return parts[i].light.share[c]; };
        for (;;) {
            float sum = 0;
            std::size_t largest = 0;
            for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
                sum += share(i);
                if (share(i) > share(largest)) largest = i;
            }
            share(parts.size() - 1) = 1 - sum;
            if (sum <= 1) break;
            share(largest) = std::nextafter(share(largest), 0.0F);
        }
    }
}

// A texture's tables, and how much of the light each part is.
void set_emission(opencl::Work& work, const Light& light, PreparedSoftShadowVolume& prepared)
{
    const LightFrame frame = light_frame(light);
    const int table = prepared.settings.table, splits = static_cast<int>(std::lround(std::sqrt(prepared.parts.size())));
    const EmissionSums emission = emission_sums(emission_of(light), 2 * table);
    const EmissionPart whole = emission_part(emission, 0, 0, 1);
    prepared.channels = emission.channels;
    prepared.program = program(work.context().quirks().lanes, frame.shape, prepared.settings, emission.channels);
    const std::vector<LightPart> parts = light_parts(frame, splits);
    // Of all parts, before the first is made.
    if (work.context().quirks().host_memory)
        require_memory(4 * std::pow(table, 4) * emission.channels * static_cast<double>(parts.size()),
                       std::to_string(parts.size()) + " coverage tables (technique.table, light_splits)");
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const EmissionPart lit = emission_part(emission, parts[i].centre_x / splits, parts[i].centre_y / splits, 1.0 / splits);
        prepared.parts[i].coverage = coverage_table(work, prepared.program, emission, lit, table);
        for (std::size_t c = 0; c < static_cast<std::size_t>(emission.channels); ++c)
            prepared.parts[i].light.share[c] = static_cast<float>(lit.light[c] / whole.light[c]);
    }
    complete_shares(prepared.parts);
}

// The receivers' camera as the part's tiles see it (the kernel's `eye`).
cl_float4 eye_of(const ReceiverView& view, const WedgeLight& light, bool wanted)
{
    const float x = view.light_from_camera[3], y = view.light_from_camera[7], z = view.light_from_camera[11];
    if (!wanted || !(z > 0)) return {{0, 0, 0, 0}};
    const float d = light.scale_d / z;
    return {{x / z * light.scale_x - light.centre_x * d, y / z * light.scale_y - light.centre_y * d, d, 1}};
}

// Of the surfaces that the occluder maps show, where there are no objects.
// From the centre what lies behind the front would be counted twice; seen from each receiver it is not.
Topology topology_of_maps(const LightDepth& maps, Silhouettes silhouettes)
{
    LightDepth used = maps;
    if (silhouettes == Silhouettes::centre) used.layers = {};
    const std::vector<TriangleMesh> meshes = surfaces_of(used, false);
    std::vector<const TriangleMesh*> pointers;
    pointers.reserve(meshes.size());
    for (const TriangleMesh& mesh : meshes) pointers.push_back(&mesh);
    return Topology(pointers);
}

void warn_of_edges(const Topology& topology, std::vector<std::string>& warnings)
{
    const auto warn = [&](std::uint64_t count, const char* what) {
        if (count > 0) warnings.push_back(std::to_string(count) + what);
    };
    warn(topology.open_edges(),
         " edges of the casters have one triangle alone: they count as silhouettes, and both sides of such a surface cast "
         "(overlap sum: of the two the one that hides more counts)");
    warn(topology.nonmanifold_edges(),
         " edges of the casters have more than two triangles: they count as silhouettes where the facing ones do not cancel");
    warn(topology.left_out(), " triangles without area were left out");
}

// As published.
SoftShadowVolume paper_settings()
{
    SoftShadowVolume settings;
    settings.preset = Preset::paper;
    settings.overlap = Overlap::sum;
    settings.light_splits = 1;
    settings.tolerance = 0;
    return settings;
}

} // namespace

TechniqueRow row(const SoftShadowVolume&)
{
    using S = SoftShadowVolume;
    return {
        .kind = "soft_shadow_volume",
        .summary =
            "Penumbra wedges: the hard shadow of the light's centre, corrected around each silhouette edge. Exact for planar casters.",
        .source = "Assarsson: A Real-Time Soft Shadow Volume Algorithm, 2003 (Papers I to V)",
        .keys = {preset_key<S>(paper_settings()),
                 choice_key<S>("silhouettes", &S::silhouettes, silhouettes_names,
                               "from the light's centre, or from each receiver, counted before 32 x 32 samples: what rays see (rectangle, point)"),
                 choice_key<S>("coverage", &S::coverage, coverage_names,
                               "an edge's share of the light: Paper I's wedge, the closed form, or a table, which textured lights need"),
                 flag_key<S>("smooth", &S::smooth, "linear: light intensity s becomes 3 s^2 - 2 s^3"),
                 integer_key<S>("corner_wedges", &S::corner_wedges, {0, 16}, "wedges",
                                "linear: extra wedges at a corner of 0 degrees; fewer up to a right angle, where there are none"),
                 choice_key<S>("overlap", &S::overlap, overlap_names,
                               "how sheets of triangles that hide the same light are joined; half_min is Paper IV's Eq. 1"),
                 integer_key<S>("light_splits", &S::light_splits, {1, 16}, "parts",
                                "n x n parts of a rectangle, each with silhouettes of its own: nearer to the truth, n x n preparations"),
                 integer_key<S>("table", &S::table, {4, 64}, "places", "texture: places an axis of the coverage table, an even number"),
                 choice_key<S>("lookup", &S::lookup, lookup_names,
                               "texture: between the table's places; bilinear is so in one end of the edge, quadrilinear in both"),
                 choice_key<S>("buffer", &S::buffer, buffer_names,
                               "what shares are added in; all but binary32 are the papers' integer buffers, for study"),
                 choice_key<S>("culling", &S::culling, culling_names,
                               "which wedges a tile of receivers looks at, for study: the mask is the same"),
                 real_key<S>("bias", &S::bias, {0, 16}, "half texels",
                             "of casters made from depth maps: how far along their slope they count as the receiver's own surface"),
                 tolerance_key<S>()},
        .lights = {"rectangle", "sphere", "point"},
        .textured_lights = true,
        .inputs = "objects that cast, or front occluder depth from the light's centre; receiver depth (or objects)",
        .defaults = SoftShadowVolume{}};
}

Camera wedge_view(const Light& light)
{
    const LightFrame frame = light_frame(light);
    return light_camera(frame, {1, 1}, frame.origin);
}

PreparedSoftShadowVolume prepare_soft_shadow_volume(opencl::Work& work, const Light& light, const Casters& casters,
                                                    const SoftShadowVolume& settings)
{
    check_settings(light, settings);
    const LightFrame frame = light_frame(light);
    const bool extent = frame.half_u > 0 || frame.half_v > 0, textured = settings.coverage == Coverage::texture;
    const int splits = extent ? settings.light_splits : 1;
    PreparedSoftShadowVolume prepared{.settings = settings,
                                      .channels = 1,
                                      .program = program(work.context().quirks().lanes, frame.shape, settings, 1),
                                      .triangle_extents = {},
                                      .triangle_rows = {},
                                      .parts = {},
                                      .counted = {},
                                      .edges = 0,
                                      .triangles = 0,
                                      .sheets = 0,
                                      .warnings = {}};
    if (extent && settings.silhouettes == Silhouettes::per_receiver) {
        const LightPart corner = corner_part(frame);
        const ReceiverSilhouettes data = receiver_silhouettes(casters.topology, frame, corner);
        prepared.program = counting_program(work.context().quirks().lanes);
        prepared.counted = upload(work, data, wedge_light(frame, corner, casters, settings, 0));
        prepared.edges = data.edge_count;
        prepared.triangles = data.triangle_count;
        return prepared;
    }
    const bool linear = extent && settings.coverage == Coverage::linear;
    std::uint64_t left_out = 0, unshared = 0;
    const std::vector<LightPart> parts = light_parts(frame, splits);
    // As many parts at a time as there are threads: the host never holds the wedges of all.
    const WedgeTriangles triangles = wedge_triangles(casters.topology, frame, parts);
    prepared.triangle_rows = work.upload(std::span<const float>(triangles.rows), "triangles");
    prepared.triangle_extents = work.upload(std::span<const float>(triangles.extents), "extents of triangles");
    std::vector<PartWedges> batch(std::min<std::size_t>(thread_count(), parts.size()));
    for (std::size_t first = 0; first < parts.size(); first += batch.size()) {
        const std::size_t count = std::min(batch.size(), parts.size() - first);
        parallel_for(static_cast<int>(count), [&](int i) {
            batch[static_cast<std::size_t>(i)] = wedges_of(casters.topology, triangles, frame, parts[first + static_cast<std::size_t>(i)], settings);
        });
        for (std::size_t i = 0; i < count; ++i) {
            const auto& [wedges, data, sheets] = batch[i];
            // All see the same casters, and take about as much as the first.
            if (first + i == 0 && parts.size() > 1 && work.context().quirks().host_memory)
                require_memory(bytes_of(data) * static_cast<double>(parts.size()),
                               std::to_string(parts.size()) + " parts of the light with wedges of their own (technique.light_splits)");
            prepared.edges += data.edge_count;
            prepared.triangles += data.triangle_count;
            prepared.sheets += sheets;
            prepared.parts.push_back(
                upload(work, data, wedge_light(frame, parts[first + i], casters, settings, static_cast<int>(data.sheets.size()))));
            if (!linear) continue;
            prepared.parts.back().coverage = work.upload(std::span<const float>(planes_in_order(wedges, data)), "planes of wedges");
            prepared.parts.back().light.reach_x *= static_cast<float>(wedges.reach_x);
            prepared.parts.back().light.reach_y *= static_cast<float>(wedges.reach_y);
            left_out += wedges.left_out;
            unshared += wedges.unshared;
        }
    }
    if (linear) prepared.warnings = linear_warnings(frame, prepared, left_out, unshared);
    if (textured)
        set_emission(work, light, prepared);
    else
        complete_shares(prepared.parts);
    return prepared;
}

PreparedSoftShadowVolume with_emission(opencl::Work& work, const PreparedSoftShadowVolume& prepared, const Light& light)
{
    check_settings(light, prepared.settings);
    work.stage("prepare");
    PreparedSoftShadowVolume other = prepared;
    set_emission(work, light, other);
    return other;
}

void shade_soft_shadow_volume(opencl::Work& work, const PreparedSoftShadowVolume& prepared, const ReceiverPoints& receivers,
                              const cl::Buffer& visibility, ShadeCounts* counts)
{
    const ReceiverView& view = receivers.view;
    const std::size_t tiles_x = static_cast<std::size_t>(view.stride / TILE_WIDTH),
                      tiles_y = static_cast<std::size_t>(view.rows / tile_rows);
    const auto bounds = work.buffer<cl_float8>(tiles_x * tiles_y, "tile bounds");
    const auto evaluated = work.buffer<cl_uint2>(tiles_x * tiles_y, "evaluated edges and triangles");
    work.launch(prepared.program, "tile_bounds", {tiles_x, tiles_y}, {16, 1}, receivers.d.bytes() * 3, view, 0.0F, cl_float2{{0, 0}},
                receivers.xi, receivers.eta, receivers.d, bounds);

    const int device_lanes = work.context().quirks().lanes;
    const auto lanes = static_cast<std::size_t>(device_lanes), rows = static_cast<std::size_t>(item_rows(device_lanes));
    const auto width = static_cast<std::size_t>(view.stride), height = static_cast<std::size_t>(view.rows);
    const std::array<std::size_t, 2> group =
        lanes == 1 ? std::array<std::size_t, 2>{TILE_WIDTH, tile_rows} : std::array<std::size_t, 2>{1, 1};
    // Of coordinates in the camera's frame, moved by the camera's place: a few roundings of it, and what the depth there is off by.
    const float place = (0x1p-22F + 2 * static_cast<float>(receivers.precision)) *
                        std::max({std::abs(view.light_from_camera[3]), std::abs(view.light_from_camera[7]), std::abs(view.light_from_camera[11])});
    const auto seen_by = [&](WedgeLight light) {
        light.precision = static_cast<float>(receivers.precision);
        light.depth_error = view.depth_error / light.scale_d;
        light.position_error = place * std::max(light.scale_x, light.scale_y) / light.scale_d;
        return light;
    };
    if (const auto& counted = prepared.counted)
        work.launch(prepared.program, "soft_shadow_silhouettes", {width / lanes, height / rows}, group,
                    width * height * 16 + counted->edge_sets.bytes() + counted->triangle_sets.bytes(), view, seen_by(counted->light), counted->edges,
                    counted->triangles, counted->edge_supers, counted->edge_groups, counted->edge_sets, counted->triangle_supers,
                    counted->triangle_groups, counted->triangle_sets, bounds, receivers.xi, receivers.eta, receivers.d, visibility, evaluated,
                    work.stop());
    for (std::size_t i = 0; i < prepared.parts.size(); ++i) {
        const PreparedSoftShadowVolume::Part& part = prepared.parts[i];
        WedgeLight light = seen_by(part.light);
        light.first = i == 0;
        work.launch(prepared.program, "soft_shadow_volume", {width / lanes, height / rows}, group,
                    width * height * 16 + prepared.triangle_rows.bytes() + part.edges.bytes(), view, light,
                    eye_of(view, light, prepared.settings.culling == WedgeCulling::far_depth), part.sheets, part.sheet_boxes,
                    part.edge_boxes, part.edge_ends, part.edges, part.triangle_boxes, part.triangle_groups,
                    prepared.triangle_extents, prepared.triangle_rows, bounds,
                    receivers.xi, receivers.eta, receivers.d, visibility, evaluated, part.coverage,
                    static_cast<cl_int>(prepared.settings.table), work.stop());
    }
    if (!counts) return;
    work.read_later(bounds, [counts](const std::vector<cl_float8>& boxes) {
        for (const cl_float8& box : boxes) counts->receivers += static_cast<std::uint64_t>(box.s[6]);
    });
    work.read_later(evaluated, [counts](const std::vector<cl_uint2>& tiles) {
        for (const cl_uint2& tile : tiles) counts->pairs += std::uint64_t{tile.s[0]} * TILE_WIDTH * tile_rows;
    });
}

void check_together(const SoftShadowVolume& settings)
{
    if (settings.silhouettes == Silhouettes::centre) return;
    const auto refuse = [](const std::string& key, const std::string& value, const std::string& expected) {
        throw Error::at(ErrorCode::invalid_input, "technique." + key, "is " + value + " and silhouettes per_receiver", "expected " + expected + ", or silhouettes centre");
    };
    const SoftShadowVolume usual;
    if (settings.coverage != usual.coverage) refuse("coverage", std::string(coverage_names[static_cast<std::size_t>(settings.coverage)]), "analytic");
    if (settings.overlap != usual.overlap) refuse("overlap", std::string(overlap_names[static_cast<std::size_t>(settings.overlap)]), "sum: samples are counted, sheets are not joined");
    if (settings.buffer != usual.buffer) refuse("buffer", std::string(buffer_names[static_cast<std::size_t>(settings.buffer)]), "binary32");
    if (settings.light_splits != usual.light_splits) refuse("light_splits", std::to_string(settings.light_splits), "1: no silhouette stands for another");
}

Needs needs(const SoftShadowVolume&) { return {.casters = Needs::Casters::or_front}; }

PreparedSoftShadowVolume prepare(opencl::Work& work, const Casting& casting, const SoftShadowVolume& settings, Findings& findings)
{
    work.stage("topology");
    std::shared_ptr<const Topology> topology;
    Vec2 texel{0, 0};
    if (!casting.meshes.empty()) {
        topology = casting.topology();
        warn_of_edges(*topology, findings.warnings);
    } else {
        const LightDepth& maps = casting.depth;
        topology = std::make_shared<const Topology>(topology_of_maps(maps, settings.silhouettes));
        texel = {2 * maps.camera.half_extent.x / maps.width, 2 * maps.camera.half_extent.y / maps.height};
    }
    work.moved(topology->bytes());

    work.stage("prepare");
    findings.view = wedge_view(casting.light);
    PreparedSoftShadowVolume prepared = prepare_soft_shadow_volume(work, casting.light, {.topology = *topology, .texel = texel}, settings);
    findings.channels = prepared.channels;
    findings.warnings.insert(findings.warnings.end(), prepared.warnings.begin(), prepared.warnings.end());
    if (prepared.triangles == 0) findings.warnings.emplace_back("no triangle faces the light: nothing casts shadows");
    return prepared;
}

void shade(opencl::Work& work, const PreparedSoftShadowVolume& prepared, const Receiving& receivers, Shaded& shaded)
{
    const ReceiverPoints points = points_of(work, receivers, prepared.program);
    work.stage("shade");
    if (shaded.estimated)
        shaded.estimated(estimate_by_sample(work, points, prepared.program, prepared.channels, shares, [&](const ReceiverPoints& some, const cl::Buffer& to, ShadeCounts& counts) {
            shade_soft_shadow_volume(work, prepared, some, to, &counts);
        }));
    shade_soft_shadow_volume(work, prepared, points, shaded.visibility, shaded.counts);
}

std::vector<WorkAmount> work(const SoftShadowVolume& settings, const MaskShape& shape)
{
    // Every edge is a silhouette of each part, and meets every receiver.
    const double parts = static_cast<double>(settings.light_splits) * settings.light_splits;
    return {shares.of(parts * shape.lights() * shape.pixels() * shape.edges)};
}

std::vector<opencl::Specialisation> specialisations(const SoftShadowVolume& settings, int lanes)
{
    if (settings.silhouettes == Silhouettes::per_receiver) return {counting_program(lanes), program(lanes, LightShape::rectangle, settings, 1)};
    // Tables are of rectangles, in one channel or three.
    if (settings.coverage == Coverage::texture)
        return {program(lanes, LightShape::rectangle, settings, 1), program(lanes, LightShape::rectangle, settings, 3)};
    return {program(lanes, LightShape::rectangle, settings, 1), program(lanes, LightShape::disc, settings, 1)};
}

DeviceBuffers device_buffers(const SoftShadowVolume&)
{
    return {.prepare =
                Error(ErrorCode::unsupported, "soft_shadow_volume finds silhouettes on the host and cannot prepare from device buffers",
                      "prepare it from objects, or from depth maps in memory"),
            .shade = {}};
}

} // namespace penumbra
