#include <algorithm>
#include <array>
#include <cstdio>

#include <penumbra/error.hpp>

#include "depth_image/light.hpp"
#include "depth_image/quality.hpp"
#include "engine/depth_sources.hpp"
#include "engine/impl.hpp"
#include "engine/state.hpp"
#include "refine/coarse_to_fine.hpp"
#include "scene/depth.hpp"
#include "scene/parallel.hpp"
#include "technique/emission.hpp"

namespace penumbra {
namespace {

Report report_of(const Prepared::State& state, int width, int height)
{
    Report report;
    const TechniqueRequest request = request_from(state.technique);
    report.technique = request.kind;
    report.settings = request.settings;
    if (row_of(request.kind).on_host) {
        report.device_name = "host, " + std::to_string(thread_count()) + " threads";
        report.device_driver = "Embree 3";
    } else {
        report.device_name = state.device->get()->info().name;
        report.device_driver = state.device->get()->info().driver;
    }
    report.width = width;
    report.height = height;
    report.warnings = state.warnings;
    report.notes = state.notes;
    return report;
}

// A mask of a textured light has three channels, a grey texture's as well.
void make_grey(Image& image)
{
    std::vector<float> pixels;
    pixels.reserve(image.pixels.size() * 3);
    for (const float value : image.pixels) pixels.insert(pixels.end(), 3, value);
    image.pixels = std::move(pixels);
    image.channels = 3;
}

// Depth of the receivers as the light sees them: from the objects that receive, else from the surfaces that the receivers' own depth shows.
DepthMap light_view_depth(const Prepared::State& state, const Receivers& receivers, const Camera& camera, int resolution)
{
    if (state.receiver_geometry)
        return views_of(*state.receiver_geometry, &Object::receives, state.light_view, resolution, resolution, {.front = true}, state.device).front;
    const Object shown{.name = "receivers", .mesh = {}, .casts = false, .receives = true, .seen = SeenSurface{*receivers.depth, camera, 0}};
    return views_of(Geometry({shown}), &Object::receives, state.light_view, resolution, resolution, {.front = true}, state.device).front;
}

// What of the light's samples nobody knows.
void say_unknown(const ShadeCounts& counts, Report& report)
{
    if (counts.followed == 0) return;
    const auto percent = [&](std::uint64_t some) { return static_cast<double>(some) * 100 / static_cast<double>(counts.followed); };
    std::array<char, 240> text{};
    std::snprintf(text.data(), text.size(),
                  "%.1f %% of the light's samples pass behind a surface that was seen and never through one: how thick it is was guessed; "
                  "%.1f %% leave a depth image, and what is there counts as empty",
                  percent(counts.behind), percent(counts.left));
    report.notes.emplace_back(text.data());
}

void warn_of_counts(const Prepared::State& state, const ShadeCounts& counts, Report& report)
{
    say_unknown(counts, report);
    report.pairs = counts.pairs;
    if (counts.uncovered_receivers > 0 && !state.covered)
        report.warnings.push_back(
            std::to_string(counts.uncovered_receivers) + " of " + std::to_string(counts.receivers) +
            (report.receivers > 0 ? " receivers that were computed see part" : " receivers see part") +
            " of the light past the occluder map's border: what is not on the map casts no shadow on them");
}

// A bulb shines in every direction; ours shines to one side, and what lies on the other counts as lit.
void warn_of_dark_side(const Light& light, const Receivers& receivers, const Camera& camera, Report& report)
{
    if (!std::holds_alternative<PointLight>(light) && !std::holds_alternative<SphereLight>(light)) return;
    const LightFrame frame = light_frame(light);
    const Ground plane{.normal = frame.direction, .offset = frame.direction.dot(frame.origin)};
    if (shows_behind({plane}, frame, *receivers.depth, camera))
        report.warnings.push_back("receivers lie behind the " + kind_of(light) + " light, which shines to one side: they count as lit; turn its direction towards them");
}

// The technique's own step.
void shade_technique(opencl::Work& work, const Prepared::State& state, const Receiving& receivers, Shaded& shaded)
{
    std::visit([&](const auto& prepared) { shade(work, prepared, receivers, shaded); }, state.data);
}

// What the technique is to shade, on the host: a whole image, or some of its pixels as a list.
struct ToShade {
    const Camera& camera;
    const DepthMap& depth;
    const DepthSurface* surface = nullptr;            // lifted points and normals, where the depth is somebody else's
    const std::vector<DepthVector>* normals = nullptr; // null: not known
    const ChosenReceivers* chosen = nullptr;
    std::function<DepthMap(int resolution)> from_light = {};
};

// The normals of the receivers' surfaces: fitted, or of what the depth was rendered from. Null where neither is known.
const std::vector<DepthVector>* normals_of(const Receivers& receivers, const DepthSurface* surface)
{
    const std::vector<DepthVector>* normals = surface ? &surface->normals : receivers.normals ? &receivers.normals->directions : nullptr;
    return normals && normals->size() == receivers.depth->depth.size() ? normals : nullptr;
}

// The program that a technique shades with; only rays have none.
opencl::Specialisation program_of(const PreparedTechnique& data)
{
    return std::visit(
        [](const auto& prepared) -> opencl::Specialisation {
            if constexpr (requires { prepared.program; }) return prepared.program;
            return receivers_program();
        },
        data);
}

// Clips the light at the receivers' own planes, where the technique has not.
void clip(opencl::Work& work, const Prepared::State& state, const Receiving& receivers, const cl::Buffer& visibility)
{
    if (!receivers.normals || needs_of(state.technique).clips_light) return;
    work.stage("clip at horizon");
    const PixelList* list = receivers.listed;
    const Horizon horizon{.light = state.light,
                          .camera = receivers.camera,
                          .width = list ? list->width : receivers.width,
                          .height = list ? list->height : receivers.height,
                          .points = receivers.device_points ? receivers.device_points->memory() : cl::Buffer(),
                          .depth = receivers.device_depth,
                          .normals = receivers.normals->memory(),
                          .listed = list ? list->pixels.memory() : cl::Buffer(),
                          .listed_count = list ? list->count() : 0};
    clip_at_horizon(work, program_of(state.data), horizon, state.channels, visibility);
}

// What the technique made, on the host.
Image image_of(opencl::Work& work, const Prepared::State& state, const DepthMap& receivers, const opencl::Buffer<float>& visibility,
               Shaded& shaded)
{
    if (!visibility) return std::move(shaded.image);
    work.stage("read back");
    Image image{.width = receivers.width, .height = receivers.height, .channels = state.channels, .pixels = work.read(visibility)};
    if (emission_of(state.light) && state.channels == 1) make_grey(image);
    return image;
}

// Whether normals serve: techniques that trace depth images have those of fitted receivers already; rays on the host meet the surface itself.
bool wants_normals(const Prepared::State& state, const ToShade& receivers)
{
    return receivers.normals && !(needs_of(state.technique).depth_images && receivers.surface) && !row_of(kind_of(state.technique)).on_host;
}

// Receivers on the device.
struct DeviceWhole {
    opencl::Buffer<DepthVector> normals, points;
    opencl::Buffer<float> depth;
    bool has_points = false, has_normals = false;
};
DeviceWhole on_device(opencl::Work& work, const Prepared::State& state, const ToShade& receivers)
{
    DeviceWhole whole;
    if (row_of(kind_of(state.technique)).on_host) return whole;
    work.stage("upload receivers");
    const std::vector<DepthVector>* points = receivers.surface ? &receivers.surface->points : receivers.chosen ? &receivers.chosen->points : nullptr;
    whole.has_points = points != nullptr;
    whole.has_normals = wants_normals(state, receivers);
    if (points)
        whole.points = work.lend(std::span<const DepthVector>(*points), "receiver points");
    else
        whole.depth = work.lend(std::span<const float>(receivers.depth.depth), "receiver depth");
    if (whole.has_normals) whole.normals = work.lend(std::span<const DepthVector>(*receivers.normals), "receiver normals");
    return whole;
}

Receiving receiving(const Prepared::State& state, const ToShade& receivers, const DeviceWhole& whole)
{
    return {.camera = receivers.camera,
            .width = receivers.depth.width,
            .height = receivers.depth.height,
            .depth = &receivers.depth,
            .device_depth = whole.depth.memory(),
            .device_points = whole.has_points ? &whole.points : nullptr,
            .surface = receivers.surface,
            .chosen = receivers.chosen,
            .listed = nullptr,
            .normals = whole.has_normals ? &whole.normals : nullptr,
            .view = state.light_view,
            .from_light = receivers.from_light};
}

// The technique's mask of the receivers, clipped at their planes.
Image shade_image(opencl::Work& work, const Prepared::State& state, const ToShade& receivers, Shaded& shaded)
{
    const DeviceWhole whole = on_device(work, state, receivers);
    const Receiving all = receiving(state, receivers, whole);
    opencl::Buffer<float> visibility;
    if (!row_of(kind_of(state.technique)).on_host) visibility = work.buffer<float>(receivers.depth.depth.size() * static_cast<std::size_t>(state.channels), "visibility");
    shaded.visibility = visibility.memory();
    shade_technique(work, state, all, shaded);
    if (visibility) clip(work, state, all, visibility.memory());
    return image_of(work, state, receivers.depth, visibility, shaded);
}

// Some pixels of the whole as an image of their own.
class ReceiverList {
public:
    ReceiverList(const ToShade& whole, std::span<const std::uint32_t> pixels)
    {
        constexpr std::size_t tile = TILE_WIDTH * tile_rows;
        const std::size_t padded = (pixels.size() + tile - 1) / tile * tile;
        depth.width = TILE_WIDTH;
        depth.height = static_cast<int>(padded / TILE_WIDTH);
        depth.precision = whole.depth.precision;
        depth.depth.assign(padded, 0.f);
        points.assign(padded, DepthVector{0, 0, 0});
        if (whole.normals) normals.assign(padded, DepthVector{0, 0, 0});
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const std::size_t pixel = pixels[i];
            points[i] = point_of(whole, pixel);
            depth.depth[i] = points[i].z;
            if (whole.normals) normals[i] = (*whole.normals)[pixel];
        }
        if (whole.surface)
            surface = {.width = depth.width, .height = depth.height, .camera = whole.camera, .points = points, .normals = normals, .depth = depth.depth, .quality = whole.surface->quality};
    }

