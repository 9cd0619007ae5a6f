// occlusion_texture on the device against its oracle: what slices hold, and what a mask makes of them.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "technique/occlusion_texture_run.hpp"

namespace penumbra::test {
namespace {

namespace slices = oracle::slices;

const std::shared_ptr<opencl::Context>& context()
{
    static const auto shared = device_context();
    return shared;
}

// --- What slices hold -----------------------

std::vector<slices::Triangle> triangles_of(const SliceCase& c, const SliceRun& r)
{
    LightFrame frame = light_frame(c.light);
    frame.origin = r.view.frame.origin;
    const SliceCasters casters = slice_casters(frame, pointers_to(c.casters));
    std::vector<slices::Triangle> triangles;
    for (std::size_t t = 0; t < casters.triangles.size(); t += 3) {
        slices::Triangle one{};
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t axis = 0; axis < 3; ++axis)
                one.corner[i][axis] = casters.vertices[3 * static_cast<std::size_t>(casters.triangles[t + i]) + axis];
        triangles.push_back(one);
    }
    return triangles;
}

struct Marked {
    int surely = 0, maybe = 0;
};

// Every bit that lies surely inside or surely outside. Gives how many were sure to be set, and how many might have been either.
Marked expect_marks(const SliceCase& c, const std::string& what)
{
    const slices::Scene scene = oracle_scene(context(), c);
    const auto triangles = triangles_of(c, run(context(), c));
    Marked count;
    int wrong = 0;
    for (int y = 0; y < scene.view.height; ++y)
        for (int x = 0; x < scene.view.width; ++x) {
            slices::Marks marks;
            for (const slices::Triangle& t : triangles) slices::mark(marks, scene.view, scene.depths, t, x, y);
            const std::uint64_t bits = scene.bits[static_cast<std::size_t>(y * scene.view.width + x)];
            count.surely += std::popcount(marks.surely);
            count.maybe += std::popcount(marks.maybe & ~marks.surely);
            const bool right = (marks.surely & ~bits) == 0 && (bits & ~marks.maybe) == 0;
            wrong += !right;
            if (!right && wrong < 4)
                ADD_FAILURE() << what << ": texel " << x << ", " << y << std::hex << " holds " << bits << ", surely " << marks.surely
                              << ", at most " << marks.maybe;
        }
    EXPECT_EQ(wrong, 0) << what;
    return count;
}

TEST(Slices, HoldWhatLinesMeet)
{
    for (const int resolution : {4, 31, 64, 200})
        for (const int count : {1, 16, 33, 64}) {
            const SliceCase c{
                .casters = {triangles_in(40, {-2, -2, 3}, {2, 2, 6}, 1.5, 1), triangles_in(200, {-2, -2, 3}, {2, 2, 6}, 0.1, 2)},
                .settings = {.slices = count, .resolution = resolution}};
            const Marked marked = expect_marks(c, std::to_string(resolution) + " texels, " + std::to_string(count) + " slices");
            EXPECT_GT(marked.surely, resolution * resolution / 8);
            EXPECT_LT(marked.maybe, marked.surely / 50 + 8);
        }
}

TEST(Slices, HoldWhatLinesMeetUnderEveryPlacementAndLight)
{
    for (const Placement placement : {Placement::uniform, Placement::reciprocal, Placement::occupied})
        for (const Light& light :
             {Light(rectangle_light(1, 1)), Light(rectangle_light(0, 0)), Light(rectangle_light(20, 0.1)), Light(point_light())})
            EXPECT_GT(expect_marks({.light = light,
                                    .casters = {triangles_in(60, {-2, -2, 3}, {2, 2, 6}, 1, 3)},
                                    .settings = {.slices = 12, .placement = placement, .resolution = 64}},
                                   "placement")
                          .surely,
                      50);
    for (const double degrees : {0.0, 0.53, 20.0}) {
        const DirectionalLight sun{.direction = {0, 0, -1}, .angular_diameter_deg = degrees, .up = Vec3(0, 1, 0)};
        EXPECT_GT(expect_marks({.light = sun, .casters = {triangles_in(60, {-2, -2, -6}, {2, 2, 6}, 1, 4)}, .settings = {.resolution = 64}},
                               "sun")
                      .surely,
                  50);
    }
}

// Reaching nearer than the slices do, through the light's plane, behind it, and behind the centre of projection: what lies within the range
// casts as ever.
TEST(Slices, TrianglesThroughTheLightsPlane)
{
    const TriangleMesh through = mesh_of({{-1, -1, -30}, {1.5, -0.5, 8}, {-0.5, 1.5, 8}}, {{0, 1, 2}});
    const TriangleMesh behind = triangles_in(20, {-2, -2, -9}, {2, 2, -1}, 1, 5), before = triangles_in(20, {-2, -2, 4}, {2, 2, 8}, 1, 6);
    for (const double half : {1e-9, 0.2, 3.0}) {
        const SliceCase c{
            .light = rectangle_light(half, half), .casters = {through, behind, before}, .settings = {.slices = 20, .resolution = 64}};
        EXPECT_GT(expect_marks(c, "light of " + std::to_string(half)).surely, 20);
        const SliceRun r = run(context(), c);
        ASSERT_FALSE(r.warnings.empty());
        EXPECT_TRUE(holds(r.warnings[0], "21 triangles reach nearer to the light's plane")) << r.warnings[0];
    }
    // All behind: a warning, and everything is lit.
    const SliceRun none = run(context(), {.casters = {behind}, .receivers = flat(3, 2, 5)});
    EXPECT_EQ(none.visibility, std::vector<float>(6, 1.0f));
    ASSERT_EQ(none.warnings.size(), 1u);
    EXPECT_TRUE(holds(none.warnings[0], "nothing that casts lies before the light")) << none.warnings[0];
}

TEST(Slices, DegenerateTrianglesMarkNothing)
{
    // A sheet for the window, and triangles without area before it: a segment, a point, a segment with a corner twice.
    const TriangleMesh thin = mesh_of({{-0.25, -0.25, 4}, {0.25, 0.25, 4}, {0, 0, 4}, {0.125, 0, 4}}, {{0, 1, 2}, {3, 3, 3}, {0, 0, 1}});
    const SliceCase c{.casters = {sheet(-1, 1, -1, 1, 5), thin}, .settings = {.slices = 8, .resolution = 32}};
    expect_marks(c, "thin");
    const slices::Bits bits = oracle_scene(context(), c).bits;
    EXPECT_EQ(std::count(bits.begin(), bits.end(), std::uint64_t{1} << 7), 32 * 32);
}

// No gap between neighbours: every texel inside a turned sheet is marked, however finely it is cut. From one triangle a hundred texels
// across to hundreds a texel.
TEST(Slices, NoGapsBetweenNeighbours)
{
    for (const Light& light : {Light(rectangle_light(0.5, 0.5)),
                               Light(DirectionalLight{.direction = {0, 0, -1}, .angular_diameter_deg = 1, .up = Vec3(0, 1, 0)})})
        for (const Vec3& corner : {Vec3(0.1, -1.3, 4), Vec3(30, -41, 50)})
            for (const double turn : {0.0, 0.3, 1.0}) {
                const Vec3 a = Vec3(std::cos(turn), std::sin(turn), 0.1) * 2.0, b = Vec3(-std::sin(turn), std::cos(turn), 0) * 2.0;
                std::vector<slices::Bits> all;
                std::vector<int> inside;
                // The four corners alone give the window; finer grids may move it by a rounding, so the coarse sheet comes along in each
                // case behind them.
                for (const int n : {1, 3, 64, 400}) {
                    const SliceCase c{.light = light, .casters = {grid(corner, a, b, n)}, .settings = {.slices = 1, .resolution = 128}};
                    const slices::Scene scene = oracle_scene(context(), c);
                    SliceCase coarse = c;
                    coarse.casters = {grid(corner, a, b, 1)};
                    const auto outline = triangles_of(coarse, run(context(), c));
                    int gaps = 0, sure = 0;
                    for (int y = 0; y < 128; ++y)
                        for (int x = 0; x < 128; ++x) {
                            // Inside the outline by the rounding of the grid's points, too: 2^-24 of their coordinates, which the oracle's
                            // slack holds many times.
                            slices::Marks marks;
                            for (const slices::Triangle& t : outline) slices::mark(marks, scene.view, scene.depths, t, x, y);
                            sure += marks.surely != 0;
                            gaps += marks.surely != 0 && scene.bits[static_cast<std::size_t>(y * 128 + x)] == 0;
                        }
                    EXPECT_EQ(gaps, 0) << "turned by " << turn << ", " << n << " x " << n << ", at " << corner;
                    EXPECT_GT(sure, 128 * 128 / 3);
                }
            }
}

// One triangle over the whole window (done by many work-items) and the same cut into small ones.
TEST(Slices, LargeTrianglesHoldWhatSmallOnesDo)
{
    const Vec3 corner(-2, -2, 4), a(4, 0, 0), b(0, 4, 0.5);
    const auto bits = [&](int n) {
        return oracle_scene(context(), {.casters = {grid(corner, a, b, n)}, .settings = {.slices = 4, .resolution = 128}}).bits;
    };
    // Corners at sixteenths are exact, so that all grids are the same plane and every texel lies in the same slice but where a plane
    // between slices runs.
    const slices::Bits large = bits(1), small = bits(16);
    int differing = 0;
    for (std::size_t i = 0; i < large.size(); ++i) differing += large[i] != small[i];
    EXPECT_LE(differing, 3); // texels whose line meets the sheet within rounding of a plane between slices
}

// --- Masks ------------------------------------

std::vector<TriangleMesh> clutter() { return {triangles_in(30, {-2, -2, 3}, {2, 2, 6}, 1, 7), sheet(-1, 0.5, -1, 1, 4.5)}; }

Camera wide_camera(double tangent) { return light_camera(light_frame(point_light()), {tangent, tangent}, {0, 0, 0}); }

// Compares every receiver with the oracle. Gives how many are in penumbra.
int expect_mask(const SliceCase& c, const std::string& what)
{
    const SliceRun r = run(context(), c);
    const std::size_t parts = r.parts.size();
    std::vector<slices::Scene> scenes;
    std::vector<std::vector<std::vector<slices::Texture>>> textures;
    for (std::size_t part = 0; part < parts; ++part) {
        scenes.push_back(oracle_scene(context(), c, part));
        textures.push_back(slices::textures_of(scenes.back()));
    }
    int penumbra = 0, wrong = 0;
    double worst = 0, widest = 0;
    for (std::size_t i = 0; i < r.points.size(); ++i) {
        const oracle::Receiver& p = r.points[i];
        if (p.d == static_cast<double>(NO_RECEIVER)) {
            EXPECT_EQ(r.visibility[i], 1.0f) << what;
            continue;
        }
        const double z = 1 / p.d, away = r.view.orthographic ? 1 : z;
        slices::Value expected{0, 0};
        for (std::size_t part = 0; part < parts; ++part) {
            const slices::Value one = slices::visibility(scenes[part], textures[part], p.xi * away, p.eta * away, z);
            expected.value += one.value / static_cast<double>(parts);
            expected.bound += one.bound / static_cast<double>(parts);
        }
        const double off = std::abs(static_cast<double>(r.visibility[i]) - expected.value);
        penumbra += expected.value > 0.001 && expected.value < 0.999;
        worst = std::max(worst, off / expected.bound);
        widest = std::max(widest, expected.bound);
        wrong += !(off <= expected.bound);
        if (!(off <= expected.bound) && wrong < 3)
            ADD_FAILURE() << what << ": receiver " << i << " at depth " << z << " sees " << r.visibility[i] << ", expected "
                          << expected.value << " within " << expected.bound;
    }
    EXPECT_EQ(wrong, 0) << what;
    EXPECT_LT(widest, 3e-3) << what; // else the bound says nothing
    return penumbra;
}

SliceCase masked(const OcclusionTexture& settings)
{
    return {.casters = clutter(), .settings = settings, .receivers = random_map(15, 15, 3.5, 12, 0.1, 8), .camera = wide_camera(0.7)};
}

TEST(SliceMask, EveryWayToCombine)
{
    for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::summed_area})
    for (const Combine combine : {Combine::product, Combine::sum, Combine::max, Combine::layered, Combine::layered_max})
        for (const int layers : {1, 3, 8}) {
            if (layers != 3 && combine != Combine::layered) continue;
            EXPECT_GT(expect_mask(masked({.slices = 8, .resolution = 32, .prefilter = prefilter, .combine = combine, .layers = layers}),
                                  "combine " + std::to_string(static_cast<int>(combine))),
                      40);
        }
}

