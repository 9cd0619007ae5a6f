// Ray-traced visibility against closed forms.
#include <functional>

#include <gtest/gtest.h>

#include <penumbra/error.hpp>

#include "meshes.hpp"

namespace penumbra {
namespace {

constexpr int samples = 1024;

// n stratified samples in k x k = n strata, of a region whose boundary passes through at most 4 k strata (two edges across, two along; a
// line through a disc passes fewer): each such stratum adds at most 1/4 / n^2 to the variance, so sigma <= sqrt(k) / n = n^(-3/4).
const double sigma = std::pow(samples, -0.75);

double overlap(double a0, double a1, double b0, double b1) { return std::max(0.0, std::min(a1, b1) - std::max(a0, b0)); }

// The share of the interval [-half, half] of the light that the occluder's [o0, o1] at depth o hides from x at depth p.
double hidden(double o0, double o1, double o, double x, double p, double low, double high)
{
    const double l0 = (o0 * p - x * o) / (p - o), l1 = (o1 * p - x * o) / (p - o);
    return overlap(l0, l1, low, high) / (high - low);
}

// `expected(world point)`; no pixel is off by more than 5 sigma, nor the mean by more than 5 sigma / sqrt(pixels).
void expect_close(const Image& mask, const DepthMap& receivers, const Camera& camera, double spread,
                  const std::function<double(Vec3, int)>& expected)
{
    double worst = 0, sum = 0;
    int penumbra = 0;
    for (int y = 0; y < mask.height; ++y)
        for (int x = 0; x < mask.width; ++x)
            for (int c = 0; c < mask.channels; ++c) {
                const Vec3 p = world_point(camera, mask.width, mask.height, x + 0.5, y + 0.5, receivers.at(x, y));
                const double truth = expected(p, c), error = mask.at(x, y, c) - truth;
                penumbra += truth > 0.01 && truth < 0.99;
                worst = std::max(worst, std::abs(error));
                sum += error;
            }
    EXPECT_GT(penumbra, mask.width * mask.height / 20) << "the case tests no penumbra";
    EXPECT_LE(worst, 5 * spread);
    const double count = static_cast<double>(mask.pixels.size());
    EXPECT_LE(std::abs(sum / count), 5 * spread / std::sqrt(count));
}

TEST(Visibility, RectangleBeforeRectangleLight)
{
    const Light light = rectangle_light(1, 0.5);
    const Camera camera = camera_of(light, 0.5);
    const DepthMap receivers = flat_map(61, 93, 5);
    const Tracer tracer = tracer_of({parallel_quad(-0.7, 0.4, -0.3, 0.9, 2)});
    const VisibilityResult result = trace_visibility(tracer, light, receivers, camera, {.samples = samples});
    EXPECT_EQ(result.rays, 61u * 93u * samples);
    EXPECT_EQ(result.visibility.channels, 1);
    expect_close(result.visibility, receivers, camera, sigma,
                 [](const Vec3& p, int) { return 1 - hidden(-0.7, 0.4, 2, p.x, 5, -1, 1) * hidden(-0.3, 0.9, 2, -p.z, 5, -0.5, 0.5); });
}

TEST(Visibility, LightWithoutWidth)
{
    // All strata lie along the other axis: an edge across it passes one stratum, so two edges are off by at most 2 / n.
    const Light light = rectangle_light(0, 1);
    const Camera camera = camera_of(rectangle_light(1, 1), 0.5);
    const DepthMap receivers = flat_map(31, 61, 5);
    const Tracer tracer = tracer_of({parallel_quad(-0.7, 0.4, -0.3, 0.9, 2)});
    const Image mask = trace_visibility(tracer, light, receivers, camera, {.samples = samples}).visibility;
    for (int y = 0; y < mask.height; ++y)
        for (int x = 0; x < mask.width; ++x) {
            const Vec3 p = world_point(camera, 31, 61, x + 0.5, y + 0.5, 5);
            const double along_x = p.x * 2 / 5;
            const bool covered = along_x > -0.7 && along_x < 0.4;
            const double truth = covered ? 1 - hidden(-0.3, 0.9, 2, -p.z, 5, -1, 1) : 1;
            EXPECT_NEAR(mask.at(x, y), truth, 2.0 / samples + 1e-6) << x << ", " << y;
        }
}

TEST(Visibility, PointLightIsAHardShadow)
{
    const Light light = PointLight{};
    const Camera camera = camera_of(light, 0.5);
    const Tracer tracer = tracer_of({parallel_quad(-0.7, 0.4, -0.3, 0.9, 2)});
    const VisibilityResult result = trace_visibility(tracer, light, flat_map(64, 64, 5), camera, {.samples = samples});
    EXPECT_EQ(result.rays, 64u * 64u) << "all samples coincide: one ray a receiver";
    const LightFrame frame = light_frame(light);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            const Vec3 p = world_point(camera, 64, 64, x + 0.5, y + 0.5, 2); // where the ray passes the occluder
            const bool blocked = p.x > -0.7 && p.x < 0.4 && -p.z > -0.3 && -p.z < 0.9;
            EXPECT_EQ(result.visibility.at(x, y), blocked ? 0.f : 1.f) << light_from_world(frame, p);
        }
}

TEST(Visibility, HalfPlaneBeforeSphereLight)
{
    const double radius = 0.8;
    const Light light = SphereLight{.center = {0, 0, 0}, .radius = radius, .direction = {0, -1, 0}, .up = {}};
    const Camera camera = camera_of(light, 0.5);
    const DepthMap receivers = flat_map(61, 61, 5);
    const Vec3 edge = world_from_light(0.1, 0, 2); // the half plane x > 0.1 at depth 2
    const Tracer tracer = tracer_of({parallel_quad(0.1, 100, -100, 100, 2)});
    const Image mask = trace_visibility(tracer, light, receivers, camera, {.samples = samples}).visibility;
    expect_close(mask, receivers, camera, sigma, [&](const Vec3& p, int) {
        // The plane through the receiver and the edge cuts the disc that faces the receiver; the side of smaller x is free.
        const Vec3 m = Vec3(0, 0, 1).cross(edge - p).normalized();
        const Vec3 free_side = m.x < 0 ? m : -m;
        const Vec3 axis = (-p).normalized();
        const Vec3 in_disc = free_side - axis * free_side.dot(axis);
        return disc_beyond(-free_side.dot(-p) / in_disc.length() / radius);
    });
}

TEST(Visibility, HalfPlaneBeforeTheSun)
{
    const DirectionalLight sun{.direction = Vec3(0.3, -1, 0.1), .angular_diameter_deg = 20, .up = {}};
    const LightFrame frame = light_frame(sun);
    const Camera camera = camera_at({0, 6, 0.1}, {0, 0, 0}, 0.3);
    const TriangleMesh floor = quad({0, 0, 0}, {50, 0, 0}, {0, 0, -50});
    const DepthMap receivers = tracer_of({floor}).front(camera, 61, 61);
    const Tracer tracer = tracer_of({quad({100, 4, 0}, {100, 0, 0}, {0, 0, -100})}); // x > 0 at height 4
    const Image mask = trace_visibility(tracer, sun, receivers, camera, {.samples = samples}).visibility;
    expect_close(mask, receivers, camera, sigma, [&](const Vec3& p, int) {
        const Vec3 m = Vec3(0, 0, 1).cross(Vec3(0, 4, 0) - p).normalized();
        const Vec3 free_side = m.x < 0 ? m : -m;
        const Vec3 in_disc(free_side.dot(frame.u), free_side.dot(frame.v), 0);
        return disc_beyond(-free_side.dot(-frame.direction) / in_disc.length() / frame.half_u);
    });
}

TEST(Visibility, TexturedLightIsTheWeightedSumOfItsTexels)
{
    RectangleLight light = rectangle_light(1, 1);
    Image texture{.width = 4, .height = 2, .channels = 3, .pixels = {}};
    for (int i = 0; i < 24; ++i) texture.pixels.push_back(static_cast<float>((i * 7 + i / 5) % 11));
    light.emission = texture;
    const Camera camera = camera_of(light, 0.5);
    const DepthMap receivers = flat_map(61, 45, 5);
    const Tracer tracer = tracer_of({parallel_quad(-0.7, 0.4, -0.3, 0.9, 2)});
    const Image mask = trace_visibility(tracer, light, receivers, camera, {.samples = samples}).visibility;
    ASSERT_EQ(mask.channels, 3);

    // 32 x 32 strata lie evenly on 4 x 2 texels. A sample weighs at most the largest texel over their mean: at most 10 / 3.
    expect_close(mask, receivers, camera, sigma * 10 / 3, [&](const Vec3& p, int c) {
        double sum = 0, free = 0;
        for (int row = 0; row < 2; ++row)
            for (int column = 0; column < 4; ++column) {
                const double x = -1 + column * 0.5, y = -row; // low corner: row 0 is the upper half, 0 to 1
                const double emitted = texture.at(column, row, c);
                const double blocked = hidden(-0.7, 0.4, 2, p.x, 5, x, x + 0.5) * hidden(-0.3, 0.9, 2, -p.z, 5, y, y + 1);
                sum += emitted;
                free += emitted * (1 - blocked);
            }
        return free / sum;
    });
}

TEST(Visibility, WhiteTextureEqualsNone)
{
    RectangleLight light = rectangle_light(1, 1);
    const Camera camera = camera_of(light, 0.5);
    const DepthMap receivers = flat_map(32, 32, 5);
    const Tracer tracer = tracer_of({parallel_quad(-0.7, 0.4, -0.3, 0.9, 2)});
    const Image plain = trace_visibility(tracer, light, receivers, camera, {.samples = 64}).visibility;
    for (const int channels : {1, 3}) {
        light.emission = Image{
            .width = 3, .height = 5, .channels = channels, .pixels = std::vector<float>(static_cast<std::size_t>(15 * channels), 0.3f)};
        const Image textured = trace_visibility(tracer, light, receivers, camera, {.samples = 64}).visibility;
        ASSERT_EQ(textured.channels, 3);
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x)
                for (int c = 0; c < 3; ++c) EXPECT_EQ(textured.at(x, y, c), plain.at(x, y));
    }
}

