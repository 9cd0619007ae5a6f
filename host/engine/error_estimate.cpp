// Rays are cast at a few hundred pixels, most of them in penumbrae, the others where the mask is black, and where it says lit and may be wrong. What the rays' own
// noise adds is taken off; the pixels that are off most get more rays, so that the 99 % are no noise. It measures whatever the error comes from: texels, patterns, tolerance, surfaces that no map shows.
#include "engine/error_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include <penumbra/metrics.hpp>

#include "engine/geometry.hpp"
#include "engine/state.hpp"
#include "scene/depth.hpp"

namespace penumbra {
namespace {

constexpr std::size_t most_between = 352, most_dark = 64, most_lit = 96; // pixels: in penumbrae, without any light, with all of it
constexpr int first_rays = 512, more_rays = 4096; // a pixel; the first twice
constexpr std::size_t most_again = 48;            // pixels

// Pixels of a mask, and how many of its own each stands for.
struct Sample {
    std::vector<std::uint32_t> pixels;
    std::vector<double> weights;

    void add(const std::vector<std::uint32_t>& from, std::size_t most)
    {
        const std::size_t count = std::min(from.size(), most);
        for (std::size_t i = 0; i < count; ++i) {
            // One in each of `count` parts, at a place that differs from part to part.
            const double place = (static_cast<double>(i) + std::fmod(0.5 + 0.6180339887498949 * static_cast<double>(i), 1.0)) / static_cast<double>(count);
            pixels.push_back(from[static_cast<std::size_t>(place * static_cast<double>(from.size()))]);
            weights.push_back(static_cast<double>(from.size()) / static_cast<double>(count));
        }
    }
};

class PixelsOfMask {
public:
    explicit PixelsOfMask(const Image& mask) : mask_(mask), channels_(static_cast<std::size_t>(mask.channels)) {}

    std::size_t channels() const { return channels_; }
    const float* at(std::uint32_t pixel) const { return mask_.pixels.data() + pixel * channels_; }
    bool is_dark(const float* values) const
    {
        return std::any_of(values, values + channels_, [](float v) { return static_cast<double>(v) < shadow_below; });
    }
    bool is_black(const float* values) const
    {
        return std::all_of(values, values + channels_, [](float v) { return static_cast<double>(v) <= 1 - shadow_below; });
    }
    double apart(const float* a, const float* b) const
    {
        double sum = 0;
        for (std::size_t c = 0; c < channels_; ++c) sum += std::abs(static_cast<double>(a[c]) - static_cast<double>(b[c]));
        return sum / static_cast<double>(channels_);
    }

    Sample sample(const DepthMap& receivers) const
    {
        std::vector<std::uint32_t> between, dark, lit;
        for (std::uint32_t pixel = 0; pixel < receivers.depth.size(); ++pixel)
            if (is_there(receivers.depth[pixel])) (!is_dark(at(pixel)) ? lit : is_black(at(pixel)) ? dark : between).push_back(pixel);
        Sample sample;
        sample.add(between, most_between);
        sample.add(dark, most_dark);
        sample.add(lit, most_lit);
        return sample;
    }

private:
    const Image& mask_;
    std::size_t channels_;
};

// Errors of pixels with what they stand for; lit ones that are right are none of the shadow's.
struct Errors {
    std::vector<double> sizes, weights;

