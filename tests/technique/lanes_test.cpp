// The kernels of other kinds of device, on this one: lanes are a matter of speed, never of the result.
#include <algorithm>

#include <gtest/gtest.h>

#include "support/device_run.hpp"
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

class Lanes : public testing::TestWithParam<Accumulator> {};

TEST_P(Lanes, GiveTheSameBits)
{
    const SoftCase c{.front = random_map(93, 61, 2, 4, 0.3, 7),
                     .back = random_map(93, 61, 3, 5, 0.3, 8),
                     .settings = {.accumulator = GetParam()},
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

} // namespace
} // namespace penumbra::test