    DepthMap depth;
    DepthSurface surface;
    std::vector<DepthVector> points, normals;

private:
    static DepthVector point_of(const ToShade& whole, std::size_t pixel)
    {
        if (whole.surface) return whole.surface->points[pixel];
        const auto width = static_cast<std::size_t>(whole.depth.width);
        const Vec3 p = camera_point(whole.camera, whole.depth.width, whole.depth.height, static_cast<double>(pixel % width) + 0.5, static_cast<double>(pixel / width) + 0.5,
                                    whole.depth.depth[pixel]);
        return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    }
};

// Some pixels of the whole, for techniques that work on the host or on points from there.
std::vector<float> shade_on_host(opencl::Work& work, const Prepared::State& state, const ToShade& whole, std::span<const std::uint32_t> pixels, Shaded& shaded)
{
    const ReceiverList list(whole, pixels);
    const ChosenReceivers chosen{.pixels = pixels, .depth = whole.depth, .surface = whole.surface, .points = list.points};
    return shade_image(work, state,
                       {.camera = whole.camera,
                        .depth = list.depth,
                        .surface = whole.surface ? &list.surface : nullptr,
                        .normals = whole.normals ? &list.normals : nullptr,
                        .chosen = &chosen},
                       shaded)
        .pixels;
}

// Some pixels of what is on the device. In one stage: nothing waits for the device before the visibility is read.
std::vector<float> shade_on_device(opencl::Work& work, const Prepared::State& state, const Receiving& whole, std::span<const std::uint32_t> pixels, Shaded& shaded)
{
    work.stage("shade");
    const opencl::Work::OneStage one(work);
    const opencl::Buffer<cl_uint> numbers = work.lend(pixels, "receivers' pixels");
    const PixelList list{.pixels = numbers, .width = whole.width, .height = whole.height};
    Receiving listed = whole;
    listed.width = TILE_WIDTH;
    listed.height = list.rows();
    listed.listed = &list;
    const auto visibility = work.buffer<float>(list.length() * static_cast<std::size_t>(state.channels), "visibility");
    shaded.visibility = visibility.memory();
    shade_technique(work, state, listed, shaded);
    clip(work, state, listed, visibility.memory());
    std::vector<float> values = work.read(visibility);
    if (!emission_of(state.light) || state.channels != 1) return values;
    Image grey{.width = listed.width, .height = listed.height, .channels = 1, .pixels = std::move(values)};
    make_grey(grey);
    return std::move(grey.pixels);
}

// Whether some of the pixels are points of the host.
bool shades_from_host(const Prepared::State& state) { return row_of(kind_of(state.technique)).on_host || needs_of(state.technique).depth_images; }

constexpr std::size_t few_receivers = 4096;

// Shades coarse to fine, within the technique's tolerance.
Image shade_some(opencl::Work& work, const Prepared::State& state, const ToShade& whole, Shaded& shaded, Report& report)
{
    const ReceiverImage image{.camera = whole.camera,
                              .width = whole.depth.width,
                              .height = whole.depth.height,
                              .depth = whole.depth.depth,
                              .points = whole.surface ? std::span<const DepthVector>(whole.surface->points) : std::span<const DepthVector>{},
                              .normals = whole.normals ? std::span<const DepthVector>(*whole.normals) : std::span<const DepthVector>{}};
    const Needs needs = needs_of(state.technique);
    const bool from_host = shades_from_host(state);
    const DeviceWhole uploaded = from_host ? DeviceWhole{} : on_device(work, state, whole);
    const Receiving all = receiving(state, whole, uploaded);
    ShadeCounts counted;
    const auto shade_list = [&](std::span<const std::uint32_t> pixels) {
        ShadeCounts counts;
        Shaded some{.visibility = {}, .image = {}, .counts = shaded.counts ? &counts : nullptr, .estimated = {}, .bound = nullptr};
        // With what earlier lists took. A few receivers more are not worth a sample.
        if (shaded.estimated && (counted.pairs == 0 || pixels.size() > few_receivers))
            some.estimated = [&](WorkAmount amount) {
                amount.amount += static_cast<double>(counted.pairs);
                shaded.estimated(amount);
            };
        std::vector<float> values = from_host ? shade_on_host(work, state, whole, pixels, some) : shade_on_device(work, state, all, pixels, some);
        counted += counts;
        work.stage("choose receivers");
        return values;
    };
    work.stage("choose receivers");
    const int channels = emission_of(state.light) ? 3 : state.channels;
    CoarseToFine result = shade_coarse_to_fine(image, channels, {.tolerance = needs.tolerance, .proves_lit = state.proves_lit}, *state.field, shade_list);
    report.receivers = result.receivers;
    report.receivers_shaded = result.shaded;
    if (shaded.counts) *shaded.counts = counted;
    return {.width = image.width, .height = image.height, .channels = channels, .pixels = std::move(result.visibility)};
}

} // namespace

