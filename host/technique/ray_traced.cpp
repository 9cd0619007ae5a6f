#include "technique/ray_traced.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include <penumbra/error.hpp>

#include "scene/depth.hpp"
#include "technique/keys.hpp"
#include "technique/work_estimate.hpp"

namespace penumbra {
namespace {

constexpr WorkKind rays{"technique.samples", WorkAmount::Unit::rays, "rays"};

// Rays for the bound do not end at what blocks them.
int rays_a_sample(bool bound) { return bound ? 2 : 1; }

// Of a receiver, on average. What adaptive spares is known when it is done: the middle, as a factor, between nothing and all.
double samples_of_all(const RayTraced& settings)
{
    if (!settings.adaptive) return settings.samples;
    return std::sqrt(static_cast<double>(settings.first_samples) * (settings.first_samples + settings.samples));
}

// So few take some seconds of one core at the most, and are not worth a sample.
constexpr double few_rays = 0x1p26;

// What all rays will take, as a few to receivers spread over the mask do: by how many things a ray comes past differs a thousandfold.
double seconds_of_all(const PreparedRays& prepared, const Receiving& receivers, double all_receivers, bool bounds)
{
    constexpr int most_receivers = 1024, most_samples = 64;
    const DepthMap& depth = *receivers.depth;
    const ChosenReceivers* list = receivers.chosen;
    std::vector<std::uint32_t> some;
    for (const int number : spread_numbers(depth.width, depth.height, static_cast<int>(std::min<std::size_t>(depth.depth.size(), most_receivers)))) {
        const auto at = static_cast<std::size_t>(number);
        if (is_there(depth.depth[at])) some.push_back(list ? list->pixels[at] : static_cast<std::uint32_t>(at));
    }
    if (some.empty()) return 0;
    const int samples = std::min(prepared.settings.samples, most_samples);
    const auto start = std::chrono::steady_clock::now();
    trace_visibility(*prepared.casters, prepared.light, list ? list->depth : depth, receivers.camera, {.samples = samples},
                     {.images = prepared.images, .surface = list ? list->surface : receivers.surface, .pixels = some});
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return seconds * all_receivers / static_cast<double>(some.size()) * samples_of_all(prepared.settings) / samples * rays_a_sample(bounds);
}

} // namespace

TechniqueRow row(const RayTraced&)
{
    using S = RayTraced;
    return {.kind = "ray_traced",
            .summary = "Stratified shadow rays through the scene's objects: the reference; runs on the host's cores (Embree).",
            .source = "Embree 3; stratified area sampling",
            .keys = {preset_key<S>(RayTraced{.preset = Preset::paper}),
                 integer_key<S>("samples", &S::samples, {1, 65536}, "rays", "shadow rays a receiver"),
                     flag_key<S>("adaptive", &S::adaptive,
                                 "first_samples rays everywhere, the rest only near receivers whose visibility is not settled"),
                     integer_key<S>("first_samples", &S::first_samples, {1, 65536}, "rays", "rays of the first pass with adaptive"),
                     integer_key<S>("seed", &S::seed, {0, INT64_MAX}, "", "same seed, same bits"),
                 tolerance_key<S>()},
            .lights = {"rectangle", "sphere", "point", "directional"},
            .textured_lights = true,
            .inputs = "objects that cast; receiver depth (or objects that receive)",
            .bounds = true,
            .on_host = true,
            .defaults = RayTraced{}};
}

void check_together(const RayTraced& settings)
{
    if (settings.adaptive && settings.tolerance > 0)
        throw Error::at(ErrorCode::invalid_input, "technique.adaptive", "is true and tolerance above 0", "expected one of them: both choose where rays are cast");
}

Needs needs(const RayTraced&) { return {.casters = Needs::Casters::required, .depth_images = true}; }

PreparedRays prepare(opencl::Work& work, const Casting& casting, const RayTraced& settings, Findings& findings)
{
    check_together(settings);
    work.stage("prepare");
    PreparedRays prepared{.settings = settings, .light = casting.light, .casters = casting.tracer(), .images = casting.images};
    work.moved(prepared.casters->bytes());
    if (prepared.casters->degenerate_count() > 0)
        findings.warnings.push_back(std::to_string(prepared.casters->degenerate_count()) + " triangles without area were left out");
    return prepared;
}

void shade(opencl::Work& work, const PreparedRays& prepared, const Receiving& receivers, Shaded& shaded)
{
    work.stage("shade");
    if (shaded.estimated) {
        const auto there = static_cast<double>(std::ranges::count_if(receivers.depth->depth, is_there));
        const bool bound = shaded.bound != nullptr;
        const double all = there * samples_of_all(prepared.settings) * rays_a_sample(bound);
        shaded.estimated(rays.of(all, all > few_rays ? seconds_of_all(prepared, receivers, there, bound) : 0));
    }
    const ChosenReceivers* chosen = receivers.chosen;
    VisibilityResult result = trace_visibility(*prepared.casters, prepared.light, chosen ? chosen->depth : *receivers.depth, receivers.camera,
                                               {.samples = prepared.settings.samples,
                                                .adaptive = prepared.settings.adaptive,
                                                .first_samples = prepared.settings.first_samples,
                                                .seed = static_cast<std::uint64_t>(prepared.settings.seed)},
                                               {.images = prepared.images,
                                                .surface = chosen ? chosen->surface : receivers.surface,
                                                .bounds = shaded.bound != nullptr,
                                                .pixels = chosen ? chosen->pixels : std::span<const std::uint32_t>{}});
    shaded.image = std::move(result.visibility);
    if (shaded.bound) *shaded.bound = std::move(result.bound);
    if (!shaded.counts) return;
    shaded.counts->pairs = result.rays;
    shaded.counts->followed = result.followed;
    shaded.counts->behind = result.behind;
    shaded.counts->left = result.left;
}

std::vector<WorkAmount> work(const RayTraced& settings, const MaskShape& shape)
{
    return {rays.of(shape.lights() * shape.pixels() * settings.samples * rays_a_sample(shape.bound))};
}

std::vector<opencl::Specialisation> specialisations(const RayTraced&, int) { return {}; }

DeviceBuffers device_buffers(const RayTraced&)
{
    return {.prepare = Error(ErrorCode::usage, "ray_traced needs objects", "prepare it from a scene"),
            .shade = Error(ErrorCode::unsupported, "ray_traced runs on the host and cannot shade device buffers",
                           "shade a depth map in memory")};
}

PreparedRays with_emission(opencl::Work& work, const PreparedRays& prepared, const Light& light)
{
    work.stage("prepare");
    return {.settings = prepared.settings, .light = light, .casters = prepared.casters, .images = prepared.images};
}

} // namespace penumbra
