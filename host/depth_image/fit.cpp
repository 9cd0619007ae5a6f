#include "depth_image/fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "depth_image/edges.hpp"
#include "scene/memory.hpp"
#include "scene/parallel.hpp"
#include "scene/stop.hpp"

namespace penumbra {
namespace {

constexpr int pad = 16;        // DEPTH_PAD of depth_fit.cl
constexpr int ramp_width = 3;  // half the width of smeared edges' ramps
constexpr int hole_width = 3;  // holes up to twice this are closed

// The disparity's last place at a depth, from how it was stored.
double step_at(const DepthStep& step, double depth, bool orthographic)
{
    // An error of the depth is one of the disparity over the depth's square.
    const double per_depth = orthographic ? 1 : 1 / (depth * depth);
    double result = step.depth * per_depth;
    if (!orthographic) result += step.disparity;
    else result += step.disparity * depth * depth;
    if (step.mantissa_bits > 0) result += std::ldexp(1.0, std::ilogb(depth / step.unit) - step.mantissa_bits) * step.unit * per_depth;
    return result;
}

// Standard error of a value over the value, from second differences along rows and columns: noise has them, planes have none.
double relative_noise(const std::vector<float>& value, int width, int height)
{
    std::vector<float> second;
    second.reserve(2 * value.size());
    const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x); };
    const auto take = [&](std::size_t before, std::size_t here, std::size_t after) {
        if (value[before] > 0 && value[here] > 0 && value[after] > 0)
            second.push_back(std::abs((value[before] - value[here]) + (value[after] - value[here])) / value[here]);
    };
    const int margin_x = width > 8 ? 2 : 0, margin_y = height > 8 ? 2 : 0;
    for (int y = margin_y; y < height - margin_y; ++y) {
        check_stop();
        for (int x = margin_x; x < width - margin_x; ++x) {
            if (x > 0 && x + 1 < width) take(at(x - 1, y), at(x, y), at(x + 1, y));
            if (y > 0 && y + 1 < height) take(at(x, y - 1), at(x, y), at(x, y + 1));
        }
    }
    constexpr double least = 3e-8; // of float32's own rounding
    if (second.empty()) return least;
    const auto middle = second.begin() + static_cast<std::ptrdiff_t>(second.size() / 2);
    std::nth_element(second.begin(), middle, second.end());
    // The median of a normal distribution's size is .6745 of its deviation; a second difference has the variance of 1 + 4 + 1 values.
    return std::max(static_cast<double>(*middle) / .6745 / std::sqrt(6.0), least);
}

// The least window whose normal is certain to .03 radians.
int reach_for(double relative_error, double pixel)
{
    const double side = std::sqrt(3.46 * relative_error / (pixel * .03));
    return static_cast<int>(std::clamp(std::ceil((side - 1) / 2), 2., 8.));
}

double median_of(std::vector<float> numbers)
{
    if (numbers.empty()) return 0;
    const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
    std::nth_element(numbers.begin(), middle, numbers.end());
    return *middle;
}

// An image in a frame of nothing.
std::vector<float> padded(const std::vector<float>& image, int width, int height, int stride)
{
    std::vector<float> result(static_cast<std::size_t>(stride) * static_cast<std::size_t>(height + 2 * pad));
    for (int y = 0; y < height; ++y)
        std::copy_n(image.begin() + static_cast<std::ptrdiff_t>(y) * width, width,
                    result.begin() + static_cast<std::ptrdiff_t>(y + pad) * stride + pad);
    return result;
}

std::vector<float> unpadded(const std::vector<float>& image, int width, int height, int stride)
{
    std::vector<float> result(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y)
        std::copy_n(image.begin() + static_cast<std::ptrdiff_t>(y + pad) * stride + pad, width,
                    result.begin() + static_cast<std::ptrdiff_t>(y) * width);
    return result;
}

// The planes' five images.
using Planes = std::array<opencl::Buffer<float>, 5>;

