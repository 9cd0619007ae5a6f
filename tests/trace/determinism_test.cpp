// The same bits for a seed, whatever the threads; adaptive against plain.
#include <cstdlib>

#include <gtest/gtest.h>

#include "meshes.hpp"

namespace penumbra {
namespace {

class Threads {
public:
    explicit Threads(const char* count) { setenv("PENUMBRA_THREADS", count, 1); }
    ~Threads() { unsetenv("PENUMBRA_THREADS"); }
};

struct Case {
    Light light = rectangle_light(1, 1);
    Camera camera = camera_of(light, 0.7);
    DepthMap receivers = flat_map(93, 61, 5);
    Tracer tracer = tracer_of({parallel_quad(-1.7, 0.4, -1.3, 0.9, 2), sphere(world_from_light(1, 1, 3), 0.5, 3)});

    VisibilityResult trace(const VisibilityOptions& options) const { return trace_visibility(tracer, light, receivers, camera, options); }
};

TEST(Determinism, SameBitsForAnyThreadCount)
{
    const Case scene;
    for (const bool adaptive : {false, true}) {
        const VisibilityOptions options{.samples = 100, .adaptive = adaptive, .first_samples = 7, .seed = 5};
        std::vector<VisibilityResult> results;
        for (const char* count : {"1", "2", "7"}) {
            const Threads threads(count);
            results.push_back(scene.trace(options));
        }
        for (const VisibilityResult& r : results) {
            EXPECT_EQ(r.visibility.pixels, results[0].visibility.pixels);
            EXPECT_EQ(r.rays, results[0].rays);
        }
    }
}

TEST(Determinism, SeedsDiffer)
{
    const Case scene;
    const Image a = scene.trace({.samples = 64, .seed = 1}).visibility, b = scene.trace({.samples = 64, .seed = 2}).visibility;
    EXPECT_EQ(a.pixels, scene.trace({.samples = 64, .seed = 1}).visibility.pixels);
    EXPECT_NE(a.pixels, b.pixels);
}

TEST(Determinism, PixelsDiffer)
{
    // Receivers at one and the same depth along a line parallel to the occluder's edge: the same visibility, different noise.
    const Case scene;
    const Tracer edge = tracer_of({parallel_quad(0, 100, -100, 100, 2)});
    const Image mask = trace_visibility(edge, scene.light, scene.receivers, scene.camera, {.samples = 63}).visibility;
    int differ = 0;
    for (int y = 1; y < mask.height; ++y) differ += mask.at(46, y) != mask.at(46, y - 1);
    EXPECT_GT(differ, mask.height / 4);
}

TEST(Adaptive, EqualsPlainOrIsSettled)
{
    const Case scene;
    const VisibilityResult plain = scene.trace({.samples = 256});
    const VisibilityResult adaptive = scene.trace({.samples = 256, .adaptive = true, .first_samples = 16});
    EXPECT_LT(adaptive.rays, plain.rays);

    // A pixel has the plain bits or is settled at 0 or 1. 16 first rays of 4 x 4 pixels in each of nine tiles agree only where visibility
    // is 0 or 1 but for less than one stratum of 16 pixels: plain is then within 1/16.
    int settled = 0;
    for (std::size_t i = 0; i < plain.visibility.pixels.size(); ++i) {
        const float p = plain.visibility.pixels[i], a = adaptive.visibility.pixels[i];
        if (p == a) continue;
        ++settled;
        EXPECT_TRUE(a == 0.f || a == 1.f) << a;
        EXPECT_NEAR(a, p, 1.0 / 16) << i;
    }
    EXPECT_LT(settled, static_cast<int>(plain.visibility.pixels.size() / 50));

    // Umbra and full light are both in the picture, and are exactly that.
    EXPECT_EQ(plain.visibility.at(92, 60), 1.f);
    EXPECT_EQ(adaptive.visibility.at(92, 60), 1.f);
    EXPECT_EQ(plain.visibility.at(25, 35), 0.f);
    EXPECT_EQ(adaptive.visibility.at(25, 35), 0.f);
}

TEST(Adaptive, TilesBesideADifferentTileAreNotSettled)
{
    // A shadow edge between two columns of tiles, its penumbra far narrower than a pixel: no tile is mixed. The two at the edge cast all
    // rays.
    const Light light = rectangle_light(1e-3, 1e-3);
    const Tracer tracer = tracer_of({parallel_quad(0, 100, -100, 100, 2)});
    const VisibilityResult result =
        trace_visibility(tracer, light, flat_map(16, 8, 5), camera_of(light, 0.5), {.samples = 256, .adaptive = true, .first_samples = 9});
    EXPECT_EQ(result.rays, 16u * 8u * 9u + 8u * 8u * 256u);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 16; ++x) EXPECT_EQ(result.visibility.at(x, y), x < 8 ? 1.f : 0.f);
}

TEST(Adaptive, FewSamplesArePlain)
{
    const Case scene;
    EXPECT_EQ(scene.trace({.samples = 16}).visibility.pixels,
              scene.trace({.samples = 16, .adaptive = true, .first_samples = 16}).visibility.pixels);
}

} // namespace
} // namespace penumbra
