// Textured lights: the coverage table against the closed form, against rays, and against what it is made of.
#include <gtest/gtest.h>

#include <penumbra/error.hpp>

#include "engine/soft_shadow_volume_scenes.hpp"

namespace penumbra::test::wedges {
namespace {

RectangleLight textured(int width, int height, int channels, const std::function<float(int, int, int)>& emitted)
{
    Image image{.width = width, .height = height, .channels = channels, .pixels = {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c) image.pixels.push_back(emitted(x, y, c));
    return {.center = {0, 0, 0}, .half_u = {0.25, 0, 0}, .half_v = {0, 0.25, 0}, .emission = image};
}

RectangleLight even_light() { return {.center = {0, 0, 0}, .half_u = {0.25, 0, 0}, .half_v = {0, 0.25, 0}, .emission = {}}; }

SoftShadowVolume by_table(int places = 32, int splits = 1)
{
    SoftShadowVolume settings;
    settings.coverage = Coverage::texture;
    settings.table = places;
    settings.light_splits = splits;
    return settings;
}

double largest_difference(const Image& a, const Image& b)
{
    EXPECT_EQ(a.pixels.size(), b.pixels.size());
    double worst = 0;
    for (std::size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i)
        worst = std::max(worst, std::abs(static_cast<double>(a.pixels[i]) - b.pixels[i]));
    return worst;
}

const std::vector<TriangleMesh>& casters()
{
    static const std::vector<TriangleMesh> two{sheet(-0.3, 0.2, -0.15, 0.35, 1), torus_knot({0.1, -0.5, 1.4})};
    return two;
}

// Line integrals of an entry, sums over its 16 taps and over the edges that a receiver sees: each share is right to a few dozen roundings,
// and no receiver of these scenes sees more than 2^11 edges: 2^11 * 2^6 * 2^-24 would be the bound of them all off alike; a tenth of it is
// asked for.
constexpr double table_bound = 0x1p-7 / 10;

TEST(WedgeTable, AnEvenLightIsTheClosedForm)
{
    const Image closed = mask_of(scene_of(even_light(), casters(), floor_at(2)));
    EXPECT_LT(*std::min_element(closed.pixels.begin(), closed.pixels.end()), 0.2F);
    for (const int places : {4, 8, 32, 48})
        EXPECT_LT(largest_difference(mask_of(scene_of(even_light(), casters(), floor_at(2)), by_table(places)), closed), table_bound)
            << places;
    EXPECT_LT(largest_difference(mask_of(scene_of(even_light(), casters(), floor_at(2)), by_table(16, 3)),
                                 mask_of(scene_of(even_light(), casters(), floor_at(2)), SoftShadowVolume{.light_splits = 3})),
              table_bound);
}

TEST(WedgeTable, AWhiteTextureIsNoTexture)
{
    const Image closed = mask_of(scene_of(even_light(), casters(), floor_at(2)));
    const Image white = mask_of(scene_of(textured(7, 5, 1, [](int, int, int) { return 3.0F; }), casters(), floor_at(2)), by_table());
    ASSERT_EQ(white.channels, 3) << "of a textured light the mask is RGB";
    for (std::size_t i = 0; i < closed.pixels.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(white.pixels[3 * i + c], closed.pixels[i], table_bound) << i;
}

TEST(WedgeTable, APlanarCasterAgainstRays)
{
    // Stratified rays have an error of a few thousandths at 4096 (beyond.md gives .0015 to .0034 at 1024 for the mean); four times their
    // mean is allowed.
    const RectangleLight light = textured(8, 8, 3, [](int x, int y, int c) {
        return (x / 2 + y / 2) % 2 == 0 ? 0.2F + 0.4F * static_cast<float>(c) : 1.0F - 0.3F * static_cast<float>(c);
    });
    const Scene scene = scene_of(light, {sheet(-0.3, 0.2, -0.15, 0.35, 1)}, floor_at(2));
    const Image rays = mask_of(scene, RayTraced{.samples = 4096});
    for (const int splits : {1, 2}) {
        const Metrics error = compare(mask_of(scene, by_table(32, splits)), rays);
        record("checkered light, " + std::to_string(splits) + " splits", error);
        EXPECT_LT(error.mae_shadow, 0.002);
        EXPECT_LT(error.max, 0.03);
    }
}

TEST(WedgeTable, IsTheWeightedSumOfItsTexels)
{
    // A light of 2 x 2 texels, each by itself a light of a quarter: its mask is theirs, weighed. Planar casters, so that all of them are
    // exact.
    const auto weight = [](int x, int y) { return 1.0F + 2.0F * static_cast<float>(x) + 4.0F * static_cast<float>(y); };
    const std::vector<TriangleMesh> planar{sheet(-0.3, 0.2, -0.15, 0.35, 1)};
    const Image whole =
        mask_of(scene_of(textured(2, 2, 1, [&](int x, int y, int) { return weight(x, y); }), planar, floor_at(2)), by_table(48));
    std::vector<double> sum(whole.pixel_count(), 0.0);
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 2; ++x) {
            const RectangleLight part{.center = {x == 0 ? -0.125 : 0.125, y == 0 ? 0.125 : -0.125, 0},
                                      .half_u = {0.125, 0, 0},
                                      .half_v = {0, 0.125, 0},
                                      .emission = {}};
            Receivers same = floor_at(2);
            same.camera =
                PinholeCamera{.frame = {.origin = {0, 0, 0}, .x = {1, 0, 0}, .y = {0, 1, 0}, .z = {0, 0, 1}}, .tan_half_fov = {1, 1}};
            const Image mask = mask_of(scene_of(part, planar, same));
            for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight(x, y) / 16.0 * mask.pixels[i];
        }
    // Between places a share of a texture of hard borders is not linear: a border lies within a step of 2 / 47 of the light for at most two
    // ends of an edge, each over the edge's length.
    double worst = 0;
    for (std::size_t i = 0; i < sum.size(); ++i) worst = std::max(worst, std::abs(sum[i] - whole.pixels[3 * i]));
    EXPECT_LT(worst, 2.0 / 47);
}

TEST(WedgeTable, ABlackChannelCountsAsEven)
{
    const RectangleLight red = textured(4, 4, 3, [](int x, int, int c) { return c == 0 ? static_cast<float>(x) : 0.0F; });
    const Image mask = mask_of(scene_of(red, casters(), floor_at(2)), by_table());
    const Image closed = mask_of(scene_of(even_light(), casters(), floor_at(2)));
    for (std::size_t i = 0; i < closed.pixels.size(); ++i) ASSERT_NEAR(mask.pixels[3 * i + 1], closed.pixels[i], table_bound);
}

TEST(WedgeTable, IsRefusedWhereItDoesNotFit)
{
    const auto message_of = [](const Light& light, const SoftShadowVolume& settings) {
        try {
            (void)mask_of(scene_of(light, {sheet(-1, 1, -1, 1, 1)}, floor_at(2, 16)), settings);
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string("(no error)");
    };
    const auto holds = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
    EXPECT_TRUE(holds(message_of(textured(2, 2, 1, [](int, int, int) { return 1.0F; }), {}), "coverage"));
    EXPECT_TRUE(holds(message_of(sphere_light(0.25), by_table()), "technique.coverage"));
    EXPECT_TRUE(holds(message_of(even_light(), by_table(5)), "technique.table"));
}

} // namespace
} // namespace penumbra::test::wedges
