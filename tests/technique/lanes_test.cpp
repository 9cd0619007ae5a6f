// The kernels of other kinds of device, on this one: lanes are a matter of speed, never of the result.
#include <algorithm>

#include <gtest/gtest.h>

#include "support/device_run.hpp"
#include "support/maps.hpp"
#include "technique/occlusion_texture_run.hpp"

namespace penumbra::test {
namespace {

class Lanes : public testing::TestWithParam<Accumulator> {};

TEST_P(Lanes, GiveTheSameBits)
{
    const SoftCase c{.front = random_map(93, 61, 2, 4, 0.3, 7),
                     .back = random_map(93, 61, 3, 5, 0.3, 8),
                     .settings = {.visibility = PatchVisibility::sum, .accumulator = GetParam()},
                     .receivers = random_map(61, 47, 4, 9, 0.1, 9),
                     .camera = {}};

    const auto context = device_context(true);
    std::vector<std::vector<float>> masks;
    for (const int lanes : {1, 8, 16}) {
        context->quirks().lanes = lanes;
        masks.push_back(run(context, c).visibility);
    }
    EXPECT_EQ(masks[0], masks[2]);
    EXPECT_EQ(masks[1], masks[2]);
    // Neither all lit nor all dark: there was something to agree on.
    EXPECT_LT(*std::min_element(masks[0].begin(), masks[0].end()), 0.5f);
    EXPECT_GT(*std::max_element(masks[0].begin(), masks[0].end()), 0.5f);
}

INSTANTIATE_TEST_SUITE_P(Accumulators, Lanes, testing::Values(Accumulator::binary32, Accumulator::compensated, Accumulator::binary16));

// Lookups alone do not add over receivers, and products and sums are joined only where kernels say so.
TEST(LanesOfSlices, GiveTheSameBits)
{
    const auto context = device_context(true);
    const Light sun = DirectionalLight{.direction = {0, 0, -1}, .angular_diameter_deg = 5, .up = Vec3(0, 1, 0)};
    for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap, Prefilter::summed_area})
        for (const Light& light : {Light(rectangle_light(1, 0.2)), sun}) {
            const SliceCase c{.light = light,
                              .casters = {triangles_in(40, {-2, -2, 3}, {2, 2, 6}, 1, 1)},
                              .settings = {.slices = 8, .resolution = 64, .prefilter = prefilter},
                              .receivers = random_map(61, 47, 4, 12, 0.1, 9),
                              .camera = light_camera(light_frame(point_light()), {0.7, 0.7}, {0, 0, 0})};
            std::vector<std::vector<float>> masks;
            for (const int lanes : {1, 8, 16}) {
                context->quirks().lanes = lanes;
                masks.push_back(run(context, c).visibility);
            }
            int differing = 0;
            for (std::size_t i = 0; i < masks[0].size(); ++i) differing += masks[0][i] != masks[2][i] || masks[1][i] != masks[2][i];
            EXPECT_EQ(differing, 0) << "prefilter " << static_cast<int>(prefilter) << (light.index() == 0 ? "" : ", sun");
            EXPECT_LT(*std::min_element(masks[0].begin(), masks[0].end()), 0.5f);
            EXPECT_EQ(*std::max_element(masks[0].begin(), masks[0].end()), 1.0f);
        }
}

} // namespace
} // namespace penumbra::test
