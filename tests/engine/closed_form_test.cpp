// Shadows with a known answer (occluders parallel to a parallel rectangle light, edges on texel borders): the light's share that a plane
// hides is the product of its overlaps per axis (Soft Shadow Maps, 3.4).
#include <cmath>

#include "support/maps.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

Mask shade(const Light& light, const LightCamera& view, const DepthMap& occluder, const Receivers& r, const Technique& technique)
{
    return engine().shade(engine().prepare(light, occluders(view, occluder), technique), r);
}

const SoftShadowMap front{.visibility = PatchVisibility::sum, .sides = Sides::front, .tolerance = 0};

// A scene in which the light's view has tangents of `tangent`, occluders are boxes of texels at depth `z_o` and receivers are the light's
// own view at depth `z_p`.
struct Parallel {
    double half_u = 1, half_v = 1;
    double tangent = 1;
    int texels = 64, pixels = 48;
    double z_o = 4, z_p = 8;
    std::vector<TexelBox> list = {};

    // What one box leaves of the light for a receiver, in double precision: overlap([l0, l1], [-H, H]) / 2H per axis,
    // l = (o z_p - p z_o) / (z_p - z_o).
    double hidden(const TexelBox& box, int x, int y) const
    {
        const double p_x = ((2 * x + 1.0) / pixels - 1) * tangent * z_p, p_y = (1 - (2 * y + 1.0) / pixels) * tangent * z_p;
        const auto edge = [&](int i) { return (2.0 * i / texels - 1) * tangent * z_o; };
        const auto overlap = [&](double o0, double o1, double p, double H) {
            const double l0 = (o0 * z_p - p * z_o) / (z_p - z_o), l1 = (o1 * z_p - p * z_o) / (z_p - z_o);
            if (H == 0) return l0 < 0 && l1 > 0 ? 1.0 : 0.0;
            return std::max(0.0, std::min(l1, H) - std::max(l0, -H)) / (2 * H);
        };
        return overlap(edge(box.x0), edge(box.x1), p_x, half_u) * overlap(-edge(box.y1), -edge(box.y0), p_y, half_v);
    }
    double visibility(int x, int y) const
    {
        double sum = 0;
        for (const TexelBox& box : list) sum += hidden(box, x, y);
        return 1 - sum;
    }
    Mask mask(const Technique& technique = front) const
    {
        return shade(rectangle_light(half_u, half_v), light_view(tangent), boxes(texels, texels, static_cast<float>(z_o), list),
                     receivers(light_view(tangent), flat(pixels, pixels, static_cast<float>(z_p))), technique);
    }

    // Roundings of one share are below 2^-19 and its patches' edges agree, so that errors of neighbours cancel but for what each share
    // rounds by (2^-24 of itself, twice) and what the sum does (2^-25 an addition in [1/2, 1)). K = k / (d - d_p), in lights per unit of
    // xi, spreads the error of a receiver's place (7 roundings) and of the two disparities.
    double bound() const
    {
        const double d = 1 / z_o, d_p = 1 / z_p, e = 0x1p-24;
        const double K = tangent / (2 * std::min(half_u, half_v)) / (d - d_p);
        const double edges = 2 * K * (7 + 3.5) * e + 2 * e * (8 + 2 * (d + d_p) / (d - d_p));
        double patches = 0;
        for (const TexelBox& box : list) patches += (box.x1 - box.x0) * (box.y1 - box.y0);
        return 2 * edges * static_cast<double>(list.size()) + std::min(patches, std::pow(texels / K + 2, 2)) * e;
    }
};

// Compares every pixel. Returns the number in penumbra.
int expect_closed_form(const Parallel& scene, const std::string& what)
{
    const Mask mask = scene.mask();
    int penumbra = 0;
    double worst = 0;
    for (int y = 0; y < scene.pixels; ++y)
        for (int x = 0; x < scene.pixels; ++x) {
            const double expected = scene.visibility(x, y);
            penumbra += expected > 0 && expected < 1;
            worst = std::max(worst, std::abs(mask.visibility.at(x, y) - expected));
        }
    EXPECT_LE(worst, scene.bound()) << what;
    return penumbra;
}

TEST(ClosedForm, OneRectangle)
{
    Parallel scene{.list = {{20, 44, 24, 40}}};
    EXPECT_GT(expect_closed_form(scene, "square light"), 300);
    scene.half_v = 0.25;
    EXPECT_GT(expect_closed_form(scene, "flat light"), 100);
    scene.texels = 61;
    EXPECT_GT(expect_closed_form(scene, "61 texels"), 100);
}

TEST(ClosedForm, OneTexel) { EXPECT_GT(expect_closed_form({.half_u = 0.5, .half_v = 0.5, .list = {{31, 32, 32, 33}}}, "one texel"), 5); }

// Side by side at one depth, touching and apart: no overlaps, so the sum is the union.
TEST(ClosedForm, SeveralRectanglesAtOneDepth)
{
    EXPECT_GT(
        expect_closed_form({.list = {{8, 16, 8, 56}, {16, 20, 8, 56}, {30, 34, 8, 56}, {40, 50, 10, 20}, {40, 50, 22, 30}}}, "rectangles"),
        500);
}

