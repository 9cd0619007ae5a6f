// Soft shadow volumes on the device: what must not change a bit, settings that the light does not go with, and the papers' integer buffers.
#include <cstdlib>

#include "technique/soft_shadow_volume_run.hpp"

namespace penumbra::test {
namespace {

// Small triangles and large ones, near and far, of several sheets.
WedgeCase mixed_case(const Light& light = rectangle_light(0.7, 0.3))
{
    WedgeCase c{.light = light, .casters = soup(30, {-5, -5, 2}, {5, 5, 8}, 5), .receivers = random_map(61, 47, 4, 9, 0.1, 3)};
    for (const TriangleMesh& mesh : soup(300, {-0.2, -0.2, -0.1}, {0.2, 0.2, 0.1}, 6)) {
        const Vec3 to(0.03 * static_cast<double>(c.casters.size() % 97) - 1.4, 0.02 * static_cast<double>(c.casters.size() % 89) - 0.9,
                      -2.5 - 0.01 * static_cast<double>(c.casters.size()));
        c.casters.push_back(mesh);
        for (Imath::V3f& p : c.casters.back().positions) p = Imath::V3f(Vec3(p) + to);
    }
    c.casters.push_back(closed_box({-1, -1, 3}, {1, 0.5, 3.5}));
    // Pairs of sheets, of which tiles see both, one or none.
    for (int i = 0; i < 20; ++i)
        c.casters.push_back(shell({2.5 * std::cos(i), 2.5 * std::sin(i), 3 + 0.1 * i}, 0.5, {std::sin(3 * i), std::cos(3 * i), 0.2}, 4, 8));
    return c;
}

void expect_some_of_each(const std::vector<float>& mask)
{
    EXPECT_GT(std::count(mask.begin(), mask.end(), 0.0F), 50);
    EXPECT_GT(std::count(mask.begin(), mask.end(), 1.0F), 50);
    EXPECT_GT(std::count_if(mask.begin(), mask.end(), [](float v) { return v > 0 && v < 1; }), 50);
}

const std::vector<std::pair<std::string, Light>> lights = {{"rectangle", rectangle_light(0.7, 0.3)},
                                                           {"small rectangle", rectangle_light(0.001, 0.002)},
                                                           {"sphere", sphere_light(0.5)},
                                                           {"point", point_light()}};

TEST(SoftShadowVolume, CullingNeverChangesABit)
{
    const auto context = device_context();
    for (const auto& [name, light] : lights)
        for (const int splits : {1, 3})
            for (const Overlap overlap : {Overlap::sum, Overlap::product}) {
                if (splits > 1 && !std::holds_alternative<RectangleLight>(light)) continue;
                WedgeCase c = mixed_case(light);
                c.settings = {.overlap = overlap, .light_splits = splits, .culling = WedgeCulling::none};
                const WedgeRun all = run(context, c);
                for (const WedgeCulling culling : {WedgeCulling::loose, WedgeCulling::far_depth, WedgeCulling::tight}) {
                    c.settings.culling = culling;
                    const WedgeRun some = run(context, c);
                    EXPECT_EQ(some.visibility, all.visibility) << name << ", culling " << static_cast<int>(culling);
                    EXPECT_LT(some.counts.pairs, all.counts.pairs + (all.counts.pairs == 0)) << name;
                }
            }
}

// The disc that faces a receiver beside the light reaches beyond the receiver's own plane: casters further along the axis than the receiver
// hide it.
TEST(SoftShadowVolume, CullingBesideASphere)
{
    const auto context = device_context();
    for (const double depth : {0.05, 0.4, 0.9, 1.1}) {
        WedgeCase c{.light = sphere_light(1), .casters = soup(40, {0.5, -2, -1}, {3, 2, 1.5}, 8), .receivers = flat(32, 32, 1)};
        // A row of receivers at x = 2 to 6, seen from above the light.
        c.camera = Camera{.frame = {.origin = {4, 0, 10 - depth}}, .orthographic = true, .half_extent = {2, 2}};
        c.receivers = flat(32, 32, 10);
        c.settings.culling = WedgeCulling::none;
        const WedgeRun all = run(context, c);
        for (const WedgeCulling culling : {WedgeCulling::loose, WedgeCulling::far_depth, WedgeCulling::tight}) {
            c.settings.culling = culling;
            EXPECT_EQ(run(context, c).visibility, all.visibility) << depth << ", culling " << static_cast<int>(culling);
        }
        EXPECT_LT(*std::min_element(all.visibility.begin(), all.visibility.end()), 0.9F) << depth;
    }
}

TEST(SoftShadowVolume, LanesGiveTheSameBits)
{
    const auto context = device_context(true);
    const auto masks_of = [&](const Light& light, WedgeBuffer buffer) {
        WedgeCase c = mixed_case(light);
        c.settings.buffer = buffer;
        std::vector<std::vector<float>> masks;
        for (const int lanes : {1, 8, 16}) {
            context->quirks().lanes = lanes;
            masks.push_back(run(context, c).visibility);
        }
        expect_some_of_each(masks[0]);
        return masks;
    };
    for (const WedgeBuffer buffer : {WedgeBuffer::binary32, WedgeBuffer::int16, WedgeBuffer::six_bits, WedgeBuffer::twelve_bits}) {
        const auto masks = masks_of(rectangle_light(0.7, 0.3), buffer);
        EXPECT_EQ(masks[0], masks[2]) << "buffer " << static_cast<int>(buffer);
        EXPECT_EQ(masks[1], masks[2]) << "buffer " << static_cast<int>(buffer);
    }
    const auto masks = masks_of(sphere_light(0.5), WedgeBuffer::binary32);
    EXPECT_EQ(masks[1], masks[2]) << "sphere";
    // OpenCL grants atan2 six units in the last place, and one number's may differ from sixteen's: of angles up to pi those are 2^-20, of
    // the light 2^-22, for each edge on it; receivers here see fewer than 100.
    double worst = 0;
    for (std::size_t i = 0; i < masks[0].size(); ++i) worst = std::max(worst, std::abs(static_cast<double>(masks[0][i]) - masks[2][i]));
    EXPECT_LE(worst, 100 * 0x1p-22) << "sphere";
}

TEST(SoftShadowVolume, EveryRunGivesTheSameBits)
{
    const WedgeCase c = mixed_case();
    const std::vector<float> first = run(device_context(), c).visibility;
    for (int i = 0; i < 3; ++i) EXPECT_EQ(run(device_context(), c).visibility, first);
    expect_some_of_each(first);
}

// Parts of the light are prepared on all cores, in batches of one, of some, of all.
TEST(SoftShadowVolume, ThreadsGiveTheSameBits)
{
    for (const Coverage coverage : {Coverage::linear, Coverage::analytic, Coverage::texture}) {
        WedgeCase c = mixed_case();
        c.settings = {.coverage = coverage, .light_splits = 3, .table = 8};
        std::vector<std::vector<float>> masks;
        for (const char* const threads : {"1", "2", "64"}) {
            setenv("PENUMBRA_THREADS", threads, 1);
            masks.push_back(run(device_context(), c).visibility);
        }
        unsetenv("PENUMBRA_THREADS");
        EXPECT_EQ(masks[1], masks[0]) << static_cast<int>(coverage);
        EXPECT_EQ(masks[2], masks[0]) << static_cast<int>(coverage);
        expect_some_of_each(masks[0]);
    }
}

// Receivers each alone in a map, others' places empty: other tiles, the same bits.
TEST(SoftShadowVolume, ReceiversDoNotDependOnTheirTile)
{
    const auto context = device_context();
    for (const auto& [name, light] : lights) {
        const WedgeCase whole = mixed_case(light);
        const std::vector<float> mask = run(context, whole).visibility;
        for (const auto& [x0, y0, step] : {std::array{0, 0, 17}, {5, 3, 9}, {60, 46, 1}, {1, 1, 2}}) {
            WedgeCase c = whole;
            for (int y = 0; y < c.receivers.height; ++y)
                for (int x = 0; x < c.receivers.width; ++x)
                    if (x < x0 || y < y0 || (x - x0) % step != 0 || (y - y0) % step != 0) c.receivers.at(x, y) = nothing_there;
            const std::vector<float> part = run(context, c).visibility;
            for (std::size_t i = 0; i < part.size(); ++i)
                ASSERT_EQ(part[i], std::isfinite(c.receivers.depth[i]) ? mask[i] : 1.0F) << name << ", " << i << " of every " << step;
        }
    }
}

TEST(SoftShadowVolume, AwkwardSizesAndCanaries)
{
    const auto context = device_context(true);
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 61}, {61, 1}, {7, 93}, {128, 129}})
        for (const auto& [name, light] : lights) {
            WedgeCase c = mixed_case(light);
            c.receivers = random_map(width, height, 3, 9, 0.1, 4);
            WedgeRun r;
            ASSERT_NO_THROW(r = run(context, c)) << name << ", " << width << " x " << height;
            for (const float v : r.visibility) ASSERT_TRUE(v >= 0 && v <= 1) << v;
        }
}

