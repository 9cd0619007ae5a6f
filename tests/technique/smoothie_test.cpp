// Smoothies step by step: against the paper's construction in double precision, between lanes, between canaries.
#include <numbers>

#include <gtest/gtest.h>

#include "oracle/smoothie_oracle.hpp"
#include "support/casters.hpp"
#include "support/device_run.hpp"
#include "support/maps.hpp"
#include "technique/smoothie.hpp"

namespace penumbra::test {
namespace {

using oracle::smoothie::Edge;
using oracle::smoothie::Point;

struct SmoothieCase {
    std::vector<TriangleMesh> casters;
    Smoothie settings;
    double radius = 0; // of a sphere; t_from light
    int size = 96;     // of the occluder map
    DepthMap receivers;
    std::optional<Camera> camera = {}; // of the receivers; nothing: the light's view
    std::optional<DepthMap> map = {};  // of the occluders; nothing: what the casters show
};

constexpr double pi = std::numbers::pi;

Camera view() { return light_camera(light_frame(point_light()), {1, 1}, {0, 0, 0}); }

Point tangent_of(const SmoothieCase& c, int x, int y) { return {(2 * x + 1.0) / c.size - 1, 1 - (2 * y + 1.0) / c.size}; }

Edge seen(const Vec3& a, const Vec3& b) { return {{a.x / -a.z, a.y / -a.z}, {b.x / -b.z, b.y / -b.z}, 1 / -a.z, 1 / -b.z}; }

// The greatest disparity of the casters' triangles at a place of the light's image: 0 where there is none.
double shown(const std::vector<TriangleMesh>& casters, const Point& p)
{
    using oracle::smoothie::cross;
    double greatest = 0;
    for (const TriangleMesh& mesh : casters)
        for (const auto& t : mesh.triangles) {
            const auto corner = [&](std::size_t k) { return Vec3(mesh.positions[t[k]]); };
            const Edge ab = seen(corner(0), corner(1)), ac = seen(corner(0), corner(2));
            const Point u = ab.b - ab.a, v = ac.b - ac.a, w = p - ab.a;
            const double area = cross(u, v), beta = cross(w, v) / area, gamma = cross(u, w) / area;
            if (beta >= 0 && gamma >= 0 && beta + gamma <= 1)
                greatest = std::max(greatest, ab.d_a + beta * (ab.d_b - ab.d_a) + gamma * (ac.d_b - ab.d_a));
        }
    return greatest;
}

DepthMap front_of(const SmoothieCase& c)
{
    if (c.map) return *c.map;
    return map_of(c.size, c.size, [&](int x, int y) {
        const double d = shown(c.casters, tangent_of(c, x, y));
        return d > 0 ? static_cast<float>(1 / d) : nothing_there;
    });
}

struct Silhouetted {
    Topology topology;
    Silhouette silhouette;
};

Silhouetted silhouetted(const std::vector<TriangleMesh>& casters)
{
    std::vector<const TriangleMesh*> meshes;
    for (const TriangleMesh& mesh : casters) meshes.push_back(&mesh);
    Topology topology(meshes);
    Silhouette silhouette = silhouette_of(topology, {0, 0, 0});
    return {std::move(topology), std::move(silhouette)};
}

std::vector<float> run(const std::shared_ptr<opencl::Context>& context, const SmoothieCase& c)
{
    opencl::Work work(context);
    const auto [topology, silhouette] = silhouetted(c.casters);
    const DepthMap front = front_of(c);
    const auto front_buffer = work.upload(std::span<const float>(front.depth), "front");
    const auto depth_buffer = work.upload(std::span<const float>(c.receivers.depth), "receivers");
    const OccluderDepth depth{.light = light_frame(sphere_light(c.radius)),
                              .camera = view(),
                              .width = front.width,
                              .height = front.height,
                              .precision = front.precision,
                              .front = front_buffer.memory(),
                              .back = {},
                                .layers = {}};
    const PreparedSmoothie prepared = prepare_smoothie(work, depth, smoothie_edges(topology, silhouette, view()), c.settings);
    const ReceiverPoints points =
        receiver_points(work, receiver_view(c.camera.value_or(view()), c.receivers.width, c.receivers.height, view()),
                        depth_buffer.memory(), c.receivers.precision, prepared.program);
    const auto visibility = work.buffer<float>(c.receivers.depth.size(), "visibility");
    shade_smoothie(work, prepared, points, visibility.memory());
    const std::vector<float> result = work.read(visibility);
    work.finish();
    return result;
}

const std::shared_ptr<opencl::Context>& guarded()
{
    static const auto context = device_context(true);
    return context;
}

// Receivers at the texels' middles, one-sided, linear. Coordinates are below 2, a distance takes some 16 roundings, a width 8 of what is
// `lost` times as large as it; what the four texels blend differs by 1 at the most and their shares by 4 roundings of `size` texels.
struct Compared {
    int hidden = 0, penumbra = 0;
    double darker = 0; // than the paper's construction, at the most; lighter is a failure
};
Compared compare_with_oracle(const SmoothieCase& c, const std::string& name)
{
    const auto [topology, silhouette] = silhouetted(c.casters);
    std::vector<Edge> edges;
    for (const SilhouetteEdge& e : silhouette.edges)
        edges.push_back(seen(Vec3(topology.vertices()[e.from]), Vec3(topology.vertices()[e.to])));
    const auto fins = oracle::smoothie::fins_of(edges);
    const oracle::smoothie::Width width{c.settings.t_from == SmoothieWidth::t ? c.settings.t : 0, c.radius};
    const DepthMap map = front_of(c);
    const std::vector<float> mask = run(guarded(), c);
    Compared result;
    for (int y = 0; y < c.size; ++y)
        for (int x = 0; x < c.size; ++x) {
            const std::size_t at = static_cast<std::size_t>(y * c.size + x);
            const double r = 1 / static_cast<double>(c.receivers.depth[at]), blocker = 1 / static_cast<double>(map.depth[at]);
            const Point p = tangent_of(c, x, y);
            const auto least = oracle::smoothie::alpha_of_segments(edges, width, p, r, blocker);
            const auto paper = oracle::smoothie::alpha_at(fins, width, p, r, blocker);
            const double expected = blocker > r ? 0 : least.d > r ? least.alpha : 1;
            const double widest = least.d > r ? width.at(least.d, r) : 1, lost = least.d > r ? least.d / (least.d - r) : 1;
            const double bound = (16 * 2 / widest + 8 * lost + 4 * c.size) * 0x1p-24;
            EXPECT_NEAR(mask[at], expected, bound) << name << ": " << x << ", " << y;
            if (std::abs(mask[at] - expected) > bound) return result;
            result.hidden += blocker > r;
            result.penumbra += expected > 0 && expected < 1;
            if (blocker <= r) {
                EXPECT_LE(expected, paper.alpha + 1e-12) << name << ": " << x << ", " << y;
                result.darker = std::max(result.darker, paper.alpha - expected);
            }
        }
    return result;
}

// A flat polygon around `middle`, a fan, and so convex or at least seen whole from there.
TriangleMesh polygon(const std::vector<Point>& corners, double z, const Point& middle)
{
    std::vector<Vec3> points{{middle.x, middle.y, z}};
    std::vector<std::array<std::uint32_t, 3>> triangles;
    const std::uint32_t n = static_cast<std::uint32_t>(corners.size());
    for (std::uint32_t i = 0; i < n; ++i) {
        points.emplace_back(corners[i].x, corners[i].y, z);
        triangles.push_back({0, i + 1, (i + 1) % n + 1});
    }
    return mesh_of(points, triangles);
}

const Smoothie fixed_width{.t_from = SmoothieWidth::t, .t = 0.5, .falloff = Falloff::linear, .two_sided = false};
const Smoothie by_light{.falloff = Falloff::linear, .two_sided = false};

DepthMap floor_at(float z) { return flat(96, 96, z); }

// --- The paper's construction ---------------------------------------------------------------------------------------------------------

TEST(SmoothieOracle, CornersJoinTheirEdges)
{
    const std::vector<std::pair<std::string, std::vector<TriangleMesh>>> scenes = {
        {"square", {sheet(-1.03, 0.97, -0.81, 1.07, 4)}},
        {"thin triangle", {mesh_of({{-2.1, -0.33, 4}, {1.9, -0.07, 4}, {-1.8, 0.41, 4}}, {{0, 1, 2}})}},
        {"star with notches",
         {polygon({{1.5, 0.1}, {0.3, 0.41}, {0.1, 1.6}, {-0.37, 0.3}, {-1.4, 0.13}, {-0.4, -0.31}, {0.07, -1.7}, {0.33, -0.29}}, 4,
                  {0, 0})}},
        {"tilted", {sheet({Vec3(-1.2, -0.9, 3), Vec3(1.6, -1.1, 6), Vec3(1.7, 1.2, 6.5), Vec3(-1.3, 0.9, 3.5)})}},
        {"box", {closed_box({-1.03, 0.31, 3}, {-0.11, 1.17, 4})}},
    };
    for (const auto& [name, casters] : scenes)
        for (const Smoothie& settings : {fixed_width, by_light}) {
            const Compared seen =
                compare_with_oracle({.casters = casters, .settings = settings, .radius = 1, .receivers = floor_at(8)}, name);
            EXPECT_GT(seen.hidden, 50) << name;
            EXPECT_GT(seen.penumbra, 250) << name;
            // Where silhouettes slant in depth, a nearer end's fin shows beyond its corner.
            if (name != "tilted" && name != "box") {
                EXPECT_LT(seen.darker, 1e-12) << name;
            }
            std::printf("[  MEASURE ] %s: at the most %.4f darker than rectangles and corners\n", name.c_str(), seen.darker);
        }
}

// Alpha has no steps along both joints of a corner: circles around it.
TEST(SmoothieOracle, CornersAreContinuous)
{
    SmoothieCase c{.casters = {sheet(-9, 0, -9, 0, 4)}, .settings = fixed_width, .size = 96, .receivers = floor_at(8)};
    const std::vector<float> mask = run(guarded(), c);
    const double width = 0.25;
    for (int y = 0; y < c.size; ++y)
        for (int x = 0; x < c.size; ++x) {
            const Point p = tangent_of(c, x, y);
            const double distance = p.x < 0 && p.y < 0 ? 0 : std::hypot(std::max(p.x, 0.0), std::max(p.y, 0.0));
            ASSERT_NEAR(mask[static_cast<std::size_t>(y * c.size + x)], std::min(distance / width, 1.0),
                        (16 * 2 / width + 16 + 4 * c.size) * 0x1p-24)
                << x << ", " << y;
        }
}

// Vertices of four silhouette edges: two squares that touch at a corner, and two that also see a wide gap.
TEST(SmoothieOracle, VerticesOfFourEdges)
{
    const auto both = [](const std::vector<Vec3>& points) { return mesh_of(points, {{0, 1, 2}, {0, 3, 4}}); };
    const std::vector<std::pair<std::string, TriangleMesh>> scenes = {
        {"opposite", both({{0.03, 0.05, 4}, {1.1, 0.05, 4}, {0.9, 1.2, 4}, {-1.1, 0.07, 4}, {-0.8, -1.3, 4}})},
        {"beside", both({{0.03, 0.05, 4}, {1.4, -0.2, 4}, {1.3, 0.2, 4}, {1.1, 0.5, 4}, {0.9, 0.9, 4}})},
        {"at a tip", both({{0.03, 0.05, 3}, {1.4, -0.2, 4}, {1.3, 0.2, 5}, {-1.1, 0.5, 4}, {-0.9, 0.9, 6}})}};
    for (const auto& [name, mesh] : scenes)
        for (const Smoothie& settings : {fixed_width, by_light}) {
            const auto [topology, silhouette] = silhouetted({mesh});
            std::map<std::uint32_t, int> degrees;
            for (const SilhouetteEdge& e : silhouette.edges) ++degrees[e.from], ++degrees[e.to];
            EXPECT_TRUE(std::any_of(degrees.begin(), degrees.end(), [](const auto& d) { return d.second == 4; })) << name;
            EXPECT_GT(compare_with_oracle({.casters = {mesh}, .settings = settings, .radius = 1, .receivers = floor_at(8)}, name).penumbra,
                      300);
        }
}

// Two fins in one texel: the lesser alpha, and its own fin's depth. A receiver between both depths tells which.
TEST(SmoothieOracle, MinimumBlendingKeepsTheDepthOfWhatItKeeps)
{
    const std::vector<TriangleMesh> casters = {sheet(-3, -0.21, -3, 3, 3), sheet(1.05, 5, -5, 5, 5)};
    for (const Smoothie& settings : {fixed_width, by_light})
        for (const float z : {4.0f, 4.9f, 5.5f, 8.0f})
            EXPECT_GT(
                compare_with_oracle({.casters = casters, .settings = settings, .radius = 1, .receivers = floor_at(z)}, std::to_string(z))
                    .penumbra,
                50)
                << z;
}

// Fins point away from their blocker: a surface that steps back steeply from its edge is not shaded by that edge.
TEST(SmoothieOracle, NothingInwards)
{
    // A roof: its ridge, nearest to the light, is a silhouette, since the other side faces away.
    const TriangleMesh roof = mesh_of({{0.02, -1.5, 3}, {0.02, 1.5, 3}, {-0.6, 1.5, 9}, {-0.6, -1.5, 9}}, {{0, 1, 2}, {0, 2, 3}});
    SmoothieCase c{.casters = {roof}, .settings = fixed_width, .receivers = {}};
    c.settings.t = 1;
    c.settings.bias = 0;
    // The roof itself receives, a thousandth above itself; around it a floor.
    c.receivers = map_of(c.size, c.size, [&](int x, int y) {
        const double d = shown(c.casters, tangent_of(c, x, y));
        return static_cast<float>(d > 0 ? 0.999 / d : 10);
    });
    EXPECT_GT(compare_with_oracle(c, "roof").penumbra, 300);
    c.radius = 4;
    c.settings = by_light;
    c.settings.bias = 0;
    EXPECT_GT(compare_with_oracle(c, "roof, by the light").penumbra, 300);
}

// --- The machine ----------------------------------------------------------------------------------------------------------------------

std::vector<TriangleMesh> many()
{
    std::vector<TriangleMesh> casters;
    for (int i = 0; i < 23; ++i) {
        const double x = -3 + 0.27 * i, y = 2.5 * std::sin(2.0 * i), z = 3 + 0.1 * (i % 7);
        casters.push_back(closed_box({x, y, z}, {x + 0.31, y + 0.47, z + 0.6}));
    }
    return casters;
}

TEST(SmoothieLanes, GiveTheSameBits)
{
    const auto context = device_context(true);
    for (const bool two_sided : {false, true})
        for (const Smoothie& base : {fixed_width, by_light}) {
            SmoothieCase c{.casters = many(), .settings = base, .radius = 1, .size = 93, .receivers = random_map(61, 47, 5, 9, 0.1, 9)};
            c.settings.two_sided = two_sided;
            std::vector<std::vector<float>> masks;
            for (const int lanes : {1, 8, 16}) {
                context->quirks().lanes = lanes;
                masks.push_back(run(context, c));
            }
            EXPECT_EQ(masks[0], masks[1]) << two_sided;
            EXPECT_EQ(masks[0], masks[2]) << two_sided;
            EXPECT_GT(std::count_if(masks[0].begin(), masks[0].end(), [](float v) { return v > 0 && v < 1; }), 200);
            EXPECT_LT(*std::min_element(masks[0].begin(), masks[0].end()),
                      two_sided ? 0.5f : 0x1p-20f); // such small boxes leave no umbra then
        }
}

TEST(SmoothieCanary, AwkwardSizes)
{
    struct Size {
        int width, height;
    };
    constexpr Size sizes[] = {{1, 1}, {1, 61}, {61, 1}, {7, 93}, {93, 7}, {128, 129}};
    for (const Size occluders : sizes)
        for (const Size r : {sizes[0], sizes[3], sizes[4]})
            for (const bool two_sided : {false, true}) {
                SmoothieCase c{.casters = many(),
                               .settings = fixed_width,
                               .receivers = random_map(r.width, r.height, 3, 9, 0.1, 3),
                               .map = random_map(occluders.width, occluders.height, 1, 4, 0.3, 1)};
                c.settings.two_sided = two_sided;
                std::vector<float> mask;
                ASSERT_NO_THROW(mask = run(guarded(), c)) << occluders.width << " x " << occluders.height;
                for (const float v : mask) ASSERT_TRUE(v >= 0 && v <= 1) << v;
            }
}

TEST(SmoothieCanary, NoEdgesAndManyGroups)
{
    for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{23}}) {
        std::vector<TriangleMesh> casters = many();
        casters.resize(count);
        const SmoothieCase c{.casters = casters, .settings = by_light, .radius = 1, .size = 33, .receivers = flat(33, 33, 8)};
        std::vector<float> mask;
        ASSERT_NO_THROW(mask = run(guarded(), c)) << count;
        EXPECT_EQ(std::any_of(mask.begin(), mask.end(), [](float v) { return v < 1; }), count > 0);
    }
}

