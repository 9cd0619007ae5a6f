#include "trace/light_samples.hpp"

#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace penumbra {
namespace {

TEST(Strata, AreAsNearToSquareAsDivisorsAllow)
{
    const int cases[][3] = {{1, 1, 1}, {2, 2, 1}, {12, 4, 3}, {16, 4, 4}, {61, 61, 1}, {100, 10, 10}, {256, 16, 16}, {1000, 40, 25}};
    for (const auto& [count, columns, rows] : cases) {
        const Strata strata = make_strata(count);
        EXPECT_EQ(strata.columns, columns);
        EXPECT_EQ(strata.rows, rows);
        EXPECT_EQ(strata.low_x.size() % packet, 0u);
    }
    EXPECT_EQ(make_strata(64, false, true).columns, 64);
    EXPECT_EQ(make_strata(64, true, false).rows, 64);
}

TEST(Strata, OneSampleInEach)
{
    for (const int count : {1, 7, 16, 60, 100, 1024}) {
        const Strata strata = make_strata(count);
        std::set<std::pair<int, int>> met;
        for (int first = 0; first < count; first += packet) {
            float x[packet], y[packet];
            jittered(strata, first, sample_key(1, 2, 3), x, y);
            for (int i = 0; i < packet && first + i < count; ++i)
                met.emplace(static_cast<int>(std::floor((x[i] + 1) / strata.step_x)),
                            static_cast<int>(std::floor((y[i] + 1) / strata.step_y)));
        }
        ASSERT_EQ(met.size(), static_cast<std::size_t>(count));
        EXPECT_EQ(*met.begin(), std::pair(0, 0));
        EXPECT_EQ(*met.rbegin(), std::pair(strata.columns - 1, strata.rows - 1));
    }
}

TEST(Jitter, IsUniformAndIndependent)
{
    // Single strata of N receivers: x, y and x y have means 0 and variances 1/3, 1/3, 1/9; neighbours have no correlation. 5 sigma each.
    constexpr int n = 100000;
    const Strata strata = make_strata(1);
    double sum_x = 0, sum_y = 0, sum_xy = 0, sum_xx = 0, sum_next = 0, before = 0;
    for (int pixel = 0; pixel < n; ++pixel) {
        float x[packet], y[packet];
        jittered(strata, 0, sample_key(1, static_cast<std::uint64_t>(pixel), 0), x, y);
        const double a = x[0], b = y[0];
        sum_x += a, sum_y += b, sum_xy += a * b, sum_xx += a * a, sum_next += a * before;
        before = a;
    }
    const double root = std::sqrt(n);
    EXPECT_LT(std::abs(sum_x / n), 5 * std::sqrt(1. / 3) / root);
    EXPECT_LT(std::abs(sum_y / n), 5 * std::sqrt(1. / 3) / root);
    EXPECT_LT(std::abs(sum_xy / n), 5. / 3 / root);
    EXPECT_LT(std::abs(sum_next / n), 5. / 3 / root);
    EXPECT_LT(std::abs(sum_xx / n - 1. / 3), 5 * std::sqrt(4. / 45) / root); // variance of x^2: 1/5 - 1/9
}

TEST(Disc, IsTheConcentricMap)
{
    // Against the formula in double. Float32: the angle has 3 roundings, the series about 4, the product 1; angle <= pi/4: 8 u, u = 2^-24.
    for (int i = -50; i <= 50; ++i)
        for (int j = -50; j <= 50; ++j) {
            const double a = i / 50., b = j / 50.;
            float x[packet] = {}, y[packet] = {};
            x[3] = static_cast<float>(a), y[3] = static_cast<float>(b);
            square_to_disc(x, y);
            double r = 0, phi = 0;
            if (std::abs(a) > std::abs(b))
                r = a, phi = M_PI / 4 * b / a;
            else if (b != 0)
                r = b, phi = M_PI / 2 - M_PI / 4 * a / b;
            EXPECT_NEAR(x[3], r * std::cos(phi), 8 * 0x1p-24);
            EXPECT_NEAR(y[3], r * std::sin(phi), 8 * 0x1p-24);
            EXPECT_EQ(x[0], 0.f);
        }
}

} // namespace
} // namespace penumbra