// Whatever the number of parts, the whole light is 1 and none of it 0; also where a part's shares are no binary fractions.
TEST(SoftShadowVolume, SplitLightsAddUpToOne)
{
    const auto context = device_context();
    for (int splits = 1; splits <= 16; ++splits) {
        WedgeCase c{.casters = {sheet(-1, 1, -1, 1, 7)}, .settings = {.light_splits = splits}, .receivers = flat(24, 24, 8)};
        c.receivers.at(3, 3) = nothing_there;
        const std::vector<float> mask = run(context, c).visibility;
        EXPECT_EQ(mask[0], 1.0F) << splits << " splits: 1 - " << 1 - mask[0];
        EXPECT_EQ(mask[3 * 24 + 3], 1.0F) << splits;
        EXPECT_EQ(mask[12 * 24 + 12], 0.0F) << splits;
        for (const float v : mask) EXPECT_TRUE(v >= 0 && v <= 1) << v;
    }
}

TEST(SoftShadowVolume, NothingThatCasts)
{
    const auto context = device_context();
    for (const auto& [name, light] : lights) {
        WedgeCase c{.light = light, .casters = {}, .receivers = flat(20, 20, 8)};
        for (const float v : run(context, c).visibility) EXPECT_EQ(v, 1.0F) << name;
        // All behind the light.
        c.casters = {closed_box({-1, -1, -3}, {1, 1, -2}), sheet(-1, 1, -1, 1, -1)};
        for (const float v : run(context, c).visibility) EXPECT_EQ(v, 1.0F) << name << ", behind";
        // All behind the receivers.
        c.casters = {closed_box({-1, -1, 9}, {1, 1, 10}), sheet(-1, 1, -1, 1, 12)};
        for (const float v : run(context, c).visibility) EXPECT_EQ(v, 1.0F) << name << ", beyond";
    }
}