void require_bounds(const Technique& technique)
{
    if (!row_of(kind_of(technique)).bounds)
        throw Error(ErrorCode::unsupported, kind_of(technique) + " has no bounds", "depth_trace and ray_traced have");
}

std::vector<float> shade_pixels(const Prepared& prepared, const Receivers& receivers, std::span<const std::uint32_t> pixels)
{
    const Prepared::State& state = prepared.state();
    const Camera camera = resolve_camera(receivers.camera, state.light, {}, receivers.width, receivers.height, "receivers.camera");
    const std::shared_ptr<const DepthSurface> surface = surface_of(receivers, camera, state.device);
    opencl::Work work(state.device);
    const ToShade whole{.camera = camera, .depth = *receivers.depth, .surface = surface.get(), .normals = normals_of(receivers, surface.get())};
    Shaded shaded{.visibility = {}, .image = {}, .counts = nullptr, .estimated = {}, .bound = nullptr};
    if (shades_from_host(state)) return shade_on_host(work, state, whole, pixels, shaded);
    const DeviceWhole uploaded = on_device(work, state, whole);
    return shade_on_device(work, state, receiving(state, whole, uploaded), pixels, shaded);
}

Mask Engine::shade(const Prepared& prepared, const Receivers& receivers, bool bound) const { return shade_estimated(prepared, receivers, bound, {}); }

