// Whether penumbrae are wide enough for the receivers that are shaded.
#include <cmath>

#include <gtest/gtest.h>

#include "refine/occluder_field.hpp"
#include "scene/camera.hpp"
#include "scene/fine_depth.hpp"

namespace penumbra::test {
namespace {

// A light of 2 x 2 at the origin that shines along -z, its view of tangent 1, and a plate of depth 2 over the map's middle quarter.
struct Field {
    LightFrame light{.origin = {0, 0, 0}, .u = {1, 0, 0}, .v = {0, 1, 0}, .direction = {0, 0, -1}, .half_u = 1, .half_v = 1};
    Camera camera = light_camera(light, {1, 1}, {0, 0, 0});
    DepthMap map{.width = 64, .height = 64, .depth = std::vector<float>(64 * 64, INFINITY)};

    explicit Field(float depth)
    {
        for (int y = 24; y < 40; ++y)
            for (int x = 24; x < 40; ++x) map.at(x, y) = depth;
    }
    OccluderField field() const
    {
        const DepthMap* maps[] = {&map};
        return {light, camera, maps};
    }
};

// Receivers on the plane at depth z around (x, y), so far apart.
ReceiverPatch patch(const OccluderField& field, double x, double y, double z, double side, double step)
{
    return {.corners = {field.point({x - side, y - side, -z}), field.point({x + side, y - side, -z}), field.point({x - side, y + side, -z}), field.point({x + side, y + side, -z})},
            .off = 0,
            .step_x = step,
            .step_y = step,
            .step_z = 0};
}

TEST(OccluderField, PointsAreInTheLightsView)
{
    const LightPoint p = Field(2).field().point({1, -2, -4});
    EXPECT_DOUBLE_EQ(p.z, 4);
    EXPECT_DOUBLE_EQ(p.xi, 0.25);
    EXPECT_DOUBLE_EQ(p.eta, -0.5);
}

// Through a point at depth z_o the light's width 2 h is seen h (z_p - z_o) / z_o wide on either side at z_p: the penumbra is 2 (4 - 2) / 2 = 2 wide here,
// and a step of s is s / 2 of it.
TEST(OccluderField, ResolvesStepsUpToTheirShareOfThePenumbra)
{
    const OccluderField field = Field(2).field();
    for (const double share : {0.1, 0.25, 0.5}) {
        EXPECT_NE(field.passing(patch(field, 0, 0, 4, 0.01, 0.999 * 2 * share), share), Passing::much) << share;
        EXPECT_EQ(field.passing(patch(field, 0, 0, 4, 0.01, 1.001 * 2 * share), share), Passing::much) << share;
    }
}

// The plate's shadow and penumbra on z = 4 end at (0.5 + 1) - no receiver beyond sees the light past the plate's rim.
TEST(OccluderField, WhatCannotCastOnThePatchDoesNotCount)
{
    const OccluderField field = Field(2).field();
    const double rim = 2 * 0.25 * 2; // half the plate's width at depth 4, from the light's centre
    EXPECT_EQ(field.passing(patch(field, rim + 0.95, 0, 4, 0.01, 1.9), 0.25), Passing::much);
    EXPECT_NE(field.passing(patch(field, rim + 1.2, 0, 4, 0.01, 1.9), 0.25), Passing::much);
}

// What only the samples of a texel show casts too.
TEST(OccluderField, SamplesCount)
{
    Field empty(INFINITY);
    const OccluderField nothing = empty.field();
    EXPECT_EQ(nothing.passing(patch(nothing, 0, 0, 4, 0.01, 1.9), 0.25), Passing::nothing);
    std::vector<std::int32_t> blocks(64 * 64, -1);
    blocks[32 * 64 + 32] = 0;
    FineDepth fine{.side = 2, .blocks = std::make_shared<const std::vector<std::int32_t>>(blocks), .depth = {INFINITY, INFINITY, 2, INFINITY}};
    empty.map.fine = std::make_shared<const FineDepth>(fine);
    const OccluderField field = empty.field();
    EXPECT_EQ(field.passing(patch(field, 0, 0, 4, 0.01, 1.9), 0.25), Passing::much);
}

// Receivers on the plate itself: its own surface is no caster; what lies just above them is, and no step resolves that.
TEST(OccluderField, ThePatchsOwnSurfaceIsNoCaster)
{
    const OccluderField own = Field(2).field();
    EXPECT_NE(own.passing(patch(own, 0, 0, 2, 0.05, 0.5), 0.25), Passing::much);
    const OccluderField above = Field(1.99f).field();
    EXPECT_EQ(above.passing(patch(above, 0, 0, 2, 0.05, 0.5), 0.25), Passing::much);
}

TEST(OccluderField, ALightWithoutExtentIsResolvedWhereNothingCasts)
{
    Field point(2);
    point.light.half_u = point.light.half_v = 0;
    const OccluderField field = point.field();
    EXPECT_EQ(field.passing(patch(field, 0, 0, 4, 0.1, 0.001), 0.25), Passing::much);
    EXPECT_NE(field.passing(patch(field, 3, 3, 4, 0.1, 0.001), 0.25), Passing::much);
}

} // namespace
} // namespace penumbra::test