// To the map's border: where the light's view ends is not in the receivers' penumbra here.
TEST(ClosedForm, HalfPlane)
{
    Parallel scene{.list = {{0, 32, 0, 64}}};
    scene.half_u = scene.half_v = 0.5;
    const Mask mask = scene.mask();
    const int row = scene.pixels / 2;
    for (int x = 4; x < scene.pixels - 4; ++x) {
        // The edge through the axis: l = -p z_o / (z_p - z_o) = -p.
        const double p = ((2 * x + 1.0) / scene.pixels - 1) * scene.z_p;
        const double expected = std::clamp((p + scene.half_u) / (2 * scene.half_u), 0.0, 1.0);
        EXPECT_NEAR(mask.visibility.at(x, row), expected, scene.bound()) << x;
    }
}

// Numbers that binary32 holds exactly, so the mask is exact: umbra 0, lit 1, and an edge through the axis hides exactly half.
TEST(ClosedForm, ExactValues)
{
    Parallel scene{.pixels = 1, .list = {{0, 64, 0, 64}}};
    EXPECT_EQ(scene.mask().visibility.at(0, 0), 0.0f);
    scene.list = {{0, 32, 0, 64}};
    EXPECT_EQ(scene.mask().visibility.at(0, 0), 0.5f);
    scene.list = {{0, 32, 0, 32}};
    EXPECT_EQ(scene.mask().visibility.at(0, 0), 0.75f);
    scene.list = {{0, 8, 0, 8}};
    EXPECT_EQ(scene.mask().visibility.at(0, 0), 1.0f);
}

TEST(ClosedForm, EmptyMapLeavesEverythingLit)
{
    for (const Accumulator accumulator : {Accumulator::binary32, Accumulator::compensated, Accumulator::binary16}) {
        const Mask mask = Parallel{}.mask(SoftShadowMap{.visibility = PatchVisibility::sum, .sides = Sides::front, .accumulator = accumulator});
        for (const float v : mask.visibility.pixels) EXPECT_EQ(v, 1.0f);
    }
}

// Occluders behind the receivers cast nothing.
TEST(ClosedForm, WhatLiesBehindCastsNothing)
{
    Parallel scene{.z_o = 8, .z_p = 4, .list = {{0, 64, 0, 64}}};
    for (const float v : scene.mask().visibility.pixels) EXPECT_EQ(v, 1.0f);
    scene.z_o = scene.z_p = 4;
    for (const float v : scene.mask().visibility.pixels) EXPECT_EQ(v, 1.0f);
}

// From a light far smaller than a texel to one ten times the scene.
TEST(ClosedForm, LightsOfEveryExtent)
{
    for (const double half : {0.01, 0.1, 1.0, 8.0, 80.0}) {
        Parallel scene{.half_u = half, .half_v = half, .list = {{10, 30, 15, 50}}};
        expect_closed_form(scene, "half extent " + std::to_string(half));
    }
}

// Neighbours share an edge to the bit: receivers exactly on a border of texels see no light between them, however small the light. (Pixel
// centres of a map with half the texels all lie on borders.)
TEST(ClosedForm, NoLightBetweenTexels)
{
    for (const double half : {0.0, 1e-12, 1e-6, 1e-3, 1.0}) {
        Parallel scene{.half_u = half, .half_v = half, .texels = 64, .pixels = 32, .list = {{0, 64, 0, 64}}};
        const Mask mask = scene.mask();
        for (int y = 8; y < 24; ++y)
            for (int x = 8; x < 24; ++x)
                EXPECT_LE(mask.visibility.at(x, y), half < 1 ? 4 * 0x1p-24 : scene.bound()) << half << ": " << x << ", " << y;
    }
}

// With no extent, soft_shadow_map is the hard test of the receiver's own line; texel borders are left out, as there either may be right.
TEST(ClosedForm, PointsAndLinesOfLight)
{
    for (const Light& light : {Light(rectangle_light(0, 0)), Light(point_light()), Light(rectangle_light(1e-30, 1e-30))}) {
        const DepthMap depth = random_map(32, 32, 2, 4, 0.5, 3);
        const Receivers r = receivers(light_view(), flat(61, 61, 8)); // no centre on one of the map's borders but the middle
        const Mask soft = shade(light, light_view(), depth, r, front), hard = shade(light, light_view(), depth, r, ShadowMap{});
        int dark = 0;
        for (int y = 0; y < 61; ++y)
            for (int x = 0; x < 61; ++x) {
                if (x == 30 || y == 30) continue;
                EXPECT_EQ(soft.visibility.at(x, y), hard.visibility.at(x, y)) << x << ", " << y;
                dark += soft.visibility.at(x, y) == 0;
            }
        EXPECT_GT(dark, 1000);
    }
    // A line: soft across, hard along.
    expect_closed_form({.half_u = 1, .half_v = 1e-6, .pixels = 61, .z_o = 4, .z_p = 8, .list = {{20, 44, 24, 40}}}, "nearly a line");
    Parallel line{.half_u = 1, .half_v = 0, .pixels = 61, .list = {{20, 44, 24, 40}}};
    const Mask mask = line.mask();
    Parallel wide = line;
    wide.half_v = 1; // for the bound across
    for (int y = 0; y < 61; ++y)
        for (int x = 0; x < 61; ++x) EXPECT_NEAR(mask.visibility.at(x, y), line.visibility(x, y), wide.bound()) << x << ", " << y;
}

} // namespace
} // namespace penumbra::test