// A light without extent has hard shadows: 0 or 1, as the line to its centre goes.
TEST(SoftShadowVolume, LightsOfNoExtentAreHard)
{
    const auto context = device_context();
    for (const Light& light : {Light(point_light()), Light(sphere_light(0))}) {
        WedgeCase c{.light = light, .casters = {sheet(-1.1, 1.3, -0.9, 1.7, 4)}, .receivers = flat(61, 61, 8)};
        const WedgeRun r = run(context, c);
        for (std::size_t i = 0; i < r.points.size(); ++i) {
            const double x = 4 * r.points[i].xi, y = 4 * r.points[i].eta;
            EXPECT_EQ(r.visibility[i], x > -1.1 && x < 1.3 && y > -0.9 && y < 1.7 ? 0.0F : 1.0F) << x << ", " << y;
        }
    }
}

TEST(SoftShadowVolume, SplittingAnythingButARectangleIsRefused)
{
    WedgeCase c{.light = sphere_light(1), .casters = {sheet(-1, 1, -1, 1, 4)}, .settings = {.light_splits = 2}, .receivers = flat(1, 1, 8)};
    const Error error = error_of([&] { run(device_context(), c); });
    EXPECT_EQ(error.code(), ErrorCode::invalid_input);
    EXPECT_TRUE(holds(error.what(), "technique.light_splits: is 2")) << error.what();
    EXPECT_TRUE(holds(error.what(), "sphere")) << error.what();
}

// --- The papers' integer buffers ------------------------------------------------------------------------------------------------------

struct Buffer {
    WedgeBuffer buffer;
    const char* name;
    double levels;
};
constexpr Buffer buffers[] = {
    {WedgeBuffer::int16, "int16", 255}, {WedgeBuffer::six_bits, "six_bits", 63}, {WedgeBuffer::twelve_bits, "twelve_bits", 4095}};