Mask shade_estimated(const Prepared& prepared, const Receivers& receivers, bool bound, const std::function<void(const WorkAmount&)>& estimated)
{
    const Prepared::State& state = prepared.state();
    if (bound) require_bounds(state.technique);
    if (!receivers.depth)
        throw Error::at(ErrorCode::invalid_input, "receivers.depth", "is missing",
                        "expected a depth map; with_depth renders it from objects");
    check_size(*receivers.depth, receivers.width, receivers.height, "receivers.depth");
    const Camera camera = resolve_camera(receivers.camera, state.light, {}, receivers.width, receivers.height, "receivers.camera");

    const Stopwatch total;
    const std::shared_ptr<const DepthSurface> surface = surface_of(receivers, camera, state.device);
    const double fit_ms = total.ms();
    Mask mask{.visibility = {}, .report = report_of(state, receivers.width, receivers.height)};
    opencl::Work work(state.device);
    const ToShade whole{.camera = camera,
                        .depth = *receivers.depth,
                        .surface = surface.get(),
                        .normals = normals_of(receivers, surface.get()),
                        .from_light = [&](int resolution) {
                            check_pixels(resolution, resolution, "technique.project_resolution");
                            const Stopwatch render;
                            DepthMap depth = light_view_depth(state, receivers, camera, resolution);
                            mask.report.stages.push_back({"render depth", render.ms(), 0, 0});
                            return depth;
                        }};
    if (surface) {
        mask.report.notes.push_back(quality_note(surface->quality, "receivers.depth"));
        const std::vector<std::string> warnings = quality_warnings(surface->quality, "receivers.depth");
        mask.report.warnings.insert(mask.report.warnings.end(), warnings.begin(), warnings.end());
    }
    if (surface && !receivers.surface) mask.report.stages.push_back({"fit receivers", fit_ms, 0, 0});
    if (shows_behind(state.grounds, light_frame(state.light), *receivers.depth, camera))
        mask.report.warnings.emplace_back("receivers lie behind ground that the occluder map was not fitted to: prepared for other receivers, it may miss "
                                          "what casts on these");
    warn_of_dark_side(state.light, receivers, camera, mask.report);
    ShadeCounts counts;
    Shaded shaded{.visibility = {}, .image = {}, .counts = &counts, .estimated = estimated, .bound = bound ? &mask.bound : nullptr};
    const bool some = state.field && !bound && !needs_of(state.technique).receivers_from_light;
    mask.visibility = some ? shade_some(work, state, whole, shaded, mask.report) : shade_image(work, state, whole, shaded);

    add_stages(mask.report.stages, work.finish());
    mask.report.shade_ms = work_ms(mask.report.stages);
    const std::uint64_t kept = state.memory->live + (state.shared ? state.shared->live.load() : 0);
    mask.report.peak_device_bytes = std::max<std::uint64_t>(state.peak_bytes, kept + work.memory().peak);
    mask.report.total_ms = total.ms();
    warn_of_counts(state, counts, mask.report);
    return mask;
}

