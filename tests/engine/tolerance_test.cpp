// Masks of fewer receivers and coarser patches: within their tolerance of the whole, the same bits again, and nothing that others have to know of.
#include <cstdlib>
#include <random>

#include <penumbra/metrics.hpp>

#include "support/child.hpp"
#include "support/maps.hpp"

#include "technique/table.hpp"
#include "technique/techniques.hpp"

namespace penumbra::test {
namespace {

TriangleMesh quad(const Vec3& center, const Vec3& half_u, const Vec3& half_v)
{
    TriangleMesh mesh;
    for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) mesh.positions.emplace_back(center + half_u * static_cast<double>(a) + half_v * static_cast<double>(b));
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

// Some plates, turned and sized anyhow, between a light and a tilted floor.
Scene plates(unsigned seed, int pixels)
{
    std::mt19937 random(seed);
    const auto from = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    Scene scene;
    const double half = std::pow(10, from(-2, 0.3));
    scene.light = RectangleLight{.center = {from(-0.5, 0.5), 6, from(-0.5, 0.5)}, .half_u = {half, 0, 0}, .half_v = {0, 0, -half * from(0.3, 1)}, .emission = {}};
    const int count = static_cast<int>(from(1, 6));
    for (int i = 0; i < count; ++i) {
        const Vec3 u = Vec3(from(-1, 1), from(-1, 1), from(-1, 1)).normalized(), v = u.cross(Vec3(from(-1, 1), from(-1, 1), from(-1, 1))).normalized();
        scene.objects.push_back({.name = "plate " + std::to_string(i), .mesh = quad({from(-1, 1), from(0.8, 4), from(-1, 1)}, u * from(0.05, 0.7), v * from(0.05, 0.7)), .casts = true, .receives = false});
    }
    scene.objects.push_back({.name = "floor", .mesh = quad({0, 0, 0}, Vec3(3, from(-0.4, 0.4), 0), Vec3(0, from(-0.4, 0.4), -3)), .casts = false, .receives = true});
    scene.occluders.width = scene.occluders.height = 96;
    scene.receivers = {.camera = PinholeCamera{.frame = {.origin = {0, 9, 0}, .x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}}, .tan_half_fov = {0.3, 0.3}}, .width = pixels, .height = pixels, .depth = {}};
    return scene;
}

Mask mask_of(const Engine& engine, const Scene& scene, TechniqueRequest request, double tolerance)
{
    request.settings.emplace_back("tolerance", tolerance);
    return engine.mask(scene, technique_from(request));
}

// PENUMBRA_TOLERANCE_SCENES of them (./check --long: 10,000); without, a few.
int scene_count()
{
    const char* text = std::getenv("PENUMBRA_TOLERANCE_SCENES");
    return text ? std::max(1, std::atoi(text)) : 24;
}

// What the light's 32 x 32 samples are off by themselves, for a straight edge of the worst direction (kernels/common/light_pattern.clh): the whole mask has that,
// and what lies between computed pixels has it not.
constexpr double of_samples = 8.0 / 1024;

// No pixel is off by more, and on average pixels are off by far less.
TEST(Tolerance, IsKeptOnRandomScenes)
{
    const Engine engine;
    double worst = 0, worst_mean = 0; // difference over tolerance
    for (int seed = 1; seed <= scene_count(); ++seed) {
        const Scene scene = plates(static_cast<unsigned>(seed), 200);
        const Mask whole = mask_of(engine, scene, {.kind = "soft_shadow_map", .settings = {}}, 0);
        EXPECT_EQ(whole.report.receivers, 0u);
        for (const double tolerance : {0.1, 0.03, 0.01}) {
            const Mask some = mask_of(engine, scene, {.kind = "soft_shadow_map", .settings = {}}, tolerance);
            const Metrics off = compare(some.visibility, whole.visibility);
            EXPECT_LE(off.mae_shadow, 0.25 * tolerance) << seed;
            EXPECT_LE(off.max, tolerance + of_samples) << seed;
            worst = std::max(worst, off.max / (tolerance + of_samples));
            worst_mean = std::max(worst_mean, off.mae_shadow / tolerance);
            EXPECT_EQ(some.report.receivers, 200u * 200) << seed;
            EXPECT_LE(some.report.receivers_shaded, some.report.receivers) << seed;
        }
    }
    std::printf("[  MEASURE ] the largest difference is %.2f times the tolerance and what samples are off, the largest mean over shadow pixels %.2f times the tolerance\n", worst, worst_mean);
}

// Whether the technique goes by a tolerance: some have penumbrae of their own.
bool computes_some(std::string_view kind) { return needs_of(technique_from({.kind = std::string(kind), .settings = {{"tolerance", 0.03}}})).tolerance > 0; }

// The other techniques', from a view that is rendered for it. Wedges have steps of their own, where sheets of triangles overlap, that no penumbra tells: 3 of
// 6,000 masks of 1,500 scenes are beyond (.26 off at .1); twice as many are allowed, of the usual 24 scenes none. Rays are compared in RaysAreThoseOfTheWholeMask: they have noise.
TEST(Tolerance, IsKeptByOtherTechniques)
{
    const Engine engine;
    double worst = 0;
    int masks = 0, beyond = 0;
    for (const char* kind : {"soft_shadow_volume", "occlusion_texture"})
        for (int seed = 1; seed <= scene_count(); ++seed) {
            const Scene scene = plates(static_cast<unsigned>(seed), 200);
            const Mask whole = mask_of(engine, scene, {.kind = kind, .settings = {}}, 0);
            for (const double tolerance : {0.1, 0.03}) {
                const Metrics off = compare(mask_of(engine, scene, {.kind = kind, .settings = {}}, tolerance).visibility, whole.visibility);
                ++masks;
                beyond += off.max > tolerance + of_samples;
                if (off.max > tolerance + of_samples) std::printf("[  MEASURE ] %s, scene %d, tolerance %g: %.3f off\n", kind, seed, tolerance, off.max);
                worst = std::max(worst, off.max / (tolerance + of_samples));
            }
        }
    EXPECT_LE(beyond, masks / 1000) << "of " << masks;
    std::printf("[  MEASURE ] the largest difference of other techniques is %.2f times what is allowed\n", worst);
}

TEST(Tolerance, SparesMostReceiversUnderAWideLight)
{
    const Engine engine;
    Scene scene = plates(3, 400);
    scene.light = RectangleLight{.center = {0, 6, 0}, .half_u = {1, 0, 0}, .half_v = {0, 0, -1}, .emission = {}};
    for (const char* kind : {"soft_shadow_map", "soft_shadow_volume"}) {
        const Mask whole = mask_of(engine, scene, {.kind = kind, .settings = {}}, 0), some = mask_of(engine, scene, {.kind = kind, .settings = {}}, 0.06);
        EXPECT_LT(some.report.receivers_shaded, some.report.receivers / 5) << kind;
        EXPECT_LT(compare(some.visibility, whole.visibility).max, 0.06) << kind;
    }
}

TEST(Tolerance, EveryTechniqueTakesItAndGivesTheSameBitsAgain)
{
    const Engine engine;
    const Scene scene = plates(5, 93);
    for (const TechniqueRow& row : technique_table()) {
        const Mask first = mask_of(engine, scene, {.kind = std::string(row.kind), .settings = {}}, 0.02), again = mask_of(engine, scene, {.kind = std::string(row.kind), .settings = {}}, 0.02);
        EXPECT_EQ(first.visibility.pixels, again.visibility.pixels) << row.kind;
        EXPECT_EQ(first.report.receivers, computes_some(row.kind) ? 93u * 93 : 0u) << row.kind;
        for (const float v : first.visibility.pixels) ASSERT_TRUE(v >= 0 && v <= 1) << row.kind;
    }
}

// Rays of the pixels that are computed are those of the whole mask, to the bit.
TEST(Tolerance, RaysAreThoseOfTheWholeMask)
{
    const Engine engine;
    const Scene scene = plates(7, 128);
    const Mask whole = mask_of(engine, scene, {.kind = "ray_traced", .settings = {{"samples", std::int64_t{64}}}}, 0), some = mask_of(engine, scene, {.kind = "ray_traced", .settings = {{"samples", std::int64_t{64}}}}, 0.006);
    std::size_t same = 0;
    for (std::size_t i = 0; i < whole.visibility.pixels.size(); ++i) same += whole.visibility.pixels[i] == some.visibility.pixels[i];
    EXPECT_GE(same, some.report.receivers_shaded);
    EXPECT_LT(some.report.receivers_shaded, some.report.receivers);
}

TEST(Tolerance, TexturedLightsKeepTheirChannels)
{
    const Engine engine;
    Scene scene = plates(9, 64);
    auto& light = std::get<RectangleLight>(scene.light);
    light.emission = Image{.width = 2, .height = 1, .channels = 3, .pixels = {1, 0, 0.5f, 0, 1, 0.5f}};
    const Mask whole = mask_of(engine, scene, {.kind = "soft_shadow_volume", .settings = {{"coverage", std::string("texture")}}}, 0),
               some = mask_of(engine, scene, {.kind = "soft_shadow_volume", .settings = {{"coverage", std::string("texture")}}}, 0.01);
    EXPECT_EQ(some.visibility.channels, 3);
    EXPECT_LT(compare(some.visibility, whole.visibility).max, 0.05);
}

TEST(Tolerance, RaysAreChosenByOneOfTheTwo)
{
    const Engine engine;
    try {
        engine.mask(plates(1, 16), RayTraced{.adaptive = true, .tolerance = 0.01});
        ADD_FAILURE() << "taken";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_EQ(error.path(), "technique.adaptive");
    }
}

// What a technique starts from, wherever the word stands among its keys.
TEST(Preset, PaperIsWhatWasPublished)
{
    const auto map = [](const TechniqueRequest& request) { return std::get<SoftShadowMap>(technique_from(request)); };
    const SoftShadowMap paper = map({.kind = "soft_shadow_map", .settings = {{"resolution", std::int64_t{64}}, {"preset", std::string("paper")}}});
    EXPECT_EQ(paper.visibility, PatchVisibility::sum);
    EXPECT_EQ(paper.tolerance, 0);
    EXPECT_EQ(paper.resolution, 64);
    EXPECT_EQ(paper.preset, Preset::paper);
    EXPECT_EQ(map({.kind = "soft_shadow_map", .settings = {}}).visibility, PatchVisibility::united);
    EXPECT_EQ(map({.kind = "soft_shadow_map", .settings = {{"preset", std::string("default")}}}).visibility, PatchVisibility::united);
    const auto slices = std::get<OcclusionTexture>(technique_from({.kind = "occlusion_texture", .settings = {{"preset", std::string("paper")}}}));
    EXPECT_EQ(slices.combine, Combine::product);
    EXPECT_EQ(slices.prefilter, Prefilter::nbuffer);
}

} // namespace
} // namespace penumbra::test
