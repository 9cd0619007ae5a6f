// Textured lights: the coverage table against the closed form, against rays, and against what it is made of.
#include <gtest/gtest.h>

#include <penumbra/error.hpp>

#include "engine/soft_shadow_volume_scenes.hpp"
#include "oracle/soft_shadow_volume_oracle.hpp"
#include "technique/wedge_data.hpp"

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

const std::vector<TriangleMesh>& casters()
{
    static const std::vector<TriangleMesh> two{sheet(-0.3, 0.2, -0.15, 0.35, 1), torus_knot({0.1, -0.5, 1.4})};
    return two;
}

const std::vector<TriangleMesh>& planar()
{
    static const std::vector<TriangleMesh> one{casters().front()};
    return one;
}

// By how much rounding may part table and closed form, for each receiver of floor_at(2): an edge that is off the light adds 0 to both, any
// other at most `per_edge` of its part of the light.
//
// Both clip with the same operations, so ends agree to the bit. Of an even light, interpolation is exact: what is not linear in an end's
// place depends on that end alone, and the next edge begins there with the same taps. What is left, in e = 2^-24 of the part's light:
//   an entry: each of its ends comes to texels with 4.25 e an axis, on three lines of at most sqrt(2) sides of the light (26), and is the
//       sum of 7 line integrals (one between the ends, one from each to the border, two up each border), each rounding at most 22 times
//       (slope 6, both columns 4, mean 8, sums 4): 154, then 8 to join them: 188, and one more for every row and column of texels that a
//       line passes
//   16 taps: weights of 4 factors (7 of values to 2: 14) and sums (32): 46; the place between taps (4)
//   the closed form: two places round the border of 8 (13), their difference (8), the triangle (16), over 8: 5; and 4 to add up either
// which is below 256 + 7 (width + height) of the texture.
std::vector<double> rounding_of(const RectangleLight& light, const std::vector<TriangleMesh>& meshes, int splits = 1)
{
    const double texels = light.emission ? light.emission->width + light.emission->height : 0;
    const double per_edge = (256 + 7 * texels) * 0x1p-24;
    constexpr double near = 1 + 0x1p-10; // ends that rounding could move onto the light count: they are good to 2^-14 of it (bound_of)
    constexpr int size = 64;
    std::vector<const TriangleMesh*> pointers;
    for (const TriangleMesh& mesh : meshes) pointers.push_back(&mesh);
    const Topology topology(pointers);
    const LightFrame frame = light_frame(light);
    std::vector<double> bounds(size * size, 0x1p-22); // of 1 less the sum
    for (const LightPart& part : light_parts(frame, splits)) {
        std::vector<std::array<Vec3, 2>> edges;
        for (const SilhouetteEdge& edge : silhouette_of(topology, part.centre).edges)
            edges.push_back({point_in_part(frame, part, Vec3(topology.vertices()[edge.from])),
                             point_in_part(frame, part, Vec3(topology.vertices()[edge.to]))});
        for (std::size_t i = 0; i < bounds.size(); ++i) {
            const double x = 2.0 * static_cast<double>(i % size) + 1, y = 2.0 * static_cast<double>(i / size) + 1;
            const oracle::wedge::Receiver p{point_in_part(frame, part, world_of((x / size - 1) * 2, (1 - y / size) * 2, 2))};
            for (const auto& [from, to] : edges) {
                const auto a = projected(oracle::wedge::Shape::square, p, from), b = projected(oracle::wedge::Shape::square, p, to);
                const bool off = (a.x > near * a.w && b.x > near * b.w) || (-a.x > near * a.w && -b.x > near * b.w) ||
                                 (a.y > near * a.w && b.y > near * b.w) || (-a.y > near * a.w && -b.y > near * b.w);
                bounds[i] += off ? 0 : part.share * per_edge;
            }
        }
    }
    return bounds;
}

// One channel of the table's mask beside the closed form's.
void expect_within(const Image& by_table, int channel, const Image& closed, const std::vector<double>& bounds, const std::string& what)
{
    ASSERT_EQ(by_table.pixel_count(), bounds.size());
    ASSERT_EQ(closed.pixels.size(), bounds.size());
    double worst = 0, largest = 0;
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        const float found = by_table.pixels[i * static_cast<std::size_t>(by_table.channels) + static_cast<std::size_t>(channel)];
        const double off = std::abs(static_cast<double>(found) - closed.pixels[i]);
        worst = std::max(worst, off);
        largest = std::max(largest, bounds[i]);
        ASSERT_LE(off, bounds[i]) << what << ", pixel " << i;
    }
    std::printf("[  MEASURE ] %s: off by %.2e at the most, where up to %.2e is allowed\n", what.c_str(), worst, largest);
}

