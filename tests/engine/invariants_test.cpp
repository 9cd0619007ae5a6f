// What holds for every mask: its range, monotony, and the same bits whatever the tiling, the number of threads, or the run.
#include <thread>

#include "support/child.hpp"
#include "support/maps.hpp"

namespace penumbra::test {
namespace {

const std::vector<Technique> techniques = {
    SoftShadowMap{},
    SoftShadowMap{.sides = Sides::front, .resolution = 31},
    SoftShadowMap{.tolerance = 0},
    SoftShadowMap{.visibility = PatchVisibility::sum, .accumulator = Accumulator::compensated},
    SoftShadowMap{.visibility = PatchVisibility::sum, .accumulator = Accumulator::binary16},
    ShadowMap{},
    ShadowMap{.filter = ShadowFilter::percentage_closer, .taps = 4},
    ShadowMap{.filter = ShadowFilter::bicubic},
};

struct Inputs {
    Occluders occluders;
    Receivers receivers;
};

Inputs inputs(int texels = 61, int width = 93, int height = 41)
{
    Inputs i{.occluders = occluders(light_view(), random_map(texels, texels, 2, 4, 0.5, 1)),
             .receivers = receivers(light_view(), random_map(width, height, 3, 9, 0.05, 3))};
    i.occluders.back = random_map(texels, texels, 3, 5, 0.5, 2);
    return i;
}

TEST(Invariants, VisibilityIsFromZeroToOne)
{
    const Engine engine;
    const Inputs i = inputs();
    for (const double half : {0.0, 0.01, 1.0, 100.0})
        for (const Technique& technique : techniques) {
            const Mask mask = engine.shade(engine.prepare(rectangle_light(half, half), i.occluders, technique), i.receivers);
            for (const float v : mask.visibility.pixels) ASSERT_TRUE(v >= 0 && v <= 1) << v;
        }
}

// Every rounding is monotone, so this holds to the bit where shares are added one after the other; a compensated sum carries its own error,
// which two units in the last place cover.
TEST(Invariants, AnAddedTexelNeverBrightens)
{
    const Engine engine;
    const Inputs i = inputs(33);
    std::mt19937 random(11);
    for (const Accumulator accumulator : {Accumulator::binary32, Accumulator::binary16, Accumulator::compensated}) {
        // Without the self-shadow bound, which looks at neighbouring texels: a texel may show that its neighbours are one surface.
        const SoftShadowMap technique{.visibility = PatchVisibility::sum, .accumulator = accumulator, .bias = 0, .tolerance = 0};
        const float slack = accumulator == Accumulator::compensated ? 0x1p-22f : 0.0f;
        Occluders o = i.occluders;
        Mask before = engine.shade(engine.prepare(rectangle_light(0.4, 0.4), o, technique), i.receivers);
        int darker = 0;
        for (int step = 0; step < 8; ++step) {
            for (int n = 0; n < 20; ++n) {
                float& depth = o.front->depth[random() % o.front->depth.size()];
                if (!std::isfinite(depth)) depth = 3;
            }
            const Mask after = engine.shade(engine.prepare(rectangle_light(0.4, 0.4), o, technique), i.receivers);
            for (std::size_t p = 0; p < after.visibility.pixels.size(); ++p) {
                ASSERT_LE(after.visibility.pixels[p], before.visibility.pixels[p] + slack) << p;
                darker += after.visibility.pixels[p] < before.visibility.pixels[p];
            }
            before = after;
        }
        EXPECT_GT(darker, 100);
    }
}

// Receivers that are each alone in a map, in narrow and in wide maps: other tiles, other culling, other lanes, the same bits.
TEST(Invariants, ReceiversDoNotDependOnTheirTile)
{
    const Engine engine;
    const Inputs i = inputs(61, 64, 48);
    for (const Technique& technique : techniques) {
        const Prepared prepared = engine.prepare(rectangle_light(0.3, 0.5), i.occluders, technique);
        const Mask whole = engine.shade(prepared, i.receivers);

        // Crops of the light's view as pinholes: the same points up to the rounding of their place, which powers of two do not have.
        const auto keep = [&](int x0, int y0, int step) {
            return map_of(64, 48, [&, x0, y0, step](int x, int y) {
                return x >= x0 && y >= y0 && (x - x0) % step == 0 && (y - y0) % step == 0 ? i.receivers.depth->at(x, y) : nothing_there;
            });
        };
        for (const auto& [x0, y0, step] : {std::array{0, 0, 17}, {5, 3, 9}, {63, 47, 1}, {1, 1, 2}, {33, 0, 3}}) {
            const DepthMap few = keep(x0, y0, step);
            const Mask part = engine.shade(prepared, receivers(light_view(), few));
            for (std::size_t p = 0; p < few.depth.size(); ++p)
                ASSERT_EQ(part.visibility.pixels[p], std::isfinite(few.depth[p]) ? whole.visibility.pixels[p] : 1.0f)
                    << p << " of every " << step << " from " << x0 << ", " << y0;
        }
    }
}

// A row of receivers in maps of several widths: the light's view widens with the map, so that every pixel keeps its tangents.
TEST(Invariants, ReceiversDoNotDependOnTheMapsSize)
{
    const Engine engine;
    const Inputs i = inputs();
    // Tangents are k / 64 for a map of k pixels: a pixel's place is its index from the middle over 64 in all of them.
    const auto depth_at = [](int x, int y) { return 5.0f + 0.125f * static_cast<float>((x + y) & 3); };
    const auto shade = [&](int size, const Prepared& prepared) {
        const PinholeCamera camera{.frame = {}, .tan_half_fov = {size / 64.0, size / 64.0}};
        return engine.shade(prepared,
                            receivers(camera, map_of(size, size, [&](int x, int y) { return depth_at(x - size / 2, y - size / 2); })));
    };
    const SoftShadowMap technique;
    const Prepared prepared = engine.prepare(rectangle_light(0.3, 0.5), i.occluders, technique);
    const Mask whole = shade(64, prepared);
    for (const int size : {2, 4, 8, 16, 32}) {
        const Mask part = shade(size, prepared);
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x)
                ASSERT_EQ(part.visibility.at(x, y), whole.visibility.at(x + 32 - size / 2, y + 32 - size / 2))
                    << size << ": " << x << ", " << y;
    }
}

std::string hashes()
{
    const Engine engine;
    const Inputs i = inputs(128, 193, 97);
    std::string text;
    for (const Technique& technique : techniques)
        text += "hash " +
                std::to_string(hash_of(
                    engine.shade(engine.prepare(rectangle_light(0.3, 0.5), i.occluders, technique), i.receivers).visibility.pixels)) +
                "\n";
    return text;
}

TEST(Invariants, DISABLED_PrintHashes) { std::fputs(("\n" + hashes()).c_str(), stdout); }

TEST(Invariants, SameBitsInEveryRunAndWithAnyNumberOfThreads)
{
    const std::string here = hashes();
    EXPECT_EQ(hashes(), here);
    for (const char* threads : {"1", "2", "3"})
        EXPECT_EQ(child_output("Invariants.DISABLED_PrintHashes", {{"POCL_MAX_PTHREAD_COUNT", threads}}, "hash "), here)
            << threads << " threads";
}

TEST(Invariants, OneEngineServesSeveralThreads)
{
    const Engine engine;
    const Inputs i = inputs();
    std::vector<Mask> expected;
    for (const Technique& technique : techniques)
        expected.push_back(engine.shade(engine.prepare(rectangle_light(0.3, 0.5), i.occluders, technique), i.receivers));
    const Prepared shared = engine.prepare(rectangle_light(0.3, 0.5), i.occluders, techniques[0]);

    std::vector<std::thread> threads;
    std::array<int, 4> wrong{};
    for (std::size_t t = 0; t < wrong.size(); ++t)
        threads.emplace_back([&, t] {
            for (std::size_t n = 0; n < 2 * techniques.size(); ++n) {
                const std::size_t which = (n + t) % techniques.size();
                const Mask mask = engine.shade(engine.prepare(rectangle_light(0.3, 0.5), i.occluders, techniques[which]), i.receivers);
                wrong[t] += mask.visibility.pixels != expected[which].visibility.pixels;
                wrong[t] += engine.shade(shared, i.receivers).visibility.pixels != expected[0].visibility.pixels;
            }
        });
    for (std::thread& thread : threads) thread.join();
    for (const int count : wrong) EXPECT_EQ(count, 0);
}

TEST(Invariants, PreparedOutlivesItsEngine)
{
    const Inputs i = inputs();
    auto engine = std::make_unique<Engine>();
    const Prepared prepared = engine->prepare(rectangle_light(0.3, 0.5), i.occluders, SoftShadowMap{});
    const Mask before = engine->shade(prepared, i.receivers);
    engine = std::make_unique<Engine>(Engine()); // another one, moved into place; the first is gone
    EXPECT_EQ(engine->shade(prepared, i.receivers).visibility.pixels, before.visibility.pixels);
}

} // namespace
} // namespace penumbra::test
