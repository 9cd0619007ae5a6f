#include "scene/weld.hpp"

#include <cmath>
#include <map>
#include <random>
#include <tuple>

#include <gtest/gtest.h>

namespace penumbra {
namespace {

// A list that is searched place by place, in the order of coming.
TEST(Weld, IsAsAMapHasIt)
{
    std::mt19937 random(1);
    std::uniform_int_distribution<int> whole(-6, 6); // 2197 places, each some nine times
    std::vector<Imath::V3f> places;
    Welder weld(places);
    std::map<std::tuple<float, float, float>, std::uint32_t> known;
    for (int i = 0; i < 20000; ++i) {
        const Imath::V3f place(static_cast<float>(whole(random)), static_cast<float>(whole(random)), std::ldexp(1.0f, 10 * whole(random)));
        const auto [found, is_new] = known.try_emplace({place.x, place.y, place.z}, static_cast<std::uint32_t>(known.size()));
        ASSERT_EQ(weld(place), found->second);
        ASSERT_EQ(places.size(), known.size());
        ASSERT_EQ(places[found->second], place);
    }
}

TEST(Weld, BothZeroesAreOnePlace)
{
    std::vector<Imath::V3f> places;
    Welder weld(places, 2);
    EXPECT_EQ(weld({-0.0f, 1, -0.0f}), 0u);
    EXPECT_EQ(weld({0.0f, 1, 0.0f}), 0u);
    EXPECT_FALSE(std::signbit(places[0].x));
}

TEST(Weld, EachWelderKnowsItsOwnPlacesAlone)
{
    std::vector<Imath::V3f> places;
    Welder first(places);
    EXPECT_EQ(first({1, 2, 3}), 0u);
    Welder second(places);
    EXPECT_EQ(second({1, 2, 3}), 1u);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(second({static_cast<float>(i), 0, 0}), 2u + static_cast<unsigned>(i)); // grows
    EXPECT_EQ(second({1, 2, 3}), 1u);
}

} // namespace
} // namespace penumbra
