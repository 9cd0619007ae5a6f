#include <limits>

#include <gtest/gtest.h>

#include "scene/cut_out.hpp"

using namespace penumbra;

namespace {

CutOut stripes() { return {.alpha = {.width = 2, .height = 1, .channels = 1, .pixels = {0, 1}}}; }

} // namespace

TEST(CutOut, LooksBetweenTexels)
{
    CutOut cut = stripes();
    EXPECT_FLOAT_EQ(alpha_at(cut, {0.25f, 0.5f}), 0);
    EXPECT_FLOAT_EQ(alpha_at(cut, {0.75f, 0.5f}), 1);
    EXPECT_FLOAT_EQ(alpha_at(cut, {0.5f, 0.5f}), 0.5f);
    EXPECT_FLOAT_EQ(alpha_at(cut, {0.375f, 0.9f}), 0.25f);
    EXPECT_FLOAT_EQ(alpha_at(cut, {0, 0.5f}), 0.5f) << "repeated";
    cut.nearest = true;
    EXPECT_EQ(alpha_at(cut, {0.49f, 0.5f}), 0);
    EXPECT_EQ(alpha_at(cut, {0.51f, 0.5f}), 1);
}

TEST(CutOut, BeyondTheImage)
{
    CutOut cut = stripes();
    cut.nearest = true;
    const auto row = [&](CutOut::Beyond beyond) {
        cut.beyond_u = beyond;
        std::string text;
        for (const float u : {-1.75f, -1.25f, -0.75f, -0.25f, 0.25f, 0.75f, 1.25f, 1.75f}) text += alpha_at(cut, {u, 0.5f}) > 0 ? '#' : '.';
        return text;
    };
    EXPECT_EQ(row(CutOut::Beyond::repeat), ".#.#.#.#");
    EXPECT_EQ(row(CutOut::Beyond::mirror), ".##..##.");
    EXPECT_EQ(row(CutOut::Beyond::clamp), ".....###");
}

TEST(CutOut, AnyNumberIsAPlace)
{
    CutOut cut = stripes();
    for (const auto beyond : {CutOut::Beyond::repeat, CutOut::Beyond::mirror, CutOut::Beyond::clamp})
        for (const float u : {1e30f, -1e30f, 3e38f, 1e-40f, 16777217.0f}) {
            cut.beyond_u = cut.beyond_v = beyond;
            const float alpha = alpha_at(cut, {u, -u});
            EXPECT_TRUE(alpha >= 0 && alpha <= 1) << u;
        }
    EXPECT_TRUE(is_there(cut, {std::numeric_limits<float>::quiet_NaN(), 0}));
}
