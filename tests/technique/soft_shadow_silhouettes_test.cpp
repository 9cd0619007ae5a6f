// Silhouettes from each receiver: against double precision, and what must not change a bit.
#include <cstdlib>

#include "oracle/soft_shadow_silhouettes_oracle.hpp"
#include "technique/soft_shadow_volume_run.hpp"

namespace penumbra::test {
namespace {

const SoftShadowVolume per_receiver{.silhouettes = Silhouettes::per_receiver};

Camera oblique_camera()
{
    const double c = std::cos(0.3), s = std::sin(0.3);
    return {.frame = {.origin = {1.5, 0.5, -1}, .x = {c, 0, -s}, .y = {0, 1, 0}, .z = {s, 0, c}}, .orthographic = false, .half_extent = {0.7, 0.5}};
}

std::vector<oracle::silhouettes::Triangle> triangles_of(const WedgeCase& c)
{
    const LightFrame light = light_frame(c.light);
    std::vector<oracle::silhouettes::Triangle> triangles;
    for (const TriangleMesh& mesh : c.casters)
        for (const auto& t : mesh.triangles)
            triangles.push_back({light_from_world(light, Vec3(mesh.positions[t[0]])), light_from_world(light, Vec3(mesh.positions[t[1]])),
                                 light_from_world(light, Vec3(mesh.positions[t[2]]))});
    return triangles;
}

// Every receiver counts the oracle's samples, but for those on an edge. Returns how many see a part of the light.
int compare_with_oracle(const WedgeCase& c, const std::string& what)
{
    const WedgeRun r = run(device_context(), c);
    const LightFrame light = light_frame(c.light);
    const auto triangles = triangles_of(c);
    int part = 0, failures = 0;
    double error = 0;
    for (std::size_t i = 0; i < r.points.size(); ++i) {
        const auto& at = r.points[i];
        if (at.d == NO_RECEIVER) {
            EXPECT_EQ(r.visibility[i], 1.0F) << what << ", nothing at " << i;
            continue;
        }
        const Vec3 p(at.xi / at.d, at.eta / at.d, 1 / at.d);
        const Vec2 half(light.half_u, light.half_v);
        const double expected = oracle::silhouettes::hidden(triangles, p, half), hidden = 1 - static_cast<double>(r.visibility[i]);
        part += expected > 0 && expected < 1;
        error += std::abs(hidden - expected);
        if (hidden == expected) continue;
        const auto range = oracle::silhouettes::range(triangles, p, half);
        if (hidden >= range.least && hidden <= range.most) continue;
        if (++failures <= 3)
            ADD_FAILURE() << what << ", receiver " << i << " (" << at.xi << ", " << at.eta << ", " << at.d << "): hidden " << hidden << ", expected "
                          << expected << " within " << range.least << ", " << range.most;
    }
    EXPECT_EQ(failures, 0) << what;
    const double mean = part > 0 ? error / part : 0;
    EXPECT_LT(mean, 1e-4) << what;
    std::printf("[  MEASURE ] %s: %d receivers in penumbra, %.7f off the samples' exact count\n", what.c_str(), part, mean);
    return part;
}

const std::vector<std::pair<std::string, Light>> lights = {
    {"square", rectangle_light(1, 1)}, {"rectangle", rectangle_light(0.7, 0.2)}, {"small", rectangle_light(0.01, 0.02)}, {"large", rectangle_light(9, 7)}};

WedgeCase case_of(const Light& light, std::vector<TriangleMesh> casters, double depth = 8)
{
    return {.light = light, .casters = std::move(casters), .settings = per_receiver, .receivers = flat(23, 14, static_cast<float>(depth))};
}

TEST(SoftShadowSilhouettes, SheetsAndBoxes)
{
    for (const auto& [name, light] : lights) {
        const int least = name == "small" ? -1 : 5; // of 322 receivers
        EXPECT_GT(compare_with_oracle(case_of(light, {sheet(-1.1, 1.3, -0.9, 1.7, 4)}), name + ", parallel"), least);
        EXPECT_GT(compare_with_oracle(case_of(light, {sheet({Vec3(-2, -1.5, 3), Vec3(2, -1.5, 6), Vec3(2, 1.5, 6.5), Vec3(-2, 1.5, 3.5)})}), name + ", tilted"), least);
        EXPECT_GT(compare_with_oracle(case_of(light, {sheet(-1, 1, -1, 1, 3), sheet(-0.5, 2, -2, 1.5, 5), sheet(-1, 1.5, -1, 0.5, 5.01)}), name + ", stacked"), least);
        EXPECT_GT(compare_with_oracle(case_of(light, {closed_box({-1, -1, 3}, {1, 1, 5}), closed_box({0, -2, 4}, {2.5, 2, 5.5}), closed_box({-3, -0.1, 2}, {3, 0.1, 2.2})}),
                                      name + ", boxes one in the other"),
                  least);
        // On the floor, and through it.
        EXPECT_GT(compare_with_oracle(case_of(light, {closed_box({-1, -1, 6}, {1, 1, 8}), closed_box({2, -1, 6}, {3, 1, 9})}), name + ", on the floor"), least);
    }
}

TEST(SoftShadowSilhouettes, TrianglesAnywhere)
{
    for (const auto& [name, light] : lights)
        for (std::uint32_t seed = 0; seed < 3; ++seed) {
            WedgeCase c = case_of(light, soup(12, {-6, -6, 1.5}, {6, 6, 12}, seed));
            c.receivers = random_map(20, 12, 4, 9, 0.1, seed + 9);
            compare_with_oracle(c, name + ", soup " + std::to_string(seed));
            c.camera = oblique_camera();
            compare_with_oracle(c, name + ", soup from beside " + std::to_string(seed));
            // Across the light's plane, and through the light.
            c.casters = soup(6, {-3, -3, -2}, {3, 3, 5}, seed + 50);
            compare_with_oracle(c, name + ", soup through the light " + std::to_string(seed));
        }
}

// Shells that show both sides, ends of surfaces, more than two triangles at an edge.
TEST(SoftShadowSilhouettes, OpenSurfaces)
{
    for (const auto& [name, light] : lights) {
        compare_with_oracle(case_of(light, {shell({0, 0, 5}, 2, {1, 0.3, 0.1}, 4, 8)}), name + ", a bowl from beside");
        compare_with_oracle(case_of(light, {shell({0.2, 0, 5}, 2, {0.1, 0.3, -1}, 7, 8)}), name + ", a ball with a hole");
        for (int turned = 0; turned < 8; ++turned) {
            TriangleMesh fan = mesh_of({{0, -2, 4}, {0, 2, 5}, {2, 0, 4.5}, {-2, 0, 4.5}, {1, 1, 6}}, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}});
            for (std::size_t t = 0; t < 3; ++t)
                if ((turned >> t & 1) != 0) std::swap(fan.triangles[t][0], fan.triangles[t][1]);
            compare_with_oracle(case_of(light, {fan}), name + ", a fan wound as " + std::to_string(turned));
        }
    }
}