TEST(SliceMask, EveryPrefilterAndStorage)
{
    for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap, Prefilter::summed_area})
        for (const LevelStorage storage : {LevelStorage::binary32, LevelStorage::normalized16})
            for (const int resolution : {4, 31, 64})
                EXPECT_GT(expect_mask(masked({.slices = 8, .resolution = resolution, .prefilter = prefilter, .storage = storage}),
                                      "prefilter " + std::to_string(static_cast<int>(prefilter)) + ", " + std::to_string(resolution)),
                          20);
}

TEST(SliceMask, EverySelfShadowAndPlacementAndLeakFix)
{
    for (const SelfShadow self : {SelfShadow::automatic, SelfShadow::fade, SelfShadow::own, SelfShadow::omit})
        for (const Placement placement : {Placement::uniform, Placement::reciprocal, Placement::occupied})
            for (const bool leak_fix : {false, true})
                EXPECT_GT(
                    expect_mask(masked({.slices = 6, .placement = placement, .resolution = 32, .combine = Combine::product, .leak_fix = leak_fix, .self_shadow = self}),
                                "self shadow " + std::to_string(static_cast<int>(self))),
                    40);
}

// From a point to a light as large as the scene, square and long, split and whole.
TEST(SliceMask, LightsOfEverySize)
{
    for (const auto& [u, v] :
         {std::pair{0.0, 0.0}, {0.01, 0.01}, {0.3, 0.1}, {4.0, 4.0}, {3.0, 0.05}, {0.05, 3.0}, {1.0, 0.0}, {40.0, 40.0}})
        for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::summed_area}) {
            SliceCase c = masked({.slices = 5, .resolution = 32, .prefilter = prefilter});
            c.light = rectangle_light(u, v);
            expect_mask(c, std::to_string(u) + " x " + std::to_string(v));
        }
    for (const int splits : {2, 3}) EXPECT_GT(expect_mask(masked({.slices = 5, .resolution = 32, .light_splits = splits}), "split"), 40);
}

