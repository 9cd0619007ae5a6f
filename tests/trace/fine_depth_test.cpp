// Samples of texels in which something begins or ends.
#include <algorithm>

#include <gtest/gtest.h>

#include "io/mesh_io.hpp"
#include "meshes.hpp"
#include "scene/fine_depth.hpp"

namespace penumbra {
namespace {

constexpr ViewRequest all_maps{.front = true, .back = true, .layers = 3, .first_layer = 1, .fine = 4};

std::vector<const DepthMap*> maps_of(const TracedViews& views)
{
    std::vector<const DepthMap*> maps{&views.front, &views.back};
    for (const DepthMap& layer : views.layers) maps.push_back(&layer);
    return maps;
}

// Every sample is what the camera sees through the pixel of a map that is `side` times as large.
void expect_pixels_of_larger_map(const Tracer& tracer, const Camera& camera, const TracedViews& views)
{
    const auto maps = maps_of(views);
    const int width = views.front.width, height = views.front.height, side = views.front.fine->side;
    ViewRequest larger = all_maps;
    larger.fine = 0;
    const TracedViews whole = tracer.views(camera, width * side, height * side, larger);
    const auto expected = maps_of(whole);
    for (std::size_t m = 0; m < maps.size(); ++m) {
        const FineDepth& fine = *maps[m]->fine;
        ASSERT_EQ(fine.side, side);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const std::int32_t block = (*fine.blocks)[static_cast<std::size_t>(y * width + x)];
                for (int i = 0; block >= 0 && i < side * side; ++i)
                    ASSERT_EQ(fine.depth[static_cast<std::size_t>(block) * fine.block_size() + static_cast<std::size_t>(i)], expected[m]->at(x * side + i % side, y * side + i / side))
                        << "map " << m << " at " << x << ", " << y;
            }
    }
}

std::size_t count_blocks(const DepthMap& map)
{
    return static_cast<std::size_t>(std::ranges::count_if(*map.fine->blocks, [](std::int32_t block) { return block >= 0; }));
}

// A quad whose outline lies inside texels: those that it passes have samples, and at most those next to them.
TEST(FineDepth, FollowsAnOutline)
{
    const Light light = rectangle_light(1, 1);
    const Tracer tracer = tracer_of({parallel_quad(-1.03, 0.97, -0.98, 1.01, 4)});
    const Camera camera = camera_of(light, 0.5);
    const TracedViews views = tracer.views(camera, 40, 40, all_maps);
    ASSERT_TRUE(views.front.fine);
    expect_pixels_of_larger_map(tracer, camera, views);
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x) {
            const Vec3 p = camera_point(camera, 40, 40, x + 0.5, y + 0.5, 4);
            const double texel = 4.0 / 40, left = std::min(std::abs(p.x + 1.03), std::abs(p.x - 0.97)), above = std::min(std::abs(p.y + 0.98), std::abs(p.y - 1.01));
            const bool near_x = left < texel / 2 && p.y > -0.98 - texel / 2 && p.y < 1.01 + texel / 2, near_y = above < texel / 2 && p.x > -1.03 - texel / 2 && p.x < 0.97 + texel / 2;
            const std::int32_t block = (*views.front.fine->blocks)[static_cast<std::size_t>(y * 40 + x)];
            if (near_x || near_y) {
                EXPECT_GE(block, 0) << x << ", " << y;
            }
            if (left > 1.5 * texel && above > 1.5 * texel) {
                EXPECT_LT(block, 0) << x << ", " << y;
            }
        }
}

// A plane that tilts has no outline, however steep it is; nor has nothing at all.
TEST(FineDepth, SurfacesThatGoOnHaveNone)
{
    const Camera camera = camera_of(rectangle_light(1, 1), 0.5);
    const TriangleMesh tilted = quad({0, -10, 0}, {20, 15, 0}, {0, 0, -20});
    EXPECT_FALSE(tracer_of({tilted}).views(camera, 40, 40, all_maps).front.fine);
    EXPECT_FALSE(tracer_of({parallel_quad(50, 51, 50, 51, 4)}).views(camera, 40, 40, all_maps).front.fine);
}

// All maps have samples of the same texels, and those are where a larger map finds something beginning or ending: thin things between rays are missed.
TEST(FineDepth, FindsWhatALargerMapFinds)
{
    const TriangleMesh bunny = read_mesh(PENUMBRA_BUNNY, "bunny");
    const Tracer tracer = tracer_of({bunny});
    const Imath::Box3d bounds = penumbra::bounds(bunny);
    const Camera camera = camera_at(bounds.center() + Vec3(0, 0.3, 1) * (bounds.size().length() * 1.5), bounds.center(), 0.4);
    constexpr int size = 100;
    const TracedViews views = tracer.views(camera, size, size, all_maps);
    ASSERT_TRUE(views.front.fine);
    expect_pixels_of_larger_map(tracer, camera, views);
    EXPECT_LT(count_blocks(views.front), size * size / 4);

    const DepthMap larger = tracer.front(camera, size * 4, size * 4);
    int cut = 0, missed = 0;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            int there = 0;
            for (int i = 0; i < 16; ++i) there += larger.at(4 * x + i % 4, 4 * y + i / 4) != nothing_there;
            if (there == 0 || there == 16) continue;
            ++cut;
            missed += (*views.front.fine->blocks)[static_cast<std::size_t>(y * size + x)] < 0;
        }
    EXPECT_GT(cut, size);
    EXPECT_LE(missed, cut / 100) << "of " << cut;
}

// Where nearly every texel is cut, there are fewer samples in each: on average no more than asked for.
TEST(FineDepth, SamplesAreBounded)
{
    std::vector<TriangleMesh> grass;
    for (int i = 0; i < 400; ++i) grass.push_back(parallel_quad(-2 + 0.01 * i, -1.995 + 0.01 * i, -2, 2, 3 + 0.002 * i));
    const Tracer tracer = tracer_of(grass);
    const Camera camera = camera_of(rectangle_light(1, 1), 0.5);
    const TracedViews views = tracer.views(camera, 60, 60, all_maps);
    ASSERT_TRUE(views.front.fine);
    EXPECT_LE(views.front.fine->depth.size(), std::size_t{4} * 60 * 60);
    EXPECT_LT(views.front.fine->side, 4);
    expect_pixels_of_larger_map(tracer, camera, views);
}

} // namespace
} // namespace penumbra
