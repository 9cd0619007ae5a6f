#include "technique/depth_trace.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <penumbra/error.hpp>

#include "depth_image/light.hpp"
#include "depth_image/views.hpp"
#include "technique/keys.hpp"
#include "trace/light_samples.hpp"

namespace penumbra {
namespace {

// Receivers of one launch: their samples' bits stay within 64 MiB.
constexpr std::size_t most_words = std::size_t{1} << 24;

DeviceDepthImage on_device(opencl::Work& work, const DepthImage& image)
{
    return {.camera = image.camera,
            .view = image.view,
            .pixels = work.upload(std::span<const DepthPixel>(image.pixels), "depth image"),
            .nearest = work.upload(std::span<const float>(image.nearest), "depth image's pyramid")};
}

// The light as an image's camera sees it.
DepthLight light_for(const PreparedDepthTrace& prepared, const Camera& image, const Camera& receivers, bool has_normals)
{
    DepthLight light = depth_light(prepared.light, image, receivers);
    light.samples = prepared.samples;
    light.has_normals = has_normals;
    light.own = 1;
    const auto seed = static_cast<std::uint64_t>(prepared.settings.seed);
    light.seed_low = std::bit_cast<int>(static_cast<std::uint32_t>(seed));
    light.seed_high = std::bit_cast<int>(static_cast<std::uint32_t>(seed >> 32));
    return light;
}

// Receivers of depth that is exact: the points of the pixels' centres, not lifted.
std::vector<DepthVector> exact_points(const Receiving& receivers)
{
    std::vector<DepthVector> points(receivers.depth->depth.size());
    for (int y = 0; y < receivers.height; ++y)
        for (int x = 0; x < receivers.width; ++x) {
            const float depth = receivers.depth->at(x, y);
            if (!std::isfinite(depth) || !(depth > 0)) continue;
            const Vec3 p = camera_point(receivers.camera, receivers.width, receivers.height, x + .5, y + .5, depth);
            points[static_cast<std::size_t>(y) * static_cast<std::size_t>(receivers.width) + static_cast<std::size_t>(x)] = {
                static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
        }
    return points;
}

// What lies behind the light's plane is not shaded.
void leave_out_behind(std::vector<DepthVector>& points, const Light& light, const Camera& camera)
{
    const LightFrame frame = light_frame(light);
    if (frame.directional) return;
    for (DepthVector& p : points)
        if (p.z > 0 && light_from_world(frame, world_from_camera(camera, Vec3(p.x, p.y, p.z))).z <= 0) p.z = 0;
}

} // namespace

TechniqueRow row(const DepthTrace&)
{
    using S = DepthTrace;
    return {.kind = "depth_trace",
            .summary = "Stratified shadow rays, walked through fitted depth images in the images themselves; on the OpenCL device.",
            .source = "docs/depth.md",
            .keys = {integer_key<S>("samples", &S::samples, {1, 65536}, "rays", "shadow rays a receiver"),
                     integer_key<S>("seed", &S::seed, {0, INT64_MAX}, "", "same seed, same bits")},
            .lights = {"rectangle", "sphere", "point", "directional"},
            .textured_lights = false,
            .inputs = "depth objects that cast, or occluder depth (front) from the light's centre (or objects that cast); receiver depth (or objects)",
            .defaults = DepthTrace{}};
}

Needs needs(const DepthTrace&) { return {.casters = Needs::Casters::or_front, .depth_images = true}; }

PreparedDepthTrace prepare(opencl::Work& work, const Casting& casting, const DepthTrace& settings, Findings& findings)
{
    findings.view = casting.depth.camera;
    std::vector<DeviceDepthImage> images;
    for (const auto& image : casting.images) images.push_back(on_device(work, *image));
    if (casting.depth.front) {
        work.stage("fit depth");
        const DepthFit fit = fit_depth(work, *casting.depth.front, casting.depth.camera);
        images.push_back(on_device(work, depth_image(fit, casting.depth.camera, 0, casting.depth.back)));
        if (fit.quality.pixels == 0) findings.warnings.emplace_back("the occluder map is empty: nothing casts shadows");
    }
    work.stage("prepare");
    const LightFrame frame = light_frame(casting.light);
    const bool flat_x = frame.half_u == 0, flat_y = frame.half_v == 0;
    const int samples = flat_x && flat_y ? 1 : settings.samples;
    const Strata strata = make_strata(samples, flat_x, flat_y);
    std::vector<cl_float2> corners;
    for (int i = 0; i < samples; ++i) corners.push_back({{strata.low_x[static_cast<std::size_t>(i)], strata.low_y[static_cast<std::size_t>(i)]}});
    return {.settings = settings,
            .light = casting.light,
            .images = std::make_shared<const std::vector<DeviceDepthImage>>(std::move(images)),
            .strata = work.upload(std::span<const cl_float2>(corners), "strata"),
            .step = {{static_cast<float>(strata.step_x * 0x1p-16), static_cast<float>(strata.step_y * 0x1p-16)}},
            .samples = samples};
}

void shade(opencl::Work& work, const PreparedDepthTrace& prepared, const Receiving& receivers, Shaded& shaded)
{
    work.stage("receivers");
    std::vector<DepthVector> points = receivers.surface ? receivers.surface->points : exact_points(receivers);
    leave_out_behind(points, prepared.light, receivers.camera);
    const auto on_points = work.upload(std::span<const DepthVector>(points), "receiver points");
    opencl::Buffer<DepthVector> normals;
    if (receivers.surface) normals = work.upload(std::span<const DepthVector>(receivers.surface->normals), "receiver normals");

    work.stage("shade");
    const std::size_t words = (static_cast<std::size_t>(prepared.samples) + 31) / 32;
    const std::size_t bundles = (words + 1) / 2;
    const opencl::Specialisation program = depth_trace_program(work.context().quirks().lanes);
    const std::size_t band = std::min(points.size(), std::max<std::size_t>(most_words / words, 1));
    const std::vector<cl_uint> none(words * band, 0);
    for (std::size_t first = 0; first < points.size(); first += band) {
        const std::size_t count = std::min(band, points.size() - first);
        const auto blocked = work.upload(std::span<const cl_uint>(none).first(words * count), "blocked samples");
        for (const DeviceDepthImage& image : *prepared.images) {
            DepthLight light = light_for(prepared, image.camera, receivers.camera, receivers.surface != nullptr);
            light.first = static_cast<int>(first);
            light.count = static_cast<int>(count);
            work.launch(program, "depth_trace_bundles", {count, bundles}, {64, 1}, count * 24, image.view, light, image.pixels, image.nearest,
                        on_points, normals, prepared.strata, prepared.step, blocked);
        }
        work.launch(program, "depth_count", {count, 1}, {64, 1}, count * (words * 4 + 16), static_cast<cl_int>(first),
                    static_cast<cl_int>(count), static_cast<cl_int>(prepared.samples), cl_int{0}, on_points, blocked, cl::Buffer(), cl::Buffer(),
                    shaded.visibility, cl::Buffer(), cl::Buffer());
    }
    if (!shaded.counts) return;
    const auto there = std::count_if(points.begin(), points.end(), [](const DepthVector& p) { return p.z > 0; });
    shaded.counts->receivers = static_cast<std::uint64_t>(there);
    shaded.counts->pairs = static_cast<std::uint64_t>(there) * static_cast<std::uint64_t>(prepared.samples);
}

std::vector<WorkAmount> work(const DepthTrace& settings, const MaskShape& shape)
{
    return {{"technique.samples", shape.lights() * shape.pixels() * settings.samples, WorkAmount::Unit::rays, "rays"}};
}

std::vector<opencl::Specialisation> specialisations(const DepthTrace&, int lanes) { return {depth_trace_program(lanes)}; }

DeviceBuffers device_buffers(const DepthTrace&)
{
    return {.prepare = Error(ErrorCode::unsupported, "depth_trace fits depth on the host as well and cannot prepare from device buffers",
                             "prepare it from objects, or from depth maps in memory"),
            .shade = Error(ErrorCode::unsupported, "depth_trace takes its receivers from the host and cannot shade device buffers",
                           "shade a depth map in memory")};
}

} // namespace penumbra