// Planes on the device: windows, then creases.
void fit_planes(opencl::Work& work, DepthFit& fit, const std::vector<float>& value)
{
    const int stride = (fit.width + 15) / 16 * 16 + 2 * pad;
    const std::vector<float> values = padded(value, fit.width, fit.height, stride), sigmas = padded(fit.sigma, fit.width, fit.height, stride);
    const auto on_device = work.upload(std::span<const float>(values), "depth values");
    const auto errors = work.upload(std::span<const float>(sigmas), "depth errors");
    const auto room = [&] {
        Planes planes;
        for (auto& plane : planes) plane = work.buffer<float>(values.size(), "depth planes");
        return planes;
    };
    const Planes first = room(), second = room();
    const cl_int2 size{{fit.width, fit.height}};
    const cl_int reach = fit.quality.reach;
    const std::array<std::size_t, 2> grid{static_cast<std::size_t>(fit.width), static_cast<std::size_t>(fit.height)};
    const std::uint64_t bytes = value.size() * sizeof(float);
    work.launch(depth_fit_program(), "depth_planes", grid, {16, 8}, 7 * bytes, size, static_cast<cl_int>(stride), reach, on_device, errors,
                first[0], first[1], first[2], first[3], first[4], work.stop());
    work.launch(depth_fit_program(), "depth_creases", grid, {16, 8}, 12 * bytes, size, static_cast<cl_int>(stride), reach, on_device, errors,
                first[0], first[1], first[2], first[3], first[4], second[0], second[1], second[2], second[3], second[4], work.stop());
    std::vector<float>* const results[] = {&fit.value, &fit.slope_x, &fit.slope_y, &fit.residual, &fit.count};
    for (std::size_t i = 0; i < 5; ++i) *results[i] = unpadded(work.read(second[i]), fit.width, fit.height, stride);
}

// The depth that is used: the plane, and what of the measured lies beyond three standard errors of it. Returns the pixels that are on no plane.
std::vector<std::uint8_t> use_planes(DepthFit& fit, const std::vector<float>& measured)
{
    std::vector<std::uint8_t> stray(measured.size());
    for (std::size_t i = 0; i < measured.size(); ++i) {
        if (i % 65536 == 0) check_stop();
        if (!fit.there[i]) {
            fit.value[i] = 0;
            continue;
        }
        const float more = measured[i] - fit.value[i], slopes = std::abs(fit.slope_x[i]) + std::abs(fit.slope_y[i]);
        stray[i] = !fit.mixed[i] && std::abs(more) > 4 * fit.sigma[i] + .8f * slopes + 3e-7f * measured[i];
        if (stray[i])
            fit.value[i] = measured[i];
        else
            fit.value[i] += std::copysign(std::max(std::abs(more) - 3 * fit.sigma[i], 0.f), more);
        if (!(fit.value[i] > 0)) fit.value[i] = measured[i];
    }
    return stray;
}

// A pixel on the plane of another, `dx` and `dy` pixels from it.
void take_plane(DepthFit& fit, const DepthFit& from, std::size_t to, std::size_t source, int dx, int dy)
{
    fit.value[to] = from.value[source] - static_cast<float>(dx) * from.slope_x[source] - static_cast<float>(dy) * from.slope_y[source];
    fit.slope_x[to] = from.slope_x[source];
    fit.slope_y[to] = from.slope_y[source];
    fit.residual[to] = from.residual[source];
    fit.count[to] = from.count[source];
}

// Pixels between two surfaces are shaded on the plane of the nearer one.
void place_mixed(DepthFit& fit, const DepthFit& planes, const Between& between)
{
    for (int y = 0; y < fit.height; ++y)
        for (int x = 0; x < fit.width; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!fit.mixed[i]) continue;
            for (int far = 1; far <= 2; ++far) {
                const int dx = far * between.toward_x[i], dy = far * between.toward_y[i], u = x + dx, v = y + dy;
                if (u < 0 || v < 0 || u >= fit.width || v >= fit.height) continue;
                const std::size_t j = fit.index(u, v);
                if (!fit.there[j] || fit.mixed[j]) continue;
                take_plane(fit, planes, i, j, dx, dy);
                break;
            }
            if (!(fit.value[i] > 0)) fit.value[i] = planes.value[i];
        }
}

// Small holes take the plane of the nearest good pixel.
void fill_holes(DepthFit& fit, const std::vector<std::uint8_t>& good, int reach)
{
    const std::vector<std::uint8_t> holes = closed_holes(fit.width, fit.height, fit.there, reach);
    const DepthFit before = fit;
    std::vector<std::uint64_t> filled(static_cast<std::size_t>(fit.height));
    parallel_for(fit.height, [&](int y) {
        for (int x = 0; x < fit.width; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!holes[i]) continue;
            int nearest = 1 << 30;
            for (int dy = -reach - 1; dy <= reach + 1; ++dy)
                for (int dx = -reach - 1; dx <= reach + 1; ++dx) {
                    const int u = x + dx, v = y + dy, far = dx * dx + dy * dy;
                    if (u < 0 || v < 0 || u >= fit.width || v >= fit.height || far >= nearest) continue;
                    const std::size_t j = before.index(u, v);
                    if (!good[j] || !(before.value[j] - static_cast<float>(dx) * before.slope_x[j] - static_cast<float>(dy) * before.slope_y[j] > 0)) continue;
                    take_plane(fit, before, i, j, dx, dy);
                    nearest = far;
                }
            if (nearest == 1 << 30) continue;
            fit.there[i] = 1;
            ++filled[static_cast<std::size_t>(y)];
        }
    });
    for (const std::uint64_t row : filled) fit.quality.filled += row;
}

} // namespace

