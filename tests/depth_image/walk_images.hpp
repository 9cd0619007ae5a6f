// Random depth images and lines for walks.
#pragma once

#include <random>

#include "depth_image/depth_image.hpp"
#include "depth_image/images.hpp"

namespace penumbra::test {

class WalkRandom {
public:
    explicit WalkRandom(std::uint32_t seed) : engine_(seed) {}
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
    int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }

private:
    std::mt19937 engine_;
};

// Patches of planes at disparities of .1 to 1 with slopes of up to `steep` of that a pixel, a share of holes, and bodies of some thickness.
inline DepthImage random_image(int width, int height, bool orthographic, double steep, double holes, std::uint32_t seed)
{
    WalkRandom random(seed);
    DepthFit fit;
    fit.width = width, fit.height = height, fit.orthographic = orthographic;
    fit.far = 1.2;
    const Camera camera = camera_for(width, height, 0.6, orthographic);
    fit.pixel_x = 2 * camera.half_extent.x / width, fit.pixel_y = 2 * camera.half_extent.y / height;
    const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    fit.there.assign(count, 0), fit.mixed.assign(count, 0);
    for (auto* image : {&fit.value, &fit.sigma, &fit.slope_x, &fit.slope_y, &fit.residual}) image->assign(count, 0);
    fit.count.assign(count, 25);
    for (int block_y = 0; block_y < height; block_y += 5)
        for (int block_x = 0; block_x < width; block_x += 7) {
            const Plane plane{random.between(.1, 1), random.between(-steep, steep), random.between(-steep, steep)};
            for (int y = block_y; y < std::min(block_y + 5, height); ++y)
                for (int x = block_x; x < std::min(block_x + 7, width); ++x) {
                    const std::size_t i = fit.index(x, y);
                    fit.value[i] = static_cast<float>(std::max(plane(x - block_x, y - block_y), .05));
                    fit.slope_x[i] = static_cast<float>(plane.slope_x), fit.slope_y[i] = static_cast<float>(plane.slope_y);
                    fit.residual[i] = static_cast<float>(random.between(0, 1e-3));
                    fit.there[i] = random.between(0, 1) >= holes;
                }
        }
    fit.shaded = fit.there;
    return depth_image(fit, camera, .2);
}

inline DepthMet walk(const DepthImage& image, int levels, const DepthLine& line, int all, int through)
{
    return depth_walk(image.view, image.pixels.data(), image.nearest.data(), levels, line, all, through);
}

inline DepthVector vector_of(double x, double y, double z) { return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)}; }

// From anywhere about the view, behind the camera too, to anywhere.
inline DepthLine random_line(WalkRandom& random, const DepthView& view)
{
    const auto point = [&] {
        const double z = random.below(6) == 0 ? random.between(-2, .5)
                         : view.orthographic  ? random.between(0, 1.5)
                                              : 1 / random.between(.05, 1.5);
        const double reach = view.orthographic ? 1 : std::abs(z);
        return Vec3(random.between(-1, 1) * reach, random.between(-1, 1) * reach, z);
    };
    const Vec3 from = point(), to = point();
    const int endless = random.below(4) == 0;
    return depth_line(view, vector_of(from.x, from.y, from.z), vector_of(to.x - from.x, to.y - from.y, to.z - from.z), endless,
                      random.below(2) ? DEPTH_OWN_PIXELS : 0);
}

// Exactly along a row or a column, or through pixels' corners: steps and places are multiples of powers of two.
inline DepthLine straight_line(WalkRandom& random, const DepthView& view)
{
    constexpr float steps[][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}, {1, .5f}, {.25f, -1}, {-.5f, 1}};
    const auto& step = steps[random.below(11)];
    DepthLine line{};
    // In pixels' middles, on their borders, or in their corners; outside the image as well.
    line.x = static_cast<float>(random.below(2 * view.width + 40) - 20) / 2;
    line.y = static_cast<float>(random.below(2 * view.height + 40) - 20) / 2;
    line.value = static_cast<float>(random.between(.05, 1));
    line.step_x = step[0], line.step_y = step[1], line.step_value = static_cast<float>(random.between(-1, 1) / view.width);
    line.unit = line.start_z = 1;
    line.to = static_cast<float>(random.between(1, 2 * view.width));
    // As depth_line cuts them.
    const auto cut = [&](float start, float along, int size) {
        if (along == 0) {
            if (start < 0 || start >= static_cast<float>(size)) line.to = -1;
            return;
        }
        const float a = -start / along, b = (static_cast<float>(size) - start) / along;
        line.from = std::max(line.from, std::min(a, b));
        line.to = std::min(line.to, std::max(a, b));
    };
    cut(line.x, line.step_x, view.width), cut(line.y, line.step_y, view.height);
    line.own = random.below(2) ? DEPTH_OWN_PIXELS : 0;
    return line;
}

} // namespace penumbra::test
