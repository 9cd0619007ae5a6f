#include "technique/depth_trace.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <penumbra/error.hpp>

#include "depth_image/light.hpp"
#include "depth_image/views.hpp"
#include "technique/keys.hpp"
#include "technique/work_estimate.hpp"
#include "trace/light_samples.hpp"

namespace penumbra {
namespace {

constexpr WorkKind rays{"technique.samples", WorkAmount::Unit::rays, "rays"};

// Rays for the bound do not end at what blocks them and go one by one, not in bundles: each took 14 to 21 times as long as one for the mask.
int rays_a_sample(bool bound) { return bound ? 16 : 1; }

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
    light.own = same_place(image, receivers) ? DEPTH_OWN_PIXELS : DEPTH_OWN_PLANE;
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

// What the samples of some receivers meet on all their way: a walk for each, which is slow.
struct Followed {
    opencl::Buffer<DepthVector> points;
    opencl::Buffer<cl_uint> blocked, crossed, unknown, left;
    std::size_t count = 0;
};
Followed follow(opencl::Work& work, const PreparedDepthTrace& prepared, const Receiving& receivers, std::span<const DepthVector> points,
                std::span<const DepthVector> normals, std::size_t key_first)
{
    const std::size_t words = (static_cast<std::size_t>(prepared.samples) + 31) / 32;
    const std::vector<cl_uint> none(words * points.size(), 0);
    const auto room = [&](std::size_t count, const char* what) { return work.upload(std::span<const cl_uint>(none).first(count), what); };
    Followed followed{.points = work.upload(points, "receiver points"),
                      .blocked = room(none.size(), "blocked samples"),
                      .crossed = room(none.size(), "samples that are blocked for certain"),
                      .unknown = room(none.size(), "samples that nobody knows of"),
                      .left = room(points.size(), "samples that leave the image"),
                      .count = points.size()};
    opencl::Buffer<DepthVector> on_normals;
    if (!normals.empty()) on_normals = work.upload(normals, "receiver normals");
    for (const DeviceDepthImage& image : *prepared.images) {
        DepthLight light = light_for(prepared, image.camera, receivers.camera, !normals.empty());
        light.count = static_cast<int>(points.size());
        light.key_first = static_cast<int>(key_first);
        work.launch(prepared.program, "depth_trace", {points.size(), 1}, {64, 1}, points.size() * 24, image.view,
                    light, cl_int{1}, image.pixels, image.nearest, followed.points, on_normals, prepared.strata, prepared.step, followed.blocked,
                    followed.crossed, followed.unknown, followed.left, work.stop());
    }
    return followed;
}

// The lowest and the highest visibility of each receiver.
Image bound_of(opencl::Work& work, const PreparedDepthTrace& prepared, const Receiving& receivers, const std::vector<DepthVector>& points)
{
    work.stage("bound");
    Image bound{.width = receivers.width, .height = receivers.height, .channels = 2, .pixels = std::vector<float>(2 * points.size(), 1.f)};
    const std::size_t words = (static_cast<std::size_t>(prepared.samples) + 31) / 32;
    const std::size_t band = std::min(points.size(), std::max<std::size_t>(most_words / words / 4, 1));
    for (std::size_t first = 0; first < points.size(); first += band) {
        const std::size_t count = std::min(band, points.size() - first);
        const auto some = std::span<const DepthVector>(points).subspan(first, count);
        const auto normals = receivers.surface ? std::span<const DepthVector>(receivers.surface->normals).subspan(first, count) : std::span<const DepthVector>{};
        const Followed followed = follow(work, prepared, receivers, some, normals, first);
        const auto room = [&] { return work.buffer<float>(count, "bounds"); };
        const auto visibility = room(), low = room(), high = room();
        work.launch(prepared.program, "depth_count", {count, 1}, {64, 1}, count * (words * 12 + 16), cl_int{0},
                    static_cast<cl_int>(count), static_cast<cl_int>(prepared.samples), cl_int{1}, followed.points, followed.blocked,
                    followed.crossed, followed.unknown, visibility, low, high);
        const std::vector<float> lowest = work.read(low), highest = work.read(high);
        for (std::size_t i = 0; i < count; ++i) {
            bound.pixels[2 * (first + i)] = lowest[i];
            bound.pixels[2 * (first + i) + 1] = highest[i];
        }
    }
    return bound;
}

// Follows the samples of a grid of receivers and counts what they met.
void follow_some(opencl::Work& work, const PreparedDepthTrace& prepared, const Receiving& receivers, const std::vector<DepthVector>& points,
                 ShadeCounts& counts)
{
    work.stage("follow some");
    std::vector<DepthVector> some, normals;
    for (int y = followed_grid / 2; y < receivers.height; y += followed_grid)
        for (int x = followed_grid / 2; x < receivers.width; x += followed_grid) {
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(receivers.width) + static_cast<std::size_t>(x);
            if (!(points[i].z > 0)) continue;
            some.push_back(points[i]);
            if (receivers.surface) normals.push_back(receivers.surface->normals[i]);
        }
    if (some.empty()) return;
    const Followed followed = follow(work, prepared, receivers, some, normals, 0);
    const std::vector<cl_uint> crossed = work.read(followed.crossed), unknown = work.read(followed.unknown), left = work.read(followed.left);
    counts.followed = some.size() * static_cast<std::uint64_t>(prepared.samples);
    for (std::size_t i = 0; i < crossed.size(); ++i) counts.behind += static_cast<std::uint64_t>(std::popcount(unknown[i] & ~crossed[i]));
    for (const cl_uint samples : left) counts.left += samples;
}

} // namespace

TechniqueRow row(const DepthTrace&)
{
    using S = DepthTrace;
    return {.kind = "depth_trace",
            .summary = "Stratified shadow rays, walked through fitted depth images in the images themselves; on the OpenCL device.",
            .source = "docs/depth.md",
            .keys = {preset_key<S>(DepthTrace{.preset = Preset::paper}),
                 integer_key<S>("samples", &S::samples, {1, 65536}, "rays", "shadow rays a receiver"),
                     integer_key<S>("seed", &S::seed, {0, INT64_MAX}, "", "same seed, same bits"),
                 tolerance_key<S>()},
            .lights = {"rectangle", "sphere", "point", "directional"},
            .textured_lights = false,
            .inputs = "depth objects that cast, or occluder depth (front) from the light's centre (or objects that cast); receiver depth (or objects)",
            .bounds = true,
            .defaults = DepthTrace{}};
}

Needs needs(const DepthTrace&) { return {.casters = Needs::Casters::or_front, .depth_images = true}; }

PreparedDepthTrace prepare(opencl::Work& work, const Casting& casting, const DepthTrace& settings, Findings& findings)
{
    findings.view = casting.depth.camera;
    std::vector<DeviceDepthImage> images;
    images.reserve(casting.images.size() + 1);
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
    corners.reserve(static_cast<std::size_t>(samples));
    for (int i = 0; i < samples; ++i) corners.push_back({{strata.low_x[static_cast<std::size_t>(i)], strata.low_y[static_cast<std::size_t>(i)]}});
    return {.settings = settings,
            .program = depth_trace_program(work.context().quirks().lanes),
            .light = casting.light,
            .images = std::make_shared<const std::vector<DeviceDepthImage>>(std::move(images)),
            .strata = work.upload(std::span<const cl_float2>(corners), "strata"),
            .step = {{static_cast<float>(strata.step_x * 0x1p-16), static_cast<float>(strata.step_y * 0x1p-16)}},
            .samples = samples};
}

void shade(opencl::Work& work, const PreparedDepthTrace& prepared, const Receiving& receivers, Shaded& shaded)
{
    work.stage("receivers");
    std::vector<DepthVector> points = receivers.surface ? receivers.surface->points : receivers.chosen ? receivers.chosen->points : exact_points(receivers);
    leave_out_behind(points, prepared.light, receivers.camera);
    const auto on_points = work.upload(std::span<const DepthVector>(points), "receiver points");
    opencl::Buffer<DepthVector> normals;
    if (receivers.surface) normals = work.upload(std::span<const DepthVector>(receivers.surface->normals), "receiver normals");

    const auto there = static_cast<std::uint64_t>(std::ranges::count_if(points, [](const DepthVector& p) { return p.z > 0; }));
    const std::uint64_t all_rays = there * static_cast<std::uint64_t>(prepared.samples);
    if (shaded.estimated) shaded.estimated(rays.of(static_cast<double>(all_rays) * rays_a_sample(shaded.bound != nullptr)));
    work.stage("shade");
    const std::size_t words = (static_cast<std::size_t>(prepared.samples) + 31) / 32;
    const std::size_t bundles = (words + 1) / 2;
    const std::size_t band = std::min(points.size(), std::max<std::size_t>(most_words / words, 1));
    const std::vector<cl_uint> none(words * band, 0);
    for (std::size_t first = 0; first < points.size(); first += band) {
        const std::size_t count = std::min(band, points.size() - first);
        const auto blocked = work.upload(std::span<const cl_uint>(none).first(words * count), "blocked samples");
        for (const DeviceDepthImage& image : *prepared.images) {
            DepthLight light = light_for(prepared, image.camera, receivers.camera, receivers.surface != nullptr);
            light.first = static_cast<int>(first);
            light.count = static_cast<int>(count);
            work.launch(prepared.program, "depth_trace_bundles", {count, bundles}, {64, 1}, count * 24, image.view, light, image.pixels, image.nearest,
                        on_points, normals, prepared.strata, prepared.step, blocked, work.stop());
        }
        work.launch(prepared.program, "depth_count", {count, 1}, {64, 1}, count * (words * 4 + 16), static_cast<cl_int>(first),
                    static_cast<cl_int>(count), static_cast<cl_int>(prepared.samples), cl_int{0}, on_points, blocked, cl::Buffer(), cl::Buffer(),
                    shaded.visibility, cl::Buffer(), cl::Buffer());
    }
    if (shaded.bound) *shaded.bound = bound_of(work, prepared, receivers, points);
    if (!shaded.counts) return;
    follow_some(work, prepared, receivers, points, *shaded.counts);
    shaded.counts->receivers = there;
    shaded.counts->pairs = all_rays;
}

std::vector<WorkAmount> work(const DepthTrace& settings, const MaskShape& shape)
{
    return {rays.of(shape.lights() * shape.pixels() * settings.samples * rays_a_sample(shape.bound))};
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