void Engine::shade(const Prepared& prepared, const DeviceReceivers& receivers, cl_mem visibility, cl_command_queue queue) const
{
    const Prepared::State& state = prepared.state();
    if (const auto refused = device_buffers_of(state.technique).shade) throw *refused;
    if (emission_of(state.light))
        throw Error(ErrorCode::unsupported, "a textured light's mask has three channels and cannot be shaded into a device buffer",
                    "shade a depth map in memory");
    check_device_buffer(receivers.depth, receivers.width, receivers.height, "receivers.depth");
    check_device_buffer(visibility, receivers.width, receivers.height, "visibility");

    opencl::Work work(state.device->get(), queue);
    work.stage("shade");
    const Receiving given{.camera =
                                  resolve_camera(receivers.camera, state.light, {}, receivers.width, receivers.height, "receivers.camera"),
                              .width = receivers.width,
                              .height = receivers.height,
                              .depth = nullptr,
                              .device_depth = cl::Buffer(receivers.depth, true),
                              .device_points = nullptr,
                              .surface = nullptr,
                              .chosen = nullptr,
                              .listed = nullptr,
                              .normals = nullptr,
                              .view = state.light_view,
                              .from_light = {}};
    Shaded shaded{.visibility = cl::Buffer(visibility, true), .image = {}, .counts = nullptr, .estimated = {}, .bound = nullptr};
    shade_technique(work, state, given, shaded);
    work.finish();
}

} // namespace penumbra