    void add(double size, double weight)
    {
        sizes.push_back(size);
        weights.push_back(weight);
    }
    double total() const { return std::accumulate(weights.begin(), weights.end(), 0.0); }
    double mean() const
    {
        double sum = 0;
        for (std::size_t i = 0; i < sizes.size(); ++i) sum += sizes[i] * weights[i];
        return sizes.empty() ? 0 : sum / total();
    }
    double below_which(double share) const
    {
        std::vector<std::size_t> order(sizes.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::ranges::sort(order, {}, [&](std::size_t i) { return sizes[i]; });
        double left = share * total();
        for (const std::size_t i : order)
            if ((left -= weights[i]) <= 0) return sizes[i];
        return order.empty() ? 0 : sizes[order.back()];
    }
};

ErrorEstimate by_rays(const PixelsOfMask& mask, const Sample& sample, const std::function<std::vector<float>(int rays, int seed, std::span<const std::uint32_t> pixels)>& trace)
{
    const std::vector<float> one = trace(first_rays, 1, sample.pixels), other = trace(first_rays, 2, sample.pixels);
    const std::size_t channels = mask.channels();
    std::vector<float> traced(sample.pixels.size() * channels);
    for (std::size_t i = 0; i < traced.size(); ++i) traced[i] = 0.5F * (one[i] + other[i]);

    const auto off = [&](std::size_t i) { return mask.apart(mask.at(sample.pixels[i]), traced.data() + i * channels); };
    std::vector<std::size_t> worst(sample.pixels.size());
    std::iota(worst.begin(), worst.end(), std::size_t{0});
    const std::size_t again = std::min(most_again, worst.size());
    std::ranges::partial_sort(worst, worst.begin() + static_cast<std::ptrdiff_t>(again), std::greater<>(), off);
    std::vector<std::uint32_t> pixels;
    for (std::size_t i = 0; i < again; ++i) pixels.push_back(sample.pixels[worst[i]]);
    const std::vector<float> more = trace(more_rays, 3, pixels);
    for (std::size_t i = 0; i < again; ++i) std::copy_n(more.data() + i * channels, channels, traced.data() + worst[i] * channels);

    Errors errors, noise;
    for (std::size_t i = 0; i < sample.pixels.size(); ++i) {
        if (!mask.is_dark(mask.at(sample.pixels[i])) && !mask.is_dark(traced.data() + i * channels)) continue;
        errors.add(off(i), sample.weights[i]);
        noise.add(0.5 * mask.apart(one.data() + i * channels, other.data() + i * channels), sample.weights[i]);
    }
    // Both add up as variances do; half of what was found is left where hardly anything but noise was.
    const double found = errors.mean(), rest = found * found - noise.mean() * noise.mean();
    return {.mean = std::max(std::sqrt(std::max(rest, 0.0)), found / 2), .p99 = errors.below_which(0.99), .pixels = sample.pixels.size(), .by = "rays"};
}

// A map of a third of the resolution: the middle of each 3 x 3 texels.
DepthMap third_of(const DepthMap& map)
{
    DepthMap third = map;
    third.fine = nullptr;
    third.width = std::max(1, (map.width + 1) / 3);
    third.height = std::max(1, (map.height + 1) / 3);
    third.depth.clear();
    for (int y = 0; y < third.height; ++y)
        for (int x = 0; x < third.width; ++x) third.depth.push_back(map.at((2 * x + 1) * map.width / (2 * third.width), (2 * y + 1) * map.height / (2 * third.height)));
    return third;
}

// Maps of a third have three times the error: the change is two of ours where all are of one sign, sqrt(10) where they are independent. Its share that was found is
// between 0.14 and 0.36 (the test of the estimate holds it).
constexpr double error_of_change = 0.3;
// 32 x 32 samples of a light resolve an edge to this on average.
constexpr double pattern_error = 0.0006;

ErrorEstimate by_thirds(const PixelsOfMask& mask, const Sample& sample, const std::vector<float>& whole, const std::vector<float>& coarse)
{
    const std::size_t channels = mask.channels();
    Errors errors;
    for (std::size_t i = 0; i < sample.pixels.size(); ++i) {
        const float *seen = mask.at(sample.pixels[i]), *exact = whole.data() + i * channels, *third = coarse.data() + i * channels;
        if (!mask.is_dark(seen) && !mask.is_dark(third)) continue;
        errors.add(std::hypot(error_of_change * mask.apart(exact, third), mask.apart(seen, exact), pattern_error), sample.weights[i]);
    }
    return {.mean = errors.mean(), .p99 = errors.below_which(0.99), .pixels = sample.pixels.size(), .by = "maps of a third"};
}

bool is_union(const Technique& technique)
{
    const auto* settings = std::get_if<SoftShadowMap>(&technique);
    return settings && settings->visibility == PatchVisibility::united && !settings->project;
}

} // namespace

double rays_of_estimate() { return static_cast<double>(most_between + most_dark + most_lit) * 2 * first_rays + static_cast<double>(most_again) * more_rays; }

std::optional<ErrorEstimate> estimate_error(const Engine& engine, const MaskJob& job, const MaskLight& light, const Light& now, const Prepared& prepared, const Receivers& receivers,
                                            const Image& image)
{
    const PixelsOfMask mask(image);
    const Sample sample = mask.sample(*receivers.depth);
    if (sample.pixels.empty()) return std::nullopt;
    if (job.geometry.state().any(&Object::casts))
        return by_rays(mask, sample, [&](int rays, int seed, std::span<const std::uint32_t> pixels) {
            return shade_pixels(engine.prepare(now, *light.occluders, job.geometry, RayTraced{.samples = rays, .seed = seed}, &receivers), receivers, pixels);
        });
    if (!is_union(job.technique) || !light.occluders->front) return std::nullopt;
    Occluders thirds = *light.occluders;
    thirds.front = third_of(*thirds.front);
    if (thirds.back) thirds.back = third_of(*thirds.back);
    for (DepthMap& layer : thirds.layers) layer = third_of(layer);
    thirds.width = thirds.front->width;
    thirds.height = thirds.front->height;
    return by_thirds(mask, sample, shade_pixels(prepared, receivers, sample.pixels),
                     shade_pixels(engine.prepare(now, thirds, job.geometry, job.technique, &receivers), receivers, sample.pixels));
}

} // namespace penumbra
