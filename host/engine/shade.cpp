#include <algorithm>

#include <penumbra/error.hpp>

#include "engine/depth_sources.hpp"
#include "engine/impl.hpp"
#include "engine/state.hpp"
#include "scene/depth.hpp"
#include "scene/parallel.hpp"

namespace penumbra {
namespace {

Report report_of(const Prepared::State& state, int width, int height)
{
    Report report;
    const TechniqueRequest request = request_from(state.technique);
    report.technique = request.kind;
    report.settings = request.settings;
    report.device_name = state.context->info().name;
    report.device_driver = state.context->info().driver;
    report.width = width;
    report.height = height;
    report.warnings = state.warnings;
    report.notes = state.notes;
    return report;
}

// Shades receiver points with whatever the state holds.
void shade_points(opencl::Work& work, const Prepared::State& state, const ReceiverPoints& points, const cl::Buffer& visibility,
                  ShadeCounts* counts)
{
    if (const auto* soft = std::get_if<PreparedSoftShadowMap>(&state.data))
        shade_soft_shadow_map(work, *soft, points, visibility, counts);
    else if (const auto* wedges = std::get_if<PreparedSoftShadowVolume>(&state.data))
        shade_soft_shadow_volume(work, *wedges, points, visibility, counts);
    else if (const auto* slices = std::get_if<PreparedOcclusionTexture>(&state.data))
        shade_occlusion_texture(work, *slices, points, visibility, counts);
    else if (const auto* smoothies = std::get_if<PreparedSmoothie>(&state.data))
        shade_smoothie(work, *smoothies, points, visibility);
    else
        shade_shadow_map(work, std::get<PreparedShadowMap>(state.data), points, visibility);
}

bool has_emission(const Light& light)
{
    const auto* rectangle = std::get_if<RectangleLight>(&light);
    return rectangle && rectangle->emission;
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

// The program that the state was prepared with.
const opencl::Specialisation& program_of(const Prepared::State& state)
{
    if (const auto* soft = std::get_if<PreparedSoftShadowMap>(&state.data)) return soft->program;
    if (const auto* wedges = std::get_if<PreparedSoftShadowVolume>(&state.data)) return wedges->program;
    if (const auto* slices = std::get_if<PreparedOcclusionTexture>(&state.data)) return slices->program;
    if (const auto* smoothies = std::get_if<PreparedSmoothie>(&state.data)) return smoothies->program;
    return std::get<PreparedShadowMap>(state.data).program;
}

// Depth of the receivers as the light sees them: from the objects that receive, else from the surfaces that the receivers' own depth shows.
DepthMap light_view_depth(const Prepared::State& state, const Receivers& receivers, const Camera& camera, int resolution)
{
    if (state.receiver_tracer) return state.receiver_tracer->front(state.light_view, resolution, resolution);
    const TriangleMesh mesh = mesh_from_depth(*receivers.depth, camera);
    const TriangleMesh* const meshes[] = {&mesh};
    return Tracer(meshes, state.light_view.frame.origin).front(state.light_view, resolution, resolution);
}

void warn_of_counts(const Prepared::State& state, const ShadeCounts& counts, Report& report)
{
    report.pairs = counts.pairs;
    if (counts.uncovered_receivers > 0 && !state.covered)
        report.warnings.push_back(
            std::to_string(counts.uncovered_receivers) + " of " + std::to_string(counts.receivers) +
            " receivers see part of the light past the occluder map's border: what is not on the map casts no shadow on them");
}

Mask shade_on_device(const Prepared::State& state, const Receivers& receivers, const Camera& camera)
{
    const Stopwatch total;
    Mask mask{.visibility = {.width = receivers.width, .height = receivers.height, .channels = 1, .pixels = {}},
              .report = report_of(state, receivers.width, receivers.height)};
    const std::size_t count = static_cast<std::size_t>(receivers.width) * static_cast<std::size_t>(receivers.height);
    const auto* soft = std::get_if<SoftShadowMap>(&state.technique);
    const int light_resolution = soft && soft->project ? soft->project_resolution : 0;

    check_pixels(light_resolution, light_resolution, "technique.project_resolution");
    DepthMap from_light;
    if (light_resolution > 0) {
        const Stopwatch render;
        from_light = light_view_depth(state, receivers, camera, light_resolution);
        mask.report.stages.push_back({"render depth", render.ms(), 0, 0});
    }

    opencl::Work work(state.context);
    const auto points_of = [&](const DepthMap& depth, const Camera& view) {
        work.stage("upload receivers");
        const auto uploaded = work.upload(std::span<const float>(depth.depth), "receiver depth");
        work.stage("receivers");
        return receiver_points(work, receiver_view(view, depth.width, depth.height, state.light_view), uploaded.memory(), depth.precision,
                               program_of(state));
    };
    const auto* wedges = std::get_if<PreparedSoftShadowVolume>(&state.data);
    const std::size_t channels = wedges ? static_cast<std::size_t>(wedges->channels) : 1;
    const auto visibility = work.buffer<float>(count * channels, "visibility");
    ShadeCounts counts;
    if (light_resolution > 0) {
        const ReceiverPoints lit_points = points_of(from_light, state.light_view);
        const auto light_mask = work.buffer<float>(from_light.depth.size(), "light-space mask");
        work.stage("shade");
        shade_points(work, state, lit_points, light_mask.memory(), &counts);
        const ReceiverPoints points = points_of(*receivers.depth, camera);
        work.stage("project");
        sample_mask(work, points, light_mask.memory(), light_resolution, light_resolution, visibility.memory(), program_of(state));
    } else {
        const ReceiverPoints points = points_of(*receivers.depth, camera);
        work.stage("shade");
        shade_points(work, state, points, visibility.memory(), &counts);
    }
    work.stage("read back");
    mask.visibility.pixels = work.read(visibility);
    mask.visibility.channels = static_cast<int>(channels);
    if (has_emission(state.light) && channels == 1) make_grey(mask.visibility);

    add_stages(mask.report.stages, work.finish());
    mask.report.shade_ms = work_ms(mask.report.stages);
    const std::uint64_t kept = state.memory->live + (state.shared ? state.shared->live.load() : 0);
    mask.report.peak_device_bytes = std::max<std::uint64_t>(state.peak_bytes, kept + work.memory().peak);
    mask.report.total_ms = total.ms();
    warn_of_counts(state, counts, mask.report);
    return mask;
}

Mask shade_with_rays(const Prepared::State& state, const Receivers& receivers, const Camera& camera)
{
    const Stopwatch watch;
    VisibilityResult result = shade_rays(std::get<PreparedRays>(state.data), *receivers.depth, camera);
    Mask mask{.visibility = std::move(result.visibility), .report = report_of(state, receivers.width, receivers.height)};
    mask.report.device_name = "host, " + std::to_string(thread_count()) + " threads";
    mask.report.device_driver = "Embree 3";
    mask.report.shade_ms = mask.report.total_ms = watch.ms();
    mask.report.stages.push_back({"shade", mask.report.shade_ms, 0, 0});
    mask.report.pairs = result.rays;
    return mask;
}

} // namespace

Mask Engine::shade(const Prepared& prepared, const Receivers& receivers) const
{
    const Prepared::State& state = prepared.state();
    if (!receivers.depth)
        throw Error(ErrorCode::invalid_input, "receivers.depth: is missing", "expected a depth map; with_depth renders it from objects");
    check_size(*receivers.depth, receivers.width, receivers.height, "receivers.depth");
    const Camera camera = resolve_camera(receivers.camera, state.light, {}, receivers.width, receivers.height, "receivers.camera");
    return std::holds_alternative<PreparedRays>(state.data) ? shade_with_rays(state, receivers, camera)
                                                            : shade_on_device(state, receivers, camera);
}

void Engine::shade(const Prepared& prepared, const DeviceReceivers& receivers, cl_mem visibility, cl_command_queue queue) const
{
    const Prepared::State& state = prepared.state();
    if (std::holds_alternative<PreparedRays>(state.data))
        throw Error(ErrorCode::unsupported, "ray_traced runs on the host and cannot shade device buffers", "shade a depth map in memory");
    if (const auto* soft = std::get_if<SoftShadowMap>(&state.technique); soft && soft->project)
        throw Error(ErrorCode::unsupported, "project renders the receivers from the light on the host and cannot shade device buffers",
                    "set project to false");
    if (has_emission(state.light))
        throw Error(ErrorCode::unsupported, "a textured light's mask has three channels and cannot be shaded into a device buffer",
                    "shade a depth map in memory");
    check_device_buffer(receivers.depth, receivers.width, receivers.height, "receivers.depth");
    check_device_buffer(visibility, receivers.width, receivers.height, "visibility");
    const Camera camera = resolve_camera(receivers.camera, state.light, {}, receivers.width, receivers.height, "receivers.camera");

    opencl::Work work(state.context, queue);
    work.stage("shade");
    const ReceiverView view = receiver_view(camera, receivers.width, receivers.height, state.light_view);
    const ReceiverPoints points = receiver_points(work, view, cl::Buffer(receivers.depth, true), 0x1p-24, program_of(state));
    shade_points(work, state, points, cl::Buffer(visibility, true), nullptr);
    work.finish();
}

} // namespace penumbra