// Receivers exactly in the planes of faces and edges, which also go through the light's corners, sides and middle: whatever the tie, what is hidden is one of its
// two sides' and nothing leaks across the light.
TEST(SoftShadowSilhouettes, ReceiversInThePlanesOfFaces)
{
    // Receivers at multiples of 1/4.
    const Camera grid{.frame = {.origin = {0.125, 0.125, 0}}, .orthographic = true, .half_extent = {2, 2}};
    for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0})
        for (const Light& light : {Light(rectangle_light(0.5, 0.5)), Light(rectangle_light(1, 0.25))}) {
            WedgeCase c = case_of(light, {closed_box({x, -1, 3}, {x + 1, 1, 5}), sheet({Vec3(x, -2, 2), Vec3(x, 2, 2), Vec3(x, 2, 6), Vec3(x, -2, 6)})});
            c.receivers = flat(16, 16, 8);
            c.camera = grid;
            const std::string what = "planes at " + std::to_string(x);
            const WedgeRun r = run(device_context(), c);
            const auto triangles = triangles_of(c);
            const LightFrame frame = light_frame(light);
            int exact = 0;
            for (std::size_t i = 0; i < r.points.size(); ++i) {
                const auto& at = r.points[i];
                const Vec3 p(at.xi / at.d, at.eta / at.d, 1 / at.d);
                double least = 1, most = 0;
                for (const double aside : {-1e-4, 0.0, 1e-4})
                    for (const double along : {-1e-4, 1e-4}) {
                        const auto near = oracle::silhouettes::range(triangles, p + Vec3(aside, along, 0), {frame.half_u, frame.half_v});
                        least = std::min(least, near.least);
                        most = std::max(most, near.most);
                    }
                exact += p.x == x;
                EXPECT_GE(1 - r.visibility[i], least) << what << ", " << p.x << ", " << p.y;
                EXPECT_LE(1 - r.visibility[i], most) << what << ", " << p.x << ", " << p.y;
            }
            EXPECT_GT(exact, 0) << what;
        }
}

// --- What must not change a bit -----------------

WedgeCase mixed_case()
{
    WedgeCase c{.light = rectangle_light(0.7, 0.3), .casters = soup(30, {-5, -5, 2}, {5, 5, 8}, 5), .settings = per_receiver, .receivers = random_map(61, 47, 4, 9, 0.1, 3)};
    for (int i = 0; i < 12; ++i) c.casters.push_back(shell({2.5 * std::cos(i), 2.5 * std::sin(i), 3 + 0.2 * i}, 0.6, {std::sin(3 * i), std::cos(3 * i), 0.2}, i % 2 == 0 ? 4 : 8, 8));
    c.casters.push_back(closed_box({-1, -1, 3}, {1, 0.5, 3.5}));
    return c;
}