TEST(Visibility, BlackTexelsAlone)
{
    // One sample a receiver and a texture whose right half is black: where that sample lies on black, it weighs as without texture.
    RectangleLight light = rectangle_light(1, 1);
    light.emission = Image{.width = 2, .height = 1, .channels = 1, .pixels = {1, 0}};
    const Tracer tracer = tracer_of({parallel_quad(-9, 9, -9, 9, 2)});
    const Image mask = trace_visibility(tracer, light, flat_map(16, 16, 5), camera_of(light, 0.5), {.samples = 1}).visibility;
    for (const float v : mask.pixels) EXPECT_EQ(v, 0.f);
}

TEST(Visibility, NothingThereAndBehindTheLightAreLit)
{
    const Light lights[] = {rectangle_light(1, 1), SphereLight{.center = {0, 0, 0}, .radius = 1, .direction = {0, -1, 0}, .up = {}},
                            PointLight{}};
    const Tracer tracer = tracer_of({sphere({0, 0, 0}, 3, 3)}); // all round the light
    DepthMap receivers = flat_map(7, 5, 20);
    receivers.at(3, 2) = nothing_there;
    receivers.at(4, 2) = std::numeric_limits<float>::quiet_NaN();
    receivers.at(5, 2) = -1;
    for (const Light& light : lights) {
        const VisibilityResult below = trace_visibility(tracer, light, receivers, camera_of(light, 0.5), {.samples = 16});
        for (int i = 0; i < 35; ++i) EXPECT_EQ(below.visibility.pixels[static_cast<std::size_t>(i)], i >= 17 && i <= 19 ? 1.f : 0.f) << i;

        const Camera up = camera_at({0, 5, 0}, {0, 30, 0}, 0.5); // everything it sees is above, behind the light's plane
        const VisibilityResult behind = trace_visibility(tracer, light, receivers, up, {.samples = 16});
        EXPECT_EQ(behind.rays, 0u);
        for (const float v : behind.visibility.pixels) EXPECT_EQ(v, 1.f);
    }
}

