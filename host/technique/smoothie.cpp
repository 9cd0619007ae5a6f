#include "technique/smoothie.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <numbers>
#include <numeric>

#include <penumbra/error.hpp>

#include "technique/keys.hpp"
#include "technique/smoothie_work.hpp"

namespace penumbra {
namespace {

constexpr std::size_t group_size = SMOOTHIE_GROUP;
constexpr int spreads = 3; // texels that receivers are spread over where none is seen

constexpr Names<2> t_from_names{"light", "t"};
constexpr Names<2> silhouettes_names{"object", "image"};
constexpr Names<2> falloff_names{"sinusoidal", "linear"};

opencl::Specialisation program(int lanes)
{
    return {"smoothie.cl", {{"LANES", std::to_string(lanes)}, {"TILE_ROWS", std::to_string(tile_rows)}}};
}

// A point of the light's image: tangents (orthographic: lengths), and disparity.
struct Point {
    double x, y, d;
};

Vec3 in_camera(const Camera& camera, const Vec3& world)
{
    const Vec3 from = world - camera.frame.origin;
    return {from.dot(camera.frame.x), from.dot(camera.frame.y), -from.dot(camera.frame.z)};
}

Point seen(const Camera& camera, const Vec3& p)
{
    const double scale = camera.orthographic ? 1 : 1 / p.z;
    return {p.x * scale, p.y * scale, 1 / p.z};
}

struct Box {
    double low_x = 1e30, high_x = -1e30, low_y = 1e30, high_y = -1e30, near = 0;
    void add(const Point& p)
    {
        low_x = std::min(low_x, p.x);
        high_x = std::max(high_x, p.x);
        low_y = std::min(low_y, p.y);
        high_y = std::max(high_y, p.y);
        near = std::max(near, p.d);
    }
};

// Outwards by two roundings of binary32: the box still holds what was rounded into it.
void write_box(float* block, const Box& box)
{
    const auto wider = [](double value, double sign) { return static_cast<float>(value + sign * std::abs(value) * 0x1p-22); };
    block[0] = wider(box.low_x, -1);
    block[16] = wider(box.high_x, 1);
    block[32] = wider(box.low_y, -1);
    block[48] = wider(box.high_y, 1);
    block[64] = wider(box.near, 1);
}

// Half of the light's size: of a rectangle the radius of the disc of its area, since smoothies do not know the light's shape (the paper's
// assumption, 2.1).
double light_radius(const LightFrame& light)
{
    return light.shape == LightShape::disc || light.directional ? light.half_u
                                                                : std::sqrt(4 * light.half_u * light.half_v / std::numbers::pi);
}

void check_settings(const Smoothie& settings)
{
    if (settings.t_from == SmoothieWidth::light && settings.t != Smoothie{}.t)
        throw Error::at(ErrorCode::invalid_input, "technique.t",
                        "is " + std::to_string(settings.t) + " and t_from light, which makes t of the light's size",
                        "set technique.t_from to \"t\", or leave t out");
}

SmoothieView view_of(const OccluderDepth& depth, const SmoothieEdges& edges, const Smoothie& settings)
{
    const Vec2& half = depth.camera.half_extent;
    const bool fixed = settings.t_from == SmoothieWidth::t;
    const double step_x = 2 * half.x / depth.width, step_y = 2 * half.y / depth.height;
    return {.width = depth.width,
            .height = depth.height,
            .left = static_cast<float>(-half.x + 0.5 * step_x),
            .top = static_cast<float>(half.y - 0.5 * step_y),
            .step_x = static_cast<float>(step_x),
            .step_y = static_cast<float>(step_y),
            .fixed_width = fixed ? static_cast<float>(settings.t * std::max(half.x, half.y)) : 0.0F,
            .light = fixed ? 0.0F : static_cast<float>(light_radius(depth.light)),
            .orthographic = depth.camera.orthographic ? 1 : 0,
            .groups = edges.groups,
            .two_sided = settings.two_sided ? 1 : 0,
            .sinusoidal = settings.falloff == Falloff::sinusoidal ? 1 : 0};
}

struct ReceiverDepths {
    opencl::Buffer<cl_int> nearest, furthest;
};

// The nearest and the furthest receiver of every texel, spread into the texels where none is seen; the furthest of the texels around too.
ReceiverDepths receiver_depths(opencl::Work& work, const PreparedSmoothie& prepared, const ReceiverPoints& receivers)
{
    const std::size_t width = static_cast<std::size_t>(prepared.view.width), height = static_cast<std::size_t>(prepared.view.height);
    const std::size_t count = width * height;
    const auto filled = [&](float value) {
        const std::vector<cl_int> bits(count, std::bit_cast<cl_int>(value));
        return work.upload(std::span<const cl_int>(bits), "depths of receivers");
    };
    ReceiverDepths depths{filled(0), filled(NO_RECEIVER)},
        other{work.buffer<cl_int>(count, "nearest receivers, spread"), work.buffer<cl_int>(count, "furthest receivers, spread")};
    work.launch(prepared.program, "receiver_depths",
                {static_cast<std::size_t>(receivers.view.width), static_cast<std::size_t>(receivers.view.height)}, {16, 8},
                receivers.d.bytes() * 3, receivers.view, prepared.occluders, receivers.xi, receivers.eta, receivers.d, depths.nearest,
                depths.furthest);
    for (int i = 0; i < spreads; ++i) {
        work.launch(prepared.program, "spread_receivers", {width, height}, {16, 8}, count * 16,
                    cl_int2{{prepared.view.width, prepared.view.height}}, cl_int{i == 0}, depths.nearest, depths.furthest, other.nearest,
                    other.furthest);
        std::swap(depths, other);
    }
    return depths;
}

// Of each texel where the nearest is that hides nothing; nothing where no fin goes inwards.
opencl::Buffer<cl_int2> bare_places(opencl::Work& work, const PreparedSmoothie& prepared, const ReceiverDepths& receivers)
{
    const SmoothieView& view = prepared.view;
    if (!view.two_sided) return work.buffer<cl_int2>(1, "bare texels");
    const std::size_t width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(view.height), count = width * height;
    const cl_int2 size{{view.width, view.height}};
    const auto in_row = work.buffer<cl_int>(count, "bare texels in rows");
    auto places = work.buffer<cl_int2>(count, "bare texels");
    work.launch(prepared.program, "bare_in_row", {width, height}, {16, 8}, count * 24, size, prepared.map.texels, receivers.nearest, receivers.furthest,
                in_row);
    work.launch(prepared.program, "bare_place", {width, height}, {16, 8}, count * 16, size, cl_float2{{view.step_x, view.step_y}}, in_row, places);
    return places;
}

// The light's centre; of a directional light a point so far against its direction that its rays are parallel to a ten-thousandth.
Vec3 viewpoint(const LightFrame& frame, const Camera& camera, const Topology& topology)
{
    if (!frame.directional) return frame.origin;
    double reach = 0;
    for (const Imath::V3f& vertex : topology.vertices()) reach = std::max(reach, (Vec3(vertex) - camera.frame.origin).length());
    return camera.frame.origin - frame.direction * (1e4 * reach);
}

// Whether a caster's edges are not those of its triangles alone.
bool any_cut_out(const Casting& casting)
{
    return std::ranges::any_of(casting.meshes, [](const TriangleMesh* mesh) { return mesh->cut_outs != nullptr; });
}

// Of the objects that cast, or of the surfaces that the map shows.
std::shared_ptr<const Topology> topology_of(const Casting& casting, const Smoothie& settings)
{
    const bool of_objects = !casting.meshes.empty() && !any_cut_out(casting) && settings.silhouettes == SilhouetteSource::object;
    if (of_objects) return casting.topology();
    const TriangleMesh surfaces = mesh_of_texels(*casting.depth.front, casting.depth.camera);
    const TriangleMesh* const meshes[] = {&surfaces};
    return std::make_shared<const Topology>(meshes);
}

// As published.
Smoothie paper_settings()
{
    Smoothie settings;
    settings.preset = Preset::paper;
    settings.t_from = SmoothieWidth::t;
    settings.two_sided = false;
    settings.tolerance = 0;
    return settings;
}

} // namespace

TechniqueRow row(const Smoothie&)
{
    using S = Smoothie;
    return {
        .kind = "smoothie",
        .summary = "A shadow map with fins at its silhouettes: soft edges that harden at contact, for little more than the map; the "
                   "umbra stays whole.",
        .source = "Chan, Durand: Rendering Fake Soft Shadows with Smoothies, Eurographics Symposium on Rendering 2003",
        .keys = {preset_key<S>(paper_settings()),
                 choice_key<S>("t_from", &S::t_from, t_from_names, "how wide smoothies are: as half of what the light's size casts, or t"),
                 real_key<S>("t", &S::t, {0, 2}, "half widths of the light's image", "the paper's t; with t_from t"),
                 choice_key<S>("silhouettes", &S::silhouettes, silhouettes_names,
                               "edges of the objects that cast, or of the depth map; without objects: of the map"),
                 choice_key<S>("falloff", &S::falloff, falloff_names, "of visibility across a smoothie"),
                 flag_key<S>("two_sided", &S::two_sided,
                             "a smoothie on either side of the silhouette, half lit on it, so that the umbra shrinks; false: the paper's, outwards alone"),
                 real_key<S>("bias", &S::bias, {0, 16}, "derived bounds",
                             "self-shadow bound from the surface's slope; 1 is the bound, 0 none"),
                 tolerance_key<S>()},
        .lights = {"rectangle", "sphere", "point", "directional"},
        .textured_lights = false,
        .inputs = "occluder depth (front) from the light's centre (or objects that cast); objects that cast, for their silhouettes; "
                  "receiver depth (or objects)",
        .defaults = Smoothie{}};
}

SmoothieEdges smoothie_edges(const Topology& topology, const Silhouette& silhouette, const Camera& camera)
{
    const auto vertex = [&](std::uint32_t i) { return in_camera(camera, Vec3(topology.vertices()[i])); };
    double furthest = 0;
    for (const SilhouetteEdge& edge : silhouette.edges) furthest = std::max({furthest, vertex(edge.from).z, vertex(edge.to).z});
    const double near = furthest * 0x1p-10;

    SmoothieEdges result;
    std::vector<std::array<Point, 2>> kept;
    for (const SilhouetteEdge& edge : silhouette.edges) {
        Vec3 a = vertex(edge.from), b = vertex(edge.to);
        if (!(a.z > near) && !(b.z > near)) continue;
        const Vec3 cut = a.z < near || b.z < near ? a + (b - a) * ((near - a.z) / (b.z - a.z)) : a;
        if (a.z < near) a = cut;
        if (b.z < near) b = cut;
        kept.push_back({seen(camera, a), seen(camera, b)});
    }
    result.count = kept.size();
    result.groups = static_cast<int>((kept.size() + group_size - 1) / group_size);
    const std::size_t groups = static_cast<std::size_t>(result.groups);
    result.boxes.resize((groups + 15) / 16 * 80, 0.0F); // a box of disparity 0 is never met
    result.edge_boxes.resize(groups * 80, 0.0F);
    result.edges.resize(groups * group_size * 8, 0.0F);
    for (std::size_t group = 0; group < groups; ++group) {
        Box all;
        for (std::size_t i = group * group_size; i < std::min(kept.size(), (group + 1) * group_size); ++i) {
            const auto& [a, b] = kept[i];
            Box own;
            own.add(a);
            own.add(b);
            all.add(a);
            all.add(b);
            write_box(result.edge_boxes.data() + group * 80 + i % group_size, own);
            const double square = (b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y);
            const std::array<double, 7> values{a.x, a.y, b.x, b.y, a.d, b.d, square > 1e-30 ? 1 / square : 0};
            std::transform(values.begin(), values.end(), result.edges.data() + i * 8,
                           [](double value) { return static_cast<float>(value); });
        }
        write_box(result.boxes.data() + group / 16 * 80 + group % 16, all);
    }
    return result;
}

PreparedSmoothie prepare_smoothie(opencl::Work& work, const OccluderDepth& depth, const SmoothieEdges& edges, const Smoothie& settings)
{
    check_settings(settings);
    const MapSize size{depth.width, depth.height};
    const opencl::Specialisation built = program(work.context().quirks().lanes);
    return {.settings = settings,
            .program = built,
            .occluders = occluder_view(depth.light, depth.camera, size),
            .view = view_of(depth, edges, settings),
            .precision = depth.precision,
            .map = occluder_map(work, depth.front, size, size, Reduction::area, depth.precision, built),
            .boxes = work.upload(std::span<const float>(edges.boxes), "boxes of silhouettes"),
            .edge_boxes = work.upload(std::span<const float>(edges.edge_boxes), "boxes of silhouette edges"),
            .edges = work.upload(std::span<const float>(edges.edges), "silhouette edges")};
}

void shade_smoothie(opencl::Work& work, const PreparedSmoothie& prepared, const ReceiverPoints& receivers, const cl::Buffer& visibility, Shaded* wanted)
{
    const SmoothieView& view = prepared.view;
    const std::size_t width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(view.height), count = width * height;
    const ReceiverDepths depths_of = receiver_depths(work, prepared, receivers);
    const auto fin_distances = work.buffer<float>(count, "smoothie distance"), depths = work.buffer<float>(count, "smoothie disparity");
    const std::size_t inner = view.two_sided ? count : 1;
    const auto distances = work.buffer<float>(inner, "inner distance"), inner_depths = work.buffer<float>(inner, "inner disparity");
    const std::size_t lanes = static_cast<std::size_t>(work.context().quirks().lanes);
    const SmoothieGrid grid_of_texels{.lanes = static_cast<int>(lanes), .columns = static_cast<int>((width + lanes - 1) / lanes), .rows = static_cast<int>((height + SmoothieGrid::item_rows - 1) / SmoothieGrid::item_rows)};
    const auto evaluated = work.buffer<cl_uint>(grid_of_texels.items(), "evaluated edges");
    const auto bare = bare_places(work, prepared, depths_of);
    const auto search = [&](std::size_t rows) {
        work.launch(prepared.program, "smoothie_buffer", {static_cast<std::size_t>(grid_of_texels.columns), rows},
                    {lanes == 1 ? std::size_t{16} : std::size_t{1}, 1}, count * 24 + prepared.edges.bytes(), view, prepared.boxes,
                    prepared.edge_boxes, prepared.edges, prepared.map.texels, depths_of.nearest, depths_of.furthest, bare, fin_distances, depths,
                    distances, inner_depths, evaluated, work.stop());
    };
    const auto all_rows = static_cast<std::size_t>(grid_of_texels.rows);
    if (wanted && wanted->estimated) {
        WorkAmount estimate = estimate_smoothie(view, grid_of_texels, {work.read(prepared.boxes), work.read(prepared.edge_boxes)}, work.read(depths_of.nearest), work.read(depths_of.furthest));
        if (estimate.amount > few_smoothie_pairs)
            estimate.seconds = estimate.amount / smoothie_rate(all_rows, [&](std::size_t rows) {
                                   const auto start = std::chrono::steady_clock::now();
                                   search(rows);
                                   const std::vector<cl_uint> edges = work.read(evaluated); // waits for the device
                                   const auto done = edges.begin() + static_cast<std::ptrdiff_t>(rows) * grid_of_texels.columns;
                                   return SmoothieSample{.pairs = std::accumulate(edges.begin(), done, 0.0) * grid_of_texels.item_texels(),
                                                         .seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
                               });
        wanted->estimated(estimate);
    }
    search(all_rows);
    const std::array<std::size_t, 2> grid{static_cast<std::size_t>(receivers.view.width), static_cast<std::size_t>(receivers.view.height)};
    work.launch(prepared.program, "smoothie_composite", grid, {16, 8}, grid[0] * grid[1] * 16, receivers.view, prepared.occluders, view,
                static_cast<float>(prepared.settings.bias), static_cast<float>(std::max(prepared.precision, receivers.precision)),
                static_cast<cl_int>(receivers.has_planes), prepared.map.texels, prepared.map.steps, fin_distances, depths, distances, inner_depths, receivers.xi, receivers.eta,
                receivers.d, receivers.planes, visibility);
    if (!wanted || !wanted->counts) return;
    for (const cl_uint edges : work.read(evaluated)) wanted->counts->pairs += std::uint64_t{edges} * static_cast<std::uint64_t>(grid_of_texels.item_texels());
}

// Fins reach beyond what casts, and t is in parts of the view.
Needs needs(const Smoothie&) { return {.front = true, .whole_view = true, .every_receiver = true}; } // as wide as its fins

PreparedSmoothie prepare(opencl::Work& work, const Casting& casting, const Smoothie& settings, Findings& findings)
{
    const LightDepth& maps = casting.depth;
    findings.view = maps.camera;

    work.stage("topology");
    if (casting.meshes.empty() && settings.silhouettes == SilhouetteSource::object)
        findings.warnings.emplace_back("there are no objects that cast: silhouettes are those of the depth map (silhouettes image)");
    if (any_cut_out(casting) && settings.silhouettes == SilhouetteSource::object)
        findings.warnings.emplace_back("materials cut casters out: silhouettes are those of the depth map (silhouettes image)");
    const std::shared_ptr<const Topology> topology = topology_of(casting, settings);
    work.moved(topology->bytes());

    work.stage("silhouettes");
    const Silhouette silhouette = silhouette_of(*topology, viewpoint(light_frame(casting.light), maps.camera, *topology));
    const SmoothieEdges edges = smoothie_edges(*topology, silhouette, maps.camera);
    work.moved(edges.edges.size() * sizeof(float));
    findings.notes.push_back(std::to_string(edges.count) + " silhouette edges wear smoothies");
    if (edges.count == 0) findings.warnings.emplace_back("there are no silhouettes before the light: shadows have hard edges");

    const DeviceDepth uploaded = on_device(work, casting, true, false);
    work.stage("shadow map");
    return prepare_smoothie(work, uploaded.depth, edges, settings);
}

void shade(opencl::Work& work, const PreparedSmoothie& prepared, const Receiving& receivers, Shaded& shaded)
{
    const ReceiverPoints points = points_with_planes(work, receivers, prepared.program);
    work.stage("shade");
    shade_smoothie(work, prepared, points, shaded.visibility, &shaded);
}

std::vector<WorkAmount> work(const Smoothie&, const MaskShape& shape)
{
    // Each texel of a map is searched for fins, at the most of every edge.
    double texels = 0;
    for (const MaskShape::Map& map : shape.occluders) texels += static_cast<double>(map.width) * map.height;
    return {smoothie_pairs.of(texels * shape.edges)};
}

std::vector<opencl::Specialisation> specialisations(const Smoothie&, int lanes) { return {program(lanes)}; }

DeviceBuffers device_buffers(const Smoothie&)
{
    return {.prepare = Error(ErrorCode::unsupported, "smoothie finds silhouettes on the host and cannot prepare from device buffers",
                             "prepare it from objects, or from depth maps in memory"),
            .shade = {}};
}

} // namespace penumbra