void expect_some_of_each(const std::vector<float>& mask)
{
    EXPECT_GT(std::ranges::count(mask, 0.0F), 50);
    EXPECT_GT(std::ranges::count(mask, 1.0F), 50);
    EXPECT_GT(std::ranges::count_if(mask, [](float v) { return v > 0 && v < 1; }), 200);
}

TEST(SoftShadowSilhouettes, CullingNeverChangesABit)
{
    for (const bool oblique : {false, true}) {
        WedgeCase c = mixed_case();
        if (oblique) c.camera = oblique_camera();
        const WedgeRun some = run(device_context(), c);
        c.settings.culling = WedgeCulling::none;
        const WedgeRun all = run(device_context(), c);
        EXPECT_EQ(some.visibility, all.visibility);
        EXPECT_LT(some.counts.pairs, all.counts.pairs / 2);
        if (!oblique) expect_some_of_each(all.visibility);
    }
}

TEST(SoftShadowSilhouettes, LanesGiveTheSameBits)
{
    const auto context = device_context(true);
    std::vector<std::vector<float>> masks;
    for (const int lanes : {1, 8, 16}) {
        context->quirks().lanes = lanes;
        masks.push_back(run(context, mixed_case()).visibility);
    }
    expect_some_of_each(masks[0]);
    EXPECT_EQ(masks[0], masks[2]);
    EXPECT_EQ(masks[1], masks[2]);
}

// More edges than a tile chooses at once.
TEST(SoftShadowSilhouettes, MoreEdgesThanFitGiveTheSameBits)
{
    const auto context = device_context(true);
    WedgeCase c = mixed_case();
    for (const TriangleMesh& mesh : soup(700, {-3, -3, 2}, {3, 3, 6}, 8)) {
        c.casters.push_back(mesh);
        for (Imath::V3f& p : c.casters.back().positions) p = c.casters.back().positions[0] + (p - c.casters.back().positions[0]) * 0.05F;
    }
    c.settings.culling = WedgeCulling::none; // every tile chooses 2,100 edges and more, in three turns
    const std::vector<float> turns = run(context, c).visibility;
    c.settings.culling = WedgeCulling::tight;
    EXPECT_EQ(run(context, c).visibility, turns);
    expect_some_of_each(turns);
}

TEST(SoftShadowSilhouettes, ThreadsAndRunsGiveTheSameBits)
{
    const WedgeCase c = mixed_case();
    const std::vector<float> first = run(device_context(), c).visibility;
    for (const char* const threads : {"1", "2", "64"}) {
        setenv("PENUMBRA_THREADS", threads, 1);
        EXPECT_EQ(run(device_context(), c).visibility, first) << threads;
    }
    unsetenv("PENUMBRA_THREADS");
}

// A further caster hides more of the samples, never less; the casters' order and winding do not matter.
TEST(SoftShadowSilhouettes, AUnionOfItsCasters)
{
    WedgeCase c = mixed_case();
    const std::vector<float> all = run(device_context(), c).visibility;
    std::ranges::reverse(c.casters);
    EXPECT_EQ(run(device_context(), c).visibility, all);
    c.casters.resize(c.casters.size() - 8);
    const std::vector<float> fewer = run(device_context(), c).visibility;
    int darker = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        EXPECT_GE(fewer[i], all[i]) << i;
        darker += fewer[i] > all[i];
    }
    EXPECT_GT(darker, 10);
}

TEST(SoftShadowSilhouettes, WhatDoesNotGoTogetherIsRefused)
{
    const auto message_of = [](const Light& light, const SoftShadowVolume& settings) -> std::string {
        WedgeCase c = case_of(light, {sheet(-1, 1, -1, 1, 4)});
        c.settings = settings;
        try {
            run(device_context(), c);
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_NE(message_of(sphere_light(1), per_receiver).find("silhouettes"), std::string::npos);
    const Light square = rectangle_light(1, 1);
    EXPECT_EQ(message_of(square, per_receiver), "");
    EXPECT_EQ(message_of(point_light(), per_receiver), "");
    for (const auto& [key, settings] : std::vector<std::pair<std::string, SoftShadowVolume>>{
             {"coverage", {.silhouettes = Silhouettes::per_receiver, .coverage = Coverage::linear}},
             {"overlap", {.silhouettes = Silhouettes::per_receiver, .overlap = Overlap::max}},
             {"light_splits", {.silhouettes = Silhouettes::per_receiver, .light_splits = 2}},
             {"buffer", {.silhouettes = Silhouettes::per_receiver, .buffer = WedgeBuffer::int16}}})
        EXPECT_NE(message_of(square, settings).find(key), std::string::npos) << key;
}

} // namespace
} // namespace penumbra::test
