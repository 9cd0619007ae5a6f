#include "technique/soft_shadow_volume.hpp"

#include <algorithm>
#include <cmath>

#include <penumbra/error.hpp>

#include "technique/constants.hpp"
#include "technique/keys.hpp"
#include "technique/rows.hpp"

namespace penumbra {
namespace {

SoftShadowVolumeConstants constants_of(const opencl::Context& context, const LightFrame& light, const SoftShadowVolume& settings)
{
    const int lanes = context.quirks().lanes;
    return {.lanes = lanes,
            .item_rows = lanes == 1 ? 1 : tile_rows,
            .light = light.shape == LightShape::disc ? 1 : 0,
            .accumulator = static_cast<int>(settings.buffer)};
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
            .position_error = 0,
            .share = static_cast<float>(part.share),
            .sheets = sheets,
            .overlap = static_cast<int>(settings.overlap),
            .culling = settings.culling == WedgeCulling::none    ? 0
                       : settings.culling == WedgeCulling::loose ? 1
                                                                 : 2,
            .first = 0};
}

PreparedSoftShadowVolume::Part upload(opencl::Work& work, const WedgeData& data, const WedgeLight& light)
{
    const auto floats = [&](const std::vector<float>& values, const char* what) {
        return work.upload(std::span<const float>(values), what);
    };
    return {.light = light,
            .sheets = work.upload(std::span<const Sheet>(data.sheets), "sheets"),
            .sheet_boxes = floats(data.sheet_boxes, "boxes of sheets"),
            .edge_boxes = floats(data.edge_boxes, "boxes of edges"),
            .edge_ends = floats(data.edge_ends, "ends of edges"),
            .edges = floats(data.edges, "edges"),
            .triangle_boxes = floats(data.triangle_boxes, "boxes of triangles"),
            .triangle_extents = floats(data.triangle_extents, "extents of triangles"),
            .triangles = floats(data.triangles, "triangles")};
}

// The kernel adds the parts in this order and rounds each time: the last share becomes what the others leave, so that the whole light comes
// out as 1 to the bit. Where the others round to more, the largest gives way.
void complete_shares(std::vector<PreparedSoftShadowVolume::Part>& parts)
{
    for (;;) {
        float sum = 0;
        std::size_t largest = 0;
        for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
            sum += parts[i].light.share;
            if (parts[i].light.share > parts[largest].light.share) largest = i;
        }
        parts.back().light.share = 1 - sum;
        if (sum <= 1) return;
        parts[largest].light.share = std::nextafter(parts[largest].light.share, 0.0F);
    }
}

// The receivers' camera as the part's tiles see it (the kernel's `eye`).
cl_float4 eye_of(const ReceiverView& view, const WedgeLight& light, bool wanted)
{
    const float x = view.light_from_camera[3], y = view.light_from_camera[7], z = view.light_from_camera[11];
    if (!wanted || !(z > 0)) return {{0, 0, 0, 0}};
    const float d = light.scale_d / z;
    return {{x / z * light.scale_x - light.centre_x * d, y / z * light.scale_y - light.centre_y * d, d, 1}};
}

} // namespace