// A half-plane's edge over the light: one share, rounded to a level: at most half a level off.
TEST(WedgeBuffers, OneEdgeRoundsByHalfALevel)
{
    const auto context = device_context();
    for (const auto& [buffer, name, levels] : buffers) {
        WedgeCase c{.casters = {sheet(0, 400, -400, 400, 4)}, .receivers = flat(64, 1, 8)};
        c.camera = Camera{.frame = {}, .orthographic = false, .half_extent = {0.25, 0.01}};
        const std::vector<float> exact = run(context, c).visibility;
        c.settings.buffer = buffer;
        const std::vector<float> rounded = run(context, c).visibility;
        double worst = 0;
        for (std::size_t i = 0; i < exact.size(); ++i) worst = std::max(worst, static_cast<double>(std::abs(rounded[i] - exact[i])));
        EXPECT_LE(worst, 0.5 / levels + 0x1p-20) << name; // and the roundings of a few operations on numbers up to 1
        EXPECT_GT(worst, 0.25 / levels) << name;
        testing::Test::RecordProperty(std::string("worst_") + name, std::to_string(worst * levels));
    }
}

// What n small squares before the light's centre leave of it, each hiding 1/16 with four edges of equal shares: in the buffer's own levels,
// as the papers lay them out.
double in_buffer(WedgeBuffer buffer, int n)
{
    const double share = 15.0 / 64;
    const auto level = [&](double levels) { return std::rint(share * levels); };
    double occlusion = n;
    if (buffer == WedgeBuffer::int16) occlusion = (std::min(32767.0, 255.0 * n) - 4 * n * level(255)) / 255;
    if (buffer == WedgeBuffer::six_bits) occlusion -= std::min(255.0, 4 * n * level(63)) / 63;
    if (buffer == WedgeBuffer::twelve_bits)
        for (int i = 0, digits = static_cast<int>(level(4095)); i < 4; ++i, digits /= 8)
            occlusion -= std::min(255.0, 4.0 * n * (digits % 8)) * std::pow(8.0, i) / 4095;
    return 1 - std::clamp(occlusion, 0.0, 1.0);
}

// How many sheets go in before the mask is lost (off by more than 1/4).
//   int16: 32767 / 255 = 128 hard shadows; the 129th and those after are lost, 240 levels a sheet are taken off all the same: from the
//   136th
//     sheet on nothing is hidden.
//   six_bits: 255 levels are taken off at the most, which are 4 sheets of 60: the fifth counts as whole.
//   twelve_bits: 960 is octal 1700; the third channel takes 255 / 7 = 36 edges, which are 9 sheets.
TEST(WedgeBuffers, SaturateFromThisManySheetsOn)
{
    const auto context = device_context();
    for (const auto& [buffer, name, levels] : buffers) {
        const int expected = buffer == WedgeBuffer::int16 ? 136 : buffer == WedgeBuffer::six_bits ? 5 : 10;
        int lost = 0;
        for (int n = 1; n <= 160 && lost == 0; n = n < 16 || n >= 120 ? n + 1 : n + 8) {
            // From 8 a square at 4 that reaches to x lies on the light to 2 x: an area of (2 x)^2 of the light's, 1/16 for x = 1/8.
            WedgeCase c{.casters = {}, .settings = {.buffer = buffer}, .receivers = flat(1, 1, 8)};
            c.casters.assign(static_cast<std::size_t>(n), sheet(-0.125, 0.125, -0.125, 0.125, 4));
            const double seen = run(context, c).visibility[0], truth = std::max(0.0, 1 - n / 16.0);
            // The sum's few roundings, of numbers up to 160.
            EXPECT_NEAR(seen, in_buffer(buffer, n), 160 * 0x1p-22) << name << ", " << n << " sheets";
            if (std::abs(seen - truth) > 0.25) lost = n;
        }
        EXPECT_EQ(lost, expected) << name;
    }
    // binary32 loses none.
    WedgeCase c{.casters = {}, .receivers = flat(1, 1, 8)};
    c.casters.assign(160, sheet(-0.125, 0.125, -0.125, 0.125, 4));
    EXPECT_EQ(run(context, c).visibility[0], 0.0F);
}

} // namespace
} // namespace penumbra::test
