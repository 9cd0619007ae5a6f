#include <gtest/gtest.h>

#include "scene/orientation.hpp"

using namespace penumbra;

TEST(Orientation, SignsAreExactWhereDoublesRound)
{
    // Points on and beside the diagonal, in steps of the last bit (Kettner et al.: Classroom examples of robustness problems, 2008).
    const double step = 0x1p-53;
    for (int x = 0; x < 64; ++x)
        for (int y = 0; y < 64; ++y) {
            const Vec2 p(0.5 + x * step, 0.5 + y * step), q(12, 12), r(24, 24);
            const double sign = turn(p, q, r);
            // 0.5 + k 2^-53 is rounded to even: what counts is the number that it became.
            EXPECT_EQ(sign > 0, p.y > p.x) << x << ' ' << y;
            EXPECT_EQ(sign < 0, p.y < p.x) << x << ' ' << y;
            EXPECT_EQ(turn(q, p, r) > 0, sign < 0);
        }
}

TEST(Orientation, CounterClockwiseIsPositive)
{
    EXPECT_GT(turn({0, 0}, {1, 0}, {0, 1}), 0);
    EXPECT_LT(turn({0, 0}, {0, 1}, {1, 0}), 0);
    EXPECT_EQ(turn({1e7, 1e7}, {2e7, 2e7}, {3e7, 3e7}), 0);
}
