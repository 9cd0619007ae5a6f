// The kernel's walks against the host's, sample by sample.
#include <bit>

#include "depth_image/walk_images.hpp"

#include "depth_image/views.hpp"
#include "trace/light_samples.hpp"

namespace penumbra::test {
namespace {

struct Bits {
    std::vector<cl_uint> blocked, crossed, unknown;
};

constexpr int samples = 64, words = 2;
constexpr std::uint64_t seed = 12345678901;

// A rectangle beside the camera, in its coordinates.
DepthLight light_of(int count)
{
    DepthLight light{};
    for (const int i : {0, 5, 10}) light.image_from_receiver[i] = 1;
    light.centre[0] = .3f, light.centre[1] = .4f, light.centre[2] = .2f;
    light.half_u[0] = .2f, light.half_v[1] = .1f, light.half_v[2] = .1f;
    light.samples = samples;
    light.count = count;
    light.own = DEPTH_OWN_PIXELS;
    light.seed_low = std::bit_cast<int>(static_cast<std::uint32_t>(seed));
    light.seed_high = std::bit_cast<int>(static_cast<std::uint32_t>(seed >> 32));
    return light;
}

std::vector<cl_float2> corners_of(const Strata& strata)
{
    std::vector<cl_float2> corners;
    for (std::size_t i = 0; i < samples; ++i) corners.push_back({{strata.low_x[i], strata.low_y[i]}});
    return corners;
}

Bits on_device(const DepthImage& image, const std::vector<DepthVector>& points, const Strata& strata)
{
    opencl::Work work(device_context(true));
    const auto pixels = work.upload(std::span<const DepthPixel>(image.pixels), "pixels");
    const auto nearest = work.upload(std::span<const float>(image.nearest), "pyramid");
    const auto on_points = work.upload(std::span<const DepthVector>(points), "points");
    const auto corners = corners_of(strata);
    const auto on_strata = work.upload(std::span<const cl_float2>(corners), "strata");
    const std::vector<cl_uint> none(words * points.size());
    const auto blocked = work.upload(std::span<const cl_uint>(none), "blocked"),
               crossed = work.upload(std::span<const cl_uint>(none), "crossed"),
               unknown = work.upload(std::span<const cl_uint>(none), "unknown"),
               left = work.upload(std::span<const cl_uint>(none).first(points.size()), "left");
    const cl_float2 step{{static_cast<float>(strata.step_x * 0x1p-16), static_cast<float>(strata.step_y * 0x1p-16)}};
    work.launch(depth_trace_program(work.context().quirks().lanes), "depth_trace", {points.size(), 1}, {64, 1}, 0, image.view, light_of(static_cast<int>(points.size())),
                cl_int{1}, pixels, nearest, on_points, cl::Buffer(), on_strata, step, blocked, crossed, unknown, left, cl::Buffer());
    Bits bits{work.read(blocked), work.read(crossed), work.read(unknown)};
    work.finish();
    return bits;
}

Bits on_host(const DepthImage& image, const std::vector<DepthVector>& points, const Strata& strata)
{
    Bits bits{std::vector<cl_uint>(words * points.size()), std::vector<cl_uint>(words * points.size()),
              std::vector<cl_uint>(words * points.size())};
    const DepthLight light = light_of(static_cast<int>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
        for (int first = 0; first < samples; first += packet) {
            float x[packet], y[packet];
            jittered(strata, first, sample_key(seed, i, 0), x, y);
            for (int k = 0; k < packet; ++k) {
                const auto along = [&](int axis, float from) {
                    return light.centre[axis] - from + x[k] * light.half_u[axis] + y[k] * light.half_v[axis];
                };
                const DepthVector way{along(0, points[i].x), along(1, points[i].y), along(2, points[i].z)};
                const DepthMet met = walk(image, DEPTH_LEVELS, depth_line(image.view, points[i], way, 0, DEPTH_OWN_PIXELS), 1, 0);
                const std::size_t word = static_cast<std::size_t>((first + k) / 32) * points.size() + i;
                const cl_uint bit = 1U << ((first + k) % 32);
                bits.blocked[word] |= met.blocked ? bit : 0;
                bits.crossed[word] |= met.crossed ? bit : 0;
                bits.unknown[word] |= met.behind ? bit : 0;
            }
        }
    return bits;
}

int different(const std::vector<cl_uint>& a, const std::vector<cl_uint>& b)
{
    int count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) count += std::popcount(a[i] ^ b[i]);
    return count;
}

// One text and the same samples. OpenCL leaves a division 2.5 last places (CPUs round it right), so that a line may pass a front that it
// grazes on the other side: a share of about 1e-6 a pixel that it crosses. Sums and products are exact on both (FP_CONTRACT OFF).
TEST(DepthWalkDevice, MeetsWhatTheHostMeets)
{
    const Strata strata = make_strata(samples);
    for (const double holes : {0., .3}) {
        const DepthImage image = random_image(93, 70, false, .004, holes, 21);
        WalkRandom random(3);
        std::vector<DepthVector> points;
        for (int i = 0; i < 93 * 70; ++i) {
            const double z = 1 / random.between(.1, 1);
            points.push_back(vector_of(random.between(-.55, .55) * z, random.between(-.4, .4) * z, z));
        }
        const Bits device = on_device(image, points, strata), host = on_host(image, points, strata);
        const auto most = static_cast<int>(points.size()) * samples / 10000;
        EXPECT_LE(different(device.blocked, host.blocked), most);
        EXPECT_LE(different(device.crossed, host.crossed), most);
        EXPECT_LE(different(device.unknown, host.unknown), most);
        const std::vector<cl_uint> none(host.blocked.size());
        EXPECT_GT(different(host.blocked, none), most * 100) << "something is blocked";
        EXPECT_GT(different(host.unknown, host.crossed), most) << "and something is behind";
    }
}

} // namespace
} // namespace penumbra::test