TEST(WedgeTable, AnEvenLightIsTheClosedForm)
{
    for (const bool plane : {true, false}) {
        const std::vector<TriangleMesh>& meshes = plane ? planar() : casters();
        const Scene scene = scene_of(even_light(), meshes, floor_at(2));
        const Image closed = mask_of(scene);
        EXPECT_LT(*std::min_element(closed.pixels.begin(), closed.pixels.end()), 0.2F);
        const std::string name = plane ? "a sheet, " : "sheet and knot, ";
        const std::vector<double> bounds = rounding_of(even_light(), meshes);
        if (plane) {
            EXPECT_LT(*std::max_element(bounds.begin(), bounds.end()), 2e-4);
        }
        for (const int places : {4, 8, 32, 48})
            expect_within(mask_of(scene, by_table(places)), 0, closed, bounds, name + std::to_string(places) + " places");
        expect_within(mask_of(scene, by_table(16, 3)), 0, mask_of(scene, SoftShadowVolume{.light_splits = 3}),
                      rounding_of(even_light(), meshes, 3), name + "3 splits");
    }
}

TEST(WedgeTable, AWhiteTextureIsNoTexture)
{
    for (const bool plane : {true, false}) {
        const std::vector<TriangleMesh>& meshes = plane ? planar() : casters();
        const Image closed = mask_of(scene_of(even_light(), meshes, floor_at(2)));
        const RectangleLight light = textured(7, 5, 1, [](int, int, int) { return 3.0F; });
        const Image white = mask_of(scene_of(light, meshes, floor_at(2)), by_table());
        ASSERT_EQ(white.channels, 3) << "of a textured light the mask is RGB";
        const std::vector<double> bounds = rounding_of(light, meshes);
        for (const int c : {0, 1, 2}) expect_within(white, c, closed, bounds, "white texture, channel " + std::to_string(c));
    }
}

TEST(WedgeTable, APlanarCasterAgainstRays)
{
    // Stratified rays have an error of a few thousandths at 4096 (.0015 to .0034 on average at 1024); four times their
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
    // A light of 2 x 2 texels, each by itself a light of a quarter: its mask is theirs, weighed. A planar caster, so that all of them are
    // exact; some receivers see its edges just on the borders of the texels.
    const std::vector<TriangleMesh> meshes{sheet(-9.5 / 32, 6.5 / 32, -4.5 / 32, 11.5 / 32, 1)};
    const auto weight = [](int x, int y) { return 1.0F + 2.0F * static_cast<float>(x) + 4.0F * static_cast<float>(y); };
    const Image whole =
        mask_of(scene_of(textured(2, 2, 1, [&](int x, int y, int) { return weight(x, y); }), meshes, floor_at(2)), by_table(48));
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
            const Image mask = mask_of(scene_of(part, meshes, same));
            for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight(x, y) / 16.0 * mask.pixels[i];
        }
    // Interpolation over a step h of f is off by at most h / 4 times what f' varies by within the step, and over several coordinates by the
    // sum of that. Seen from here the sheet is larger than the light: one edge along each axis is on it at the most. Moved across the
    // middle, where the texels' borders are, the edge along y (2 long, the light 4 large, mean emission 4, texels 2 apart across it) has
    // its share's slope changed by 2 * 2 / (4 * 4), half through either end: h / 16. The edge along x, across which texels are 4 apart:
    // h / 8. What else varies: moving an end along its edge sweeps nothing but between places of another line, h wide at most, of
    // emission up to 7 and halved by the other end: by 2 * 7 / 2 * h / 16, so h^2 / 9 an end, four of them.
    const double h = 2.0 / 47, bound = 3 * h / 16 + h * h / 2;
    const std::vector<double> rounding = rounding_of(textured(2, 2, 1, [](int, int, int) { return 1.0F; }), meshes);
    double worst = 0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
        const double off = std::abs(sum[i] - whole.pixels[3 * i]);
        worst = std::max(worst, off);
        ASSERT_LE(off, bound + 2 * rounding[i]) << i; // the table's, and that of its texels' masks
    }
    EXPECT_GT(worst, h / 16) << "no receiver sees an edge where texels meet";
    std::printf("[  MEASURE ] the sum of texels: off by %.4f at the most, where %.4f is allowed\n", worst, bound);
}

TEST(WedgeTable, ABlackChannelCountsAsEven)
{
    const RectangleLight red = textured(4, 4, 3, [](int x, int, int c) { return c == 0 ? static_cast<float>(x) : 0.0F; });
    const Image mask = mask_of(scene_of(red, casters(), floor_at(2)), by_table());
    const Image closed = mask_of(scene_of(even_light(), casters(), floor_at(2)));
    for (const int c : {1, 2}) expect_within(mask, c, closed, rounding_of(red, casters()), "black channel " + std::to_string(c));
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