// Edges are cut where they come near the light's plane; what lies behind it casts nothing.
TEST(SmoothieEdges, AcrossTheLightsPlane)
{
    const auto edges_of = [](const TriangleMesh& mesh) {
        const auto [topology, silhouette] = silhouetted({mesh});
        return smoothie_edges(topology, silhouette, view());
    };
    EXPECT_EQ(edges_of(sheet(-1, 1, -1, 1, 4)).count, 4u);
    EXPECT_EQ(edges_of(sheet(-1, 1, -1, 1, -4)).count, 0u);
    EXPECT_EQ(edges_of(closed_box({2, -1, -3}, {3, 1, 4})).count > 0, true);
    const SmoothieEdges crossing = edges_of(sheet({Vec3(2, -1, -3), Vec3(2, -1, 4), Vec3(2, 1, 4), Vec3(2, 1, -3)}));
    EXPECT_EQ(crossing.count, 3u); // the one behind is gone
    for (std::size_t i = 0; i < crossing.count; ++i)
        for (std::size_t k = 4; k < 6; ++k) {
            const float d = crossing.edges[i * 8 + k];
            EXPECT_TRUE(d >= 0.25f * (1 - 0x1p-20f) && d <= 256 * (1 + 0x1p-20f)) << d; // depths from 4 to 4 / 2^10
        }
}

} // namespace
} // namespace penumbra::test
