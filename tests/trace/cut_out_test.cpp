// Rays and rendered depth go through what is cut out.
#include <gtest/gtest.h>

#include <penumbra/error.hpp>

#include "scene/light_space.hpp"
#include "trace/tracer.hpp"

using namespace penumbra;

namespace {

// The square -1 to 1 at height 2, seen from above: the image's left half is cut out, which lies at x < 0.
TriangleMesh half_square()
{
    TriangleMesh mesh{.positions = {{-1, 2, 1}, {1, 2, 1}, {1, 2, -1}, {-1, 2, -1}}, .triangles = {{0, 1, 2}, {0, 2, 3}}};
    CutOuts cuts;
    cuts.images.push_back(
        {.alpha = {.width = 2, .height = 1, .channels = 1, .pixels = {0, 1}}, .beyond_u = CutOut::Beyond::clamp, .nearest = true});
    cuts.image = {0, 0};
    cuts.texture = {{{{0, 1}, {1, 1}, {1, 0}}}, {{{0, 1}, {1, 0}, {0, 0}}}};
    mesh.cut_outs = std::make_shared<const CutOuts>(std::move(cuts));
    return mesh;
}

// Looks down from the origin of the light at height 4, x to the right.
Camera from_above() { return {.frame = {{0, 4, 0}, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, .half_extent = {1, 1}}; }

} // namespace

TEST(CutOutTrace, DepthGoesThroughTheHole)
{
    TriangleMesh whole = half_square();
    whole.cut_outs = nullptr;
    for (Imath::V3f& p : whole.positions) p.y = 1;
    const TriangleMesh cut = half_square();
    const TriangleMesh* const meshes[] = {&cut, &whole}; // in one buffer with triangles that are whole
    const Tracer tracer(meshes, {0, 4, 0});
    const DepthMap front = tracer.front(from_above(), 64, 64);
    for (int x = 0; x < 64; ++x) {
        const double at = 2 * ((x + 0.5) / 32 - 1); // on the upper square
        const float depth = front.at(x, 32);
        if (at > 0 && at < 1) {
            EXPECT_FLOAT_EQ(depth, 2) << x;
        }
        if (at < 0 && at > -0.6) {
            EXPECT_FLOAT_EQ(depth, 3) << x << ": the square below";
        }
        if (std::abs(at) > 1.4) {
            EXPECT_EQ(depth, nothing_there) << x;
        }
    }
    const std::vector<DepthMap> layers = tracer.layers(from_above(), 64, 64, 2);
    EXPECT_FLOAT_EQ(layers[1].at(40, 32), 3);
    EXPECT_EQ(layers[1].at(28, 32), nothing_there);
}

TEST(CutOutTrace, ShadowRaysGoThroughTheHole)
{
    const TriangleMesh cut = half_square();
    const TriangleMesh* const meshes[] = {&cut};
    const Tracer tracer(meshes, {0, 4, 0});
    const DepthMap floor{.width = 64, .height = 1, .depth = std::vector<float>(64, 4.0f)};
    const PointLight light{{0, 4, 0}, {0, -1, 0}, {}};
    const Image mask = trace_visibility(tracer, light, floor, from_above(), {.samples = 1}).visibility;
    for (int x = 0; x < 64; ++x) {
        const double at = 2 * ((x + 0.5) / 32 - 1); // where the ray meets the square
        if (std::abs(at) < 0.95 || std::abs(at) > 1.05) {
            EXPECT_EQ(mask.at(x, 0), at > 0 && at < 1 ? 0.0f : 1.0f) << x;
        }
    }
}

TEST(CutOutTrace, CutOutsThatDoNotFitAreRefused)
{
    for (int wrong = 0; wrong < 3; ++wrong) {
        TriangleMesh mesh = half_square();
        CutOuts cuts = *mesh.cut_outs;
        if (wrong == 0) cuts.image.pop_back();
        if (wrong == 1) cuts.image[1] = 1;
        if (wrong == 2) cuts.images[0].alpha.pixels.pop_back();
        mesh.cut_outs = std::make_shared<const CutOuts>(std::move(cuts));
        const TriangleMesh* const meshes[] = {&mesh};
        EXPECT_THROW(Tracer(meshes, {0, 0, 0}), Error) << wrong;
    }
}