TEST(Visibility, NoOccludersNoShadow)
{
    const Light light = rectangle_light(1, 1);
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(1, 93), std::pair(61, 1)})
        for (const bool adaptive : {false, true}) {
            const VisibilityResult result = trace_visibility(tracer_of({}), light, flat_map(width, height, 3), camera_of(light, 0.5),
                                                             {.samples = 61, .adaptive = adaptive});
            ASSERT_EQ(result.visibility.pixel_count(), static_cast<std::size_t>(width * height));
            EXPECT_EQ(result.rays, static_cast<std::uint64_t>(width * height) * (adaptive ? 16u : 61u));
            for (const float v : result.visibility.pixels) EXPECT_EQ(v, 1.f);
        }
}

TEST(Visibility, RejectsWrongCalls)
{
    const Light light = rectangle_light(1, 1);
    const Camera camera = camera_of(light, 0.5);
    const Tracer tracer = tracer_of({});
    EXPECT_THROW(trace_visibility(tracer, light, flat_map(4, 4, 3), camera, {.samples = 0}), Error);
    EXPECT_THROW(trace_visibility(tracer, light, flat_map(4, 4, 3), camera, {.adaptive = true, .first_samples = 0}), Error);
    EXPECT_THROW(trace_visibility(tracer, light, {4, 4, std::vector<float>(15)}, camera, {}), Error);
    EXPECT_THROW(trace_visibility(tracer, light, {0, 4, {}}, camera, {}), Error);
}

} // namespace
} // namespace penumbra