opencl::Specialisation depth_fit_program() { return {"depth_fit.cl", {}}; }

float DepthFit::joint(std::size_t i) const
{
    return 2.5f * (std::abs(slope_x[i]) + std::abs(slope_y[i])) + 4e-3f * value[i] + 4 * sigma[i];
}

float DepthFit::error(std::size_t i) const { return 3 * residual[i] / std::sqrt(std::max(count[i], 1.f)); }

DepthFit fit_depth(opencl::Work& work, const DepthMap& depth, const Camera& camera)
{
    DepthFit fit;
    fit.width = depth.width;
    fit.height = depth.height;
    fit.orthographic = camera.orthographic;
    fit.pixel_x = 2 * camera.half_extent.x / depth.width;
    fit.pixel_y = 2 * camera.half_extent.y / depth.height;
    const std::size_t count = depth.depth.size();
    // Its images, their copies on the device, and what is made of them after: 224 bytes a pixel were the most.
    require_memory(230. * static_cast<double>(count),
                   "fitting a depth image of " + std::to_string(depth.width) + " x " + std::to_string(depth.height));

    // Values and where there is something.
    fit.there.assign(count, 0);
    float furthest = 0;
    for (std::size_t i = 0; i < count; ++i) {
        fit.there[i] = std::isfinite(depth.depth[i]) && depth.depth[i] > 0;
        if (fit.there[i]) furthest = std::max(furthest, depth.depth[i]);
    }
    fit.far = 2 * static_cast<double>(furthest);
    std::vector<float> measured(count);
    const auto value_of = [&](double z) { return static_cast<float>(fit.orthographic ? fit.far - z : std::min(1 / z, 1e37)); };
    for (std::size_t i = 0; i < count; ++i)
        if (fit.there[i]) measured[i] = value_of(depth.depth[i]);

    // Noise and the last place of what was stored.
    fit.sigma.assign(count, 0);
    fit.quality.pixels = static_cast<std::uint64_t>(std::count(fit.there.begin(), fit.there.end(), 1));
    std::vector<float> quanta;
    std::vector<float> quantum(count);
    for (std::size_t i = 0; i < count; ++i) {
        if (i % 65536 == 0) check_stop();
        if (fit.there[i]) {
            quantum[i] = static_cast<float>(step_at(depth.step, depth.depth[i], fit.orthographic) / std::sqrt(12.));
            quanta.push_back(quantum[i] / measured[i]);
        }
    }
    const auto measure = [&] {
        const double noise = depth.noise > 0 ? std::max(depth.noise, 3e-8) : relative_noise(measured, fit.width, fit.height);
        fit.quality.noise = noise;
        for (std::size_t i = 0; i < count; ++i) {
            if (i % 65536 == 0) check_stop();
            fit.sigma[i] = std::hypot(static_cast<float>(noise) * measured[i], quantum[i]);
        }
    };
    measure();
    check_stop();

    // Edges: steps, means of both sides, or ramps.
    const ValueImage image{fit.width, fit.height, measured, fit.sigma};
    Between between = between_two_surfaces(image);
    const std::vector<std::uint8_t> ramp = ramps(image, ramp_width);
    check_stop();
    fit.quality.edge_share = between.share();
    fit.quality.smeared = is_smeared(image, ramp, between.seen_steps);
    fit.quality.antialiased = !fit.quality.smeared && between.share() >= .15;
    if (fit.quality.smeared) {
        for (std::size_t i = 0; i < count; ++i)
            if (ramp[i]) {
                fit.there[i] = 0;
                measured[i] = 0;
                ++fit.quality.between;
            }
        measure();
    }
    fit.mixed = fit.quality.antialiased ? between.mixed : std::vector<std::uint8_t>(count, 0);
    fit.shaded = fit.there;
    for (const std::uint8_t one : fit.mixed) fit.quality.between += one;

    // Planes.
    check_stop();
    const double quantum_size = median_of(std::move(quanta));
    fit.quality.step = quantum_size * std::sqrt(12.);
    const double sure = std::max(fit.quality.noise, quantum_size);
    const double pixel = fit.orthographic ? fit.pixel_y / std::max(fit.far, 1e-30) : fit.pixel_y;
    fit.quality.reach = reach_for(sure, pixel);
    check_stop();
    fit_planes(work, fit, measured);
    const DepthFit planes = fit;
    const std::vector<std::uint8_t> stray = use_planes(fit, measured);
    check_stop();
    place_mixed(fit, planes, between);
    std::vector<std::uint8_t> good(count);
    for (std::size_t i = 0; i < count; ++i) good[i] = fit.there[i] && !stray[i] && !fit.mixed[i];
    fill_holes(fit, good, fit.quality.smeared ? ramp_width + 2 : hole_width);
    if (fit.quality.smeared) fit.shaded = fit.there;
    return fit;
}

} // namespace penumbra