TEST(SliceMask, DirectionalLights)
{
    for (const double degrees : {0.0, 0.53, 5.0, 20.0})
        for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap, Prefilter::summed_area}) {
            SliceCase c = masked({.slices = 6, .resolution = 32, .prefilter = prefilter});
            c.light = DirectionalLight{.direction = {0, 0, -1}, .angular_diameter_deg = degrees, .up = Vec3(0, 1, 0)};
            const int penumbra =
                expect_mask(c, std::to_string(degrees) + " degrees, prefilter " + std::to_string(static_cast<int>(prefilter)));
            if (degrees > 1) {
                EXPECT_GT(penumbra, 10);
            }
        }
}

// The tests can fail: with one bit fewer the oracle disagrees.
TEST(SliceMask, TheOracleSeesEveryBit)
{
    const SliceCase c = masked({.slices = 4, .resolution = 16, .prefilter = Prefilter::summed_area});
    slices::Scene scene = oracle_scene(context(), c);
    const SliceRun r = run(context(), c);
    const auto differing = [&] {
        const auto textures = slices::textures_of(scene);
        int count = 0;
        for (std::size_t i = 0; i < r.points.size(); ++i) {
            const oracle::Receiver& p = r.points[i];
            if (p.d == static_cast<double>(NO_RECEIVER)) continue;
            const slices::Value expected = slices::visibility(scene, textures, p.xi / p.d, p.eta / p.d, 1 / p.d);
            count += std::abs(static_cast<double>(r.visibility[i]) - expected.value) > expected.bound;
        }
        return count;
    };
    EXPECT_EQ(differing(), 0);
    // A texel in the middle of the window, in every slice.
    std::uint64_t& texel = scene.bits[8 * 16 + 8];
    texel = ~texel & 0xf;
    EXPECT_GT(differing(), 5);
}

} // namespace
} // namespace penumbra::test
