#include "masks/work_limits.hpp"

#include <array>
#include <cstdio>
#include <string>
#include <string_view>
#include <variant>

#include <penumbra/error.hpp>

#include "technique/occluder_maps.hpp"

namespace penumbra::server {
namespace {

std::string side_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

void check_pixels(std::string_view where, int width, int height, std::int64_t limit)
{
    if (static_cast<std::int64_t>(width) * height > limit)
        throw Error(ErrorCode::too_large, std::string(where) + ": is " + side_text(width, height),
                    "the limit of the service is " + std::to_string(limit) + " pixels");
}

void check_amount(std::string_view where, double amount, std::string_view what, std::int64_t limit)
{
    if (amount <= static_cast<double>(limit)) return;
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", amount);
    throw Error(ErrorCode::too_large, std::string(where) + ": asks for " + text.data() + " " + std::string(what),
                "the limit of the service is " + std::to_string(limit));
}

struct WorkCheck {
    const MaskTask& task;
    const Options& options;
    double pixels() const { return static_cast<double>(task.receivers->width) * task.receivers->height; }
    double lights() const { return static_cast<double>(task.lights.size()); }

    void operator()(const ShadowMap&) const {}
    void operator()(const SoftShadowMap& settings) const
    {
        double texels = 0;
        for (const TaskLight& light : task.lights) {
            const MapSize map = reduced_size(light.occluders->width, light.occluders->height, settings.resolution);
            texels += static_cast<double>(map.width) * map.height * (settings.sides == Sides::both ? 2 : 1);
        }
        if (settings.project)
            check_pixels("technique.project_resolution", settings.project_resolution, settings.project_resolution, options.receivers);
        const double points = settings.project ? static_cast<double>(settings.project_resolution) * settings.project_resolution : pixels();
        check_amount("receivers.resolution", texels * points, "pairs of occluder texel and receiver", options.pairs);
    }
    // How many edges and triangles a receiver meets is known when silhouettes are; this many are taken for granted.
    void operator()(const SoftShadowVolume& settings) const
    {
        constexpr double met = 4096;
        const double parts = static_cast<double>(settings.light_splits) * settings.light_splits;
        check_amount("technique.light_splits", parts * lights() * pixels() * met,
                     "pairs of edge and receiver, at 4096 edges a receiver and part", options.pairs);
    }
    // Lookups of a receiver, and texels of the slices that are prefiltered.
    void operator()(const OcclusionTexture& settings) const
    {
        const bool layered = settings.combine == Combine::layered || settings.combine == Combine::layered_max;
        const double textures =
            lights() * settings.light_splits * settings.light_splits * settings.slices * (layered ? settings.layers : 1);
        check_amount("technique.slices", textures * pixels(), "pairs of slice and receiver", options.pairs);
        check_amount("technique.resolution", textures * settings.resolution * settings.resolution, "texels of slices",
                     options.image_samples);
    }
    void operator()(const Smoothie&) const {}
    void operator()(const RayTraced& settings) const
    {
        check_amount("technique.samples", lights() * pixels() * settings.samples, "rays", options.rays);
    }
};

} // namespace

void check_work(const MaskTask& task, const Options& options)
{
    const Receivers& receivers = *task.receivers;
    check_pixels("receivers.resolution", receivers.width, receivers.height, options.receivers);
    double texels = 0;
    for (const TaskLight& light : task.lights) {
        const Occluders& occluders = *light.occluders;
        check_pixels("occluders.resolution", occluders.width, occluders.height, options.image_samples);
        texels += static_cast<double>(occluders.width) * occluders.height;
    }
    if (task.lights.size() > 1) {
        const double points = static_cast<double>(receivers.width) * receivers.height * static_cast<double>(task.lights.size());
        check_amount("lights", points, "receivers, over all lights", options.receivers);
        check_amount("lights", texels, "texels of occluder maps, over all lights", options.image_samples);
    }
    std::visit(WorkCheck{task, options}, task.technique);
}

} // namespace penumbra::server