TechniqueRow soft_shadow_volume_row()
{
    using S = SoftShadowVolume;
    return {
        .kind = "soft_shadow_volume",
        .summary =
            "Penumbra wedges: the hard shadow of the light's centre, corrected around each silhouette edge. Exact for planar casters.",
        .source = "Assarsson: A Real-Time Soft Shadow Volume Algorithm, 2003 (Papers I to V)",
        .keys = {choice_key<S>("overlap", &S::overlap, {"sum", "max", "half_min", "product"},
                               "how sheets of triangles that hide the same light are joined; half_min is Paper IV's Eq. 1"),
                 integer_key<S>("light_splits", &S::light_splits, {1, 16}, "parts",
                                "n x n parts of a rectangle, each with silhouettes of its own: nearer to the truth, n x n preparations"),
                 choice_key<S>("buffer", &S::buffer, {"binary32", "int16", "six_bits", "twelve_bits"},
                               "what shares are added in; all but binary32 are the papers' integer buffers, for study"),
                 choice_key<S>("culling", &S::culling, {"none", "loose", "far_depth", "tight"},
                               "which wedges a tile of receivers looks at, for study: the mask is the same"),
                 real_key<S>("bias", &S::bias, {0, 16}, "half texels",
                             "of casters made from depth maps: how far along their slope they count as the receiver's own surface")},
        .lights = {"rectangle", "sphere", "point"},
        .textured_lights = false,
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
    const LightFrame frame = light_frame(light);
    if (settings.light_splits > 1 && frame.shape != LightShape::rectangle)
        throw Error(ErrorCode::invalid_input,
                    "technique.light_splits: is " + std::to_string(settings.light_splits) + " and the light a " + kind_of(light),
                    "expected 1: only rectangles are split");
    PreparedSoftShadowVolume prepared{.settings = settings,
                                      .program = constants_of(work.context(), frame, settings).specialisation(),
                                      .parts = {},
                                      .edges = 0,
                                      .triangles = 0,
                                      .sheets = 0};
    const bool extent = frame.half_u > 0 || frame.half_v > 0;
    for (const LightPart& part : parts_of(frame, extent ? settings.light_splits : 1)) {
        const Silhouette silhouette = silhouette_of(casters.topology, part.centre);
        const WedgeData data = wedge_data(casters.topology, silhouette, frame, part, settings.overlap != Overlap::sum, extent);
        prepared.edges += data.edge_count;
        prepared.triangles += data.triangle_count;
        prepared.sheets += silhouette.sheets();
        prepared.parts.push_back(upload(work, data, wedge_light(frame, part, casters, settings, static_cast<int>(data.sheets.size()))));
    }
    complete_shares(prepared.parts);
    return prepared;
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

    const auto lanes = static_cast<std::size_t>(work.context().quirks().lanes), rows = lanes == 1 ? std::size_t{1} : std::size_t{tile_rows};
    const auto width = static_cast<std::size_t>(view.stride), height = static_cast<std::size_t>(view.rows);
    const std::array<std::size_t, 2> group =
        lanes == 1 ? std::array<std::size_t, 2>{TILE_WIDTH, tile_rows} : std::array<std::size_t, 2>{1, 1};
    // Of coordinates in the camera's frame, moved by the camera's place: a few roundings of it.
    const float place = 0x1p-22F * std::max({std::abs(view.light_from_camera[3]), std::abs(view.light_from_camera[7]),
                                             std::abs(view.light_from_camera[11])});
    for (std::size_t i = 0; i < prepared.parts.size(); ++i) {
        const PreparedSoftShadowVolume::Part& part = prepared.parts[i];
        WedgeLight light = part.light;
        light.first = i == 0;
        light.precision = static_cast<float>(receivers.precision);
        light.position_error = place * std::max(light.scale_x, light.scale_y) / light.scale_d;
        work.launch(prepared.program, "soft_shadow_volume", {width / lanes, height / rows}, group,
                    width * height * 16 + part.triangles.bytes() + part.edges.bytes(), view, light,
                    eye_of(view, light, prepared.settings.culling == WedgeCulling::far_depth), part.sheets, part.sheet_boxes,
                    part.edge_boxes, part.edge_ends, part.edges, part.triangle_boxes, part.triangle_extents, part.triangles, bounds,
                    receivers.xi, receivers.eta, receivers.d, visibility, evaluated, opencl::Buffer<float>{}, cl_int{0});
    }
    if (!counts) return;
    for (const cl_float8& box : work.read(bounds)) counts->receivers += static_cast<std::uint64_t>(box.s[6]);
    for (const cl_uint2& tile : work.read(evaluated)) counts->pairs += std::uint64_t{tile.s[0]} * TILE_WIDTH * tile_rows;
}

} // namespace penumbra
