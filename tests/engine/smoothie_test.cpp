// Smoothies through the engine: closed forms of single edges, what the paper promises, odd lights, what the engine says and refuses.
#include <map>

#include "engine/soft_shadow_volume_scenes.hpp"

namespace penumbra::test::wedges {
namespace {

constexpr int size = 128; // of occluder maps

// Visibility is a distance in the light's image over a width. A distance comes from coordinates below 2 in some 16 roundings, a width is
// 1 - r / b or b - r times a constant: relative roundings of the values before the difference, `lost` times as large after it. The place
// on the map is off by 4 roundings of up to `texels` texels; what it blends differs by 1 at the most. The fall-off is at most pi / 2 steep.
double bound_of(double width, double lost, double texels) { return (16 * 2 / width + 8 * lost + 4 * texels) * 0x1p-24 * pi / 2; }

double fallen(Falloff falloff, double alpha)
{
    const double a = std::clamp(alpha, 0.0, 1.0);
    return falloff == Falloff::linear ? a : 0.5 - 0.5 * std::cos(pi * a);
}

Scene smoothie_scene(const Light& light, const std::vector<TriangleMesh>& casters, const Receivers& r, int texels = size)
{
    Scene scene = scene_of(light, casters, r);
    scene.occluders.camera = light_view();
    scene.occluders.width = scene.occluders.height = texels;
    return scene;
}

Smoothie of_width(double t, Falloff falloff = Falloff::sinusoidal) { return {.t_from = SmoothieWidth::t, .t = t, .falloff = falloff, .two_sided = false}; }

const Smoothie one_sided{.two_sided = false}; // the paper's

// The middle of column x of `columns`, as a tangent: -1 to 1.
double tangent_of(int x, int columns) { return (2 * x + 1.0) / columns - 1; }

TriangleMesh half_plane(double z) { return sheet(-40, 0, -40, 40, z); }

void expect_same(const Image& a, const Image& b, double bound, const std::string& what)
{
    ASSERT_EQ(a.pixels.size(), b.pixels.size());
    double worst = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) worst = std::max(worst, static_cast<double>(std::abs(a.pixels[i] - b.pixels[i])));
    EXPECT_LE(worst, bound) << what;
}

// How many values lie strictly between dark and lit; all of them lie within.
int penumbra_of(const Image& mask)
{
    int count = 0;
    for (const float v : mask.pixels) {
        EXPECT_TRUE(v >= 0 && v <= 1) << v;
        count += v > 0 && v < 1;
    }
    return count;
}

// --- A straight edge ------------------------------------------------------------------------------------------------------------------

// alpha = distance / (t (1 - b / r)), Eq. 1, at the texels' middles.
TEST(SmoothieEdge, RampOfFixedWidthScalesWithOneMinusBOverR)
{
    for (const Falloff falloff : {Falloff::linear, Falloff::sinusoidal})
        for (const double r : {4.5, 6.0, 8.0, 16.0, 400.0})
            for (const double t : {0.1, 0.5}) {
                const Image mask =
                    mask_of(smoothie_scene(point_light(), {half_plane(4)}, floor_at(static_cast<float>(r), size)), of_width(t, falloff));
                const double width = t * (1 - 4 / r);
                int inside = 0;
                for (int x = 0; x < size; ++x) {
                    const double at = tangent_of(x, size), expected = at < 0 ? 0 : fallen(falloff, at / width);
                    ASSERT_NEAR(mask.at(x, size / 2), expected, bound_of(width, 1 / (1 - 4 / r), size)) << t << ", " << r << ": " << x;
                    inside += at > 0 && at < width;
                }
                EXPECT_EQ(inside, static_cast<int>(std::lround(width * size / 2))) << t << ", " << r;
            }
}

// Half of the penumbra that the light casts: h (1 / b - 1 / r) in tangents, h the radius of the disc of the light's area.
TEST(SmoothieEdge, WidthFromTheLight)
{
    const double h = 0.5;
    const double side = h * std::sqrt(pi) / 2; // half of a square of the same area
    const std::map<std::string, Light> lights = {
        {"sphere", sphere_light(h)}, {"square", rectangle_light(side, side)}, {"strip", rectangle_light(side * 4, side / 4)}};
    for (const auto& [name, light] : lights)
        for (const double b : {1.0, 2.0, 4.0})
            for (const double r : {4.5, 8.0, 40.0}) {
                const Image mask = mask_of(smoothie_scene(light, {half_plane(b)}, floor_at(static_cast<float>(r), size)),
                                           Smoothie{.falloff = Falloff::linear, .two_sided = false});
                const double width = h * (1 / b - 1 / r);
                for (int x = 0; x < size; ++x) {
                    const double at = tangent_of(x, size);
                    ASSERT_NEAR(mask.at(x, 5), at < 0 ? 0 : std::min(at / width, 1.0), bound_of(width, 1 / (1 - b / r), size))
                        << name << ", " << b << ", " << r << ": " << x;
                }
            }
}

// Of the sun lengths count: tan(half the angle) (r - b).
TEST(SmoothieEdge, DirectionalLight)
{
    const double degrees = 20, tangent = std::tan(degrees / 2 * pi / 180);
    const LightCamera view{.tan_half_fov = {}, .half_extent = Vec2(2, 2), .center = Vec3(0, 0, 0)};
    for (const double r : {4.5, 8.0}) {
        Scene scene = smoothie_scene(DirectionalLight{.direction = {0, 0, -1}, .angular_diameter_deg = degrees, .up = Vec3(0, 1, 0)},
                                     {half_plane(4)}, receivers(view, flat(size, size, static_cast<float>(r))));
        scene.occluders.camera = view;
        const Image mask = mask_of(scene, Smoothie{.falloff = Falloff::linear, .two_sided = false});
        const double width = tangent * (r - 4);
        for (int x = 0; x < size; ++x) {
            const double at = 2 * tangent_of(x, size);
            // The viewpoint of its silhouettes is ten thousand extents away, which moves no edge of a sheet.
            ASSERT_NEAR(mask.at(x, 5), at < 0 ? 0 : std::min(at / width, 1.0), bound_of(width, 8 / (r - 4), size)) << r << ": " << x;
        }
    }
}

// A floor that meets the caster: the edge is hard there and softens away from it.
TEST(SmoothieEdge, HardAtContact)
{
    // Disparity is linear over the map: 1/4 in its first row's middle, where the caster is, 1/8 in its last one's.
    const DepthMap ramp = map_of(size, size, [](int, int y) {
        const double part = static_cast<double>(y) / (size - 1);
        return static_cast<float>(1 / ((1 - part) / 4 + part / 8));
    });
    const double h = 1;
    const Image mask =
        mask_of(smoothie_scene(sphere_light(h), {half_plane(4)}, receivers(light_view(), ramp)), Smoothie{.falloff = Falloff::linear, .two_sided = false});
    int last = 0;
    for (int y = 0; y < size; ++y) {
        const double width = h * (0.25 - 1 / static_cast<double>(ramp.depth[static_cast<std::size_t>(y) * size]));
        int inside = 0;
        for (int x = size / 2; x < size; ++x) {
            const double expected = width <= 0 ? 1 : std::min(tangent_of(x, size) / width, 1.0);
            // Receivers and caster differ by `width`: what is lost of it grows as it shrinks.
            ASSERT_NEAR(mask.at(x, y), expected, width <= 0 ? 0 : bound_of(width, 0.25 / width, size)) << x << ", " << y;
            inside += mask.at(x, y) < 1;
        }
        EXPECT_GE(inside, last) << y;
        last = inside;
        if (y == 0) {
            EXPECT_EQ(inside, 0);
        }
    }
    EXPECT_EQ(last, static_cast<int>(std::lround(0.125 * size / 2)));
}

// Half lit on the silhouette, from there to both sides as wide as the penumbra.
TEST(SmoothieEdge, TwoSided)
{
    const double width = 0.25;
    const Image mask = mask_of(smoothie_scene(sphere_light(2), {half_plane(4)}, floor_at(8, size)),
                               Smoothie{.falloff = Falloff::linear, .two_sided = true});
    for (int x = 0; x < size; ++x)
        ASSERT_NEAR(mask.at(x, 40), std::clamp(0.5 + 0.5 * tangent_of(x, size) / width, 0.0, 1.0), bound_of(width, 2, size)) << x;
}

// --- What follows for any scene -------------------------------------------------------------------------------------------------------

std::vector<TriangleMesh> some_casters() { return {closed_box({-1, -0.5, 3}, {1, 1, 4}), torus_knot({1, 1, 5})}; }

// A camera beside the light that looks at what it lights.
Receivers from_beside(int pixels)
{
    const double s = 0.6, c = 0.8;
    return receivers(PinholeCamera{.frame = {.origin = {5, 0, 0}, .x = {c, 0, -s}, .y = {0, 1, 0}, .z = {s, 0, c}}, .tan_half_fov = {1, 1}},
                     flat(pixels, pixels, 9));
}

TEST(Smoothie, LetsNoLightThrough)
{
    for (const bool beside : {false, true})
        for (const SilhouetteSource silhouettes : {SilhouetteSource::object, SilhouetteSource::image}) {
            const Scene scene = smoothie_scene(sphere_light(0.5), some_casters(), beside ? from_beside(93) : floor_at(8, 93));
            const Image hard = mask_of(scene, of_width(0));
            for (const Smoothie& settings :
                 {Smoothie{.silhouettes = silhouettes, .two_sided = false}, Smoothie{.t_from = SmoothieWidth::t, .t = 0.3, .silhouettes = silhouettes, .two_sided = false}}) {
                const Image mask = mask_of(scene, settings);
                double darker = 0;
                for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
                    ASSERT_LE(mask.pixels[i], hard.pixels[i]) << i;
                    darker += hard.pixels[i] - mask.pixels[i];
                }
                EXPECT_GT(darker, 50);
                EXPECT_GT(penumbra_of(mask), 300);
            }
        }
}

// Without width: the four nearest texels' hard tests, blended.
TEST(Smoothie, NoWidthIsATentOverTheShadowMap)
{
    constexpr int times = 5;
    const auto scene_at = [&](int pixels) { return smoothie_scene(point_light(), some_casters(), floor_at(8, pixels)); };
    const Image hard = mask_of(scene_at(size), ShadowMap{});
    const auto texel = [&](int x, int y) { return x < 0 || y < 0 || x >= size || y >= size ? 1.0 : hard.at(x, y); };
    for (const Smoothie& settings : {of_width(0, Falloff::linear), Smoothie{.falloff = Falloff::linear, .two_sided = false}}) { // a point light has no size
        const Image mask = mask_of(scene_at(size * times), settings);
        int penumbra = 0;
        for (int y = 0; y < size * times; ++y)
            for (int x = 0; x < size * times; ++x) {
                const double px = (x + 0.5) / times - 0.5, py = (y + 0.5) / times - 0.5;
                const int i = static_cast<int>(std::floor(px)), j = static_cast<int>(std::floor(py));
                const double u = px - i, v = py - j;
                const double expected =
                    (texel(i, j) * (1 - u) + texel(i + 1, j) * u) * (1 - v) + (texel(i, j + 1) * (1 - u) + texel(i + 1, j + 1) * u) * v;
                ASSERT_NEAR(mask.at(x, y), expected, bound_of(1, 1, size)) << x << ", " << y;
                penumbra += expected > 0 && expected < 1;
            }
        EXPECT_GT(penumbra, 1000);
    }
}

TEST(Smoothie, OfATexelAndOfHalfTheMap)
{
    for (const double t : {2.0 / size, 1.0, 2.0}) {
        const Image mask = mask_of(smoothie_scene(point_light(), {closed_box({-1, -1, 3}, {1, 1, 4})}, floor_at(8, size)), of_width(t));
        EXPECT_GT(penumbra_of(mask), t < 0.1 ? 100 : size * size / 3) << t;
        EXPECT_EQ(mask.at(size / 2, size / 2), 0.0f);
        // Away from the box ever lighter.
        for (int x = size / 2; x + 1 < size; ++x) ASSERT_LE(mask.at(x, size / 2), mask.at(x + 1, size / 2)) << t << ": " << x;
    }
}

// An edge of the depth map lies within a texel of the object's own, along either axis: alphas differ by less than its diagonal over the
// width of the narrowest fin.
TEST(Smoothie, SilhouettesOfObjectsAndOfTheMapAgree)
{
    const Scene scene = smoothie_scene(sphere_light(1), {closed_box({-1.03, -0.52, 3}, {0.97, 1.01, 4})}, floor_at(8, size));
    const Image object = mask_of(scene, Smoothie{.falloff = Falloff::linear, .two_sided = false});
    const Image map = mask_of(scene, Smoothie{.silhouettes = SilhouetteSource::image, .falloff = Falloff::linear, .two_sided = false});
    const double width = 1 / 4.0 - 1 / 8.0, texel = 2.0 / size;
    expect_same(object, map, texel * std::numbers::sqrt2 / width + bound_of(width, 2, size), "a box");
    EXPECT_GT(penumbra_of(map), 1000);
}

// As many pixels as the map has texels, or far fewer: a receiver has its value whoever else is looked at.
TEST(Smoothie, ReceiversOfACoarserCameraLeaveNoHoles)
{
    const double width = 0.25 * 2;
    for (const int pixels : {8, 31, 700}) {
        const Image mask =
            mask_of(smoothie_scene(sphere_light(4), {half_plane(4)}, floor_at(8, pixels), 256), Smoothie{.falloff = Falloff::linear, .two_sided = false});
        for (int y = 0; y < pixels; ++y)
            for (int x = 0; x < pixels; ++x) {
                const double at = tangent_of(x, pixels), texel = 2.0 / 256;
                if (std::abs(at) < texel || std::abs(at) > 1 - texel || std::abs(tangent_of(y, pixels)) > 1 - texel ||
                    std::abs(at - width) < texel)
                    continue; // blended with what lies across
                ASSERT_NEAR(mask.at(x, y), at < 0 ? 0 : std::min(at / width, 1.0), bound_of(width, 2, 256)) << pixels << ": " << x;
            }
    }
}

// 6.1: receivers that do not cast are shaded softly too, where the shadow map alone shows no receiver; those that cast look the same.
TEST(Smoothie, ReceiversThatDoNotCast)
{
    Scene scene = smoothie_scene(sphere_light(1), {closed_box({-1, -1, 3}, {1, 1, 4})}, floor_at(8, size));
    const Image apart = mask_of(scene, one_sided);
    EXPECT_GT(penumbra_of(apart), 1000);
    // The floor casts now; its own edge is far outside.
    scene.objects.push_back({.name = "floor", .mesh = sheet(-80, 80, -80, 80, 8), .casts = true, .receives = true});
    expect_same(apart, mask_of(scene, one_sided), bound_of(0.125, 2, size), "a floor that casts");
}

// Casters that receive hide nothing of the floor's penumbra: where a camera sees both in one texel of the map, each has its own share.
TEST(Smoothie, ReceiversOnTheBlockerLeaveNoGapAtItsOutline)
{
    const TriangleMesh box = closed_box({-1.03, -0.52, 3}, {0.97, 1.01, 4});
    const double s = 0.6, c = 0.8;
    const PinholeCamera camera{.frame = {.origin = {5, 0, 0}, .x = {c, 0, -s}, .y = {0, 1, 0}, .z = {s, 0, c}}, .tan_half_fov = {0.6, 0.6}};
    Scene scene = smoothie_scene(sphere_light(0.5), {box}, {});
    scene.objects.push_back({.name = "floor", .mesh = sheet(-20, 20, -20, 20, 8), .casts = false, .receives = true});
    const auto with_box = [&](bool receives) {
        scene.objects.front().receives = receives;
        scene.receivers = {.camera = camera, .width = 512, .height = 512, .depth = {}};
        return std::pair{mask_of(scene, one_sided), *with_depth(scene, one_sided).receivers.depth};
    };
    const auto [with, depth] = with_box(true);
    const auto [without, floor] = with_box(false);
    int penumbra = 0, on_box = 0;
    for (int y = 0; y < 512; ++y)
        for (int x = 0; x < 512; ++x) {
            const std::size_t at = static_cast<std::size_t>(y * 512 + x);
            if (depth.depth[at] != floor.depth[at]) {
                ++on_box;
                continue;
            }
            ASSERT_EQ(with.at(x, y), without.at(x, y)) << x << ", " << y;
            penumbra += with.at(x, y) > 0 && with.at(x, y) < 1;
        }
    EXPECT_GT(penumbra, 1000);
    EXPECT_GT(on_box, 1000);
}

// What the light sees nothing of casts nothing of its own.
TEST(Smoothie, FinsBehindBlockersAreDropped)
{
    const TriangleMesh roof = sheet(-2, 2, -2, 2, 3), below = closed_box({-1, -1, 4}, {1, 1, 5});
    const auto mask = [&](const std::vector<TriangleMesh>& casters) {
        return mask_of(smoothie_scene(sphere_light(1), casters, floor_at(8, size)), one_sided);
    };
    EXPECT_EQ(mask({roof, below}).pixels, mask({roof}).pixels);
    EXPECT_NE(mask({below}).pixels, mask({roof}).pixels);
}

// An edge inside the outline lets no light in: beside it the blocker below goes on, here for four texels.
TEST(Smoothie, TwoSidedComesFromTheOutlineAlone)
{
    const TriangleMesh wide = sheet(-1, 1, -1, 1, 4), above = sheet(-0.73125, 0.73125, -0.73125, 0.73125, 3.9);
    const auto mask = [&](const std::vector<TriangleMesh>& casters) {
        return mask_of(smoothie_scene(sphere_light(0.5), casters, floor_at(8, size)), Smoothie{.two_sided = true});
    };
    const Image both = mask({wide, above}), alone = mask({wide});
    int half_lit = 0;
    for (int y = 48; y < 80; ++y) // the wide one's texels: tangents of 1/4 and less
        for (int x = 48; x < 80; ++x) {
            ASSERT_EQ(both.at(x, y), alone.at(x, y)) << x << ", " << y;
            half_lit += alone.at(x, y) > 0;
        }
    EXPECT_GT(half_lit, 300);
    EXPECT_LT(half_lit, 32 * 32);
}

// A receiver between a fin's own blocker and the light is lit whatever the least alpha of its texel.
TEST(Smoothie, AFinShadesOnlyWhatLiesBehindIt)
{
    const Image mask = mask_of(smoothie_scene(sphere_light(1), {half_plane(4)}, floor_at(3.9f, size)), one_sided);
    for (const float v : mask.pixels) ASSERT_EQ(v, 1.0f);
}

// --- Symmetry, odd meshes -------------------------------------------------------------------------------------------------------------

std::vector<TriangleMesh> moved(std::vector<TriangleMesh> meshes, const std::function<Vec3(const Vec3&)>& map, bool turns_round = false)
{
    for (TriangleMesh& mesh : meshes) {
        for (Imath::V3f& p : mesh.positions) p = Imath::V3f(map(Vec3(p)));
        if (turns_round)
            for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
    }
    return meshes;
}

TEST(SmoothieSymmetry, Mirrored)
{
    // No edge of the box runs through the middle of a texel.
    const std::vector<TriangleMesh> casters = {closed_box({-1.03, -0.52, 3}, {0.97, 1.01, 4}), sheet(1.1, 1.9, -1.7, -0.3, 5)};
    for (const bool two_sided : {false, true}) {
        const Smoothie settings{.falloff = Falloff::linear, .two_sided = two_sided};
        const Image a = mask_of(smoothie_scene(sphere_light(1), casters, floor_at(8, size)), settings);
        const Image b = mask_of(smoothie_scene(sphere_light(1),
                                               moved(
                                                   casters, [](const Vec3& p) { return Vec3(-p.x, p.y, p.z); }, true),
                                               floor_at(8, size)),
                                settings);
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < size; ++x)
                ASSERT_NEAR(a.at(x, y), b.at(size - 1 - x, y), 2 * bound_of(1 / 5.0 - 1 / 8.0, 3, size))
                    << two_sided << ": " << x << ", " << y;
        EXPECT_GT(penumbra_of(a), 1000);
    }
}

TEST(SmoothieSymmetry, Scale)
{
    for (const bool two_sided : {false, true}) {
        const std::vector<TriangleMesh> casters = {closed_box({-1.03, -0.52, 3}, {0.97, 1.01, 4}), sheet(1.1, 1.9, -1.7, -0.3, 5)};
        const Smoothie settings{.falloff = Falloff::linear, .two_sided = two_sided};
        const auto at_scale = [&](double scale) {
            return mask_of(smoothie_scene(sphere_light(scale), moved(casters, [scale](const Vec3& p) { return p * scale; }),
                                          floor_at(static_cast<float>(8 * scale), size)),
                           settings);
        };
        const Image one = at_scale(1);
        EXPECT_GT(penumbra_of(one), 1000);
        for (const double scale : {0x1p-20, 0x1p20, 1e-6, 1e6})
            expect_same(at_scale(scale), one, 2 * bound_of(1 / 5.0 - 1 / 8.0, 3, size), std::to_string(scale));
    }
}

// Half a ball and loose triangles: every border is a silhouette, and no value leaves [0, 1].
TEST(Smoothie, OpenMeshes)
{
    TriangleMesh half = ball({0, 0, 5}, 1, 16, 24);
    half.triangles.resize(half.triangles.size() / 2);
    for (const bool two_sided : {false, true})
        for (const SilhouetteSource silhouettes : {SilhouetteSource::object, SilhouetteSource::image}) {
            const Image mask = mask_of(
                smoothie_scene(sphere_light(1), {half, mesh_of({{-3, -3, 3}, {3, -2, 6}, {-2, 3, 5}}, {{0, 1, 2}})}, floor_at(9, size)),
                Smoothie{.silhouettes = silhouettes, .two_sided = two_sided});
            EXPECT_GT(penumbra_of(mask), 1000);
        }
}

// --- What the engine says -------------------------------------------------------------------------------------------------------------

TEST(Smoothie, DepthMapsAlone)
{
    const DepthMap occluder = boxes(size, size, 4, {{40, 80, 40, 80}});
    const Mask mask = engine().shade(engine().prepare(sphere_light(1), occluders(light_view(), occluder), one_sided), floor_at(8, size));
    EXPECT_EQ(std::count(mask.report.warnings.begin(), mask.report.warnings.end(),
                         "there are no objects that cast: silhouettes are those of the depth map (silhouettes image)"),
              1);
    EXPECT_EQ(mask.visibility.at(60, 60), 0.0f);
    EXPECT_GT(penumbra_of(mask.visibility), 500);
    // The edge lies on the texels' border.
    const double at = tangent_of(82, size) - (2.0 * 80 / size - 1), width = 0.125;
    EXPECT_NEAR(mask.visibility.at(82, 60), fallen(Falloff::sinusoidal, at / width), bound_of(width, 2, size));

    const Mask asked = engine().shade(
        engine().prepare(sphere_light(1), occluders(light_view(), occluder), Smoothie{.silhouettes = SilhouetteSource::image, .two_sided = false}),
        floor_at(8, size));
    EXPECT_EQ(asked.visibility.pixels, mask.visibility.pixels);
    for (const std::string& warning : asked.report.warnings) EXPECT_FALSE(holds(warning, "silhouettes are those")) << warning;
}

TEST(Smoothie, NothingCasts)
{
    const Mask mask = engine().shade(engine().prepare(sphere_light(1), occluders(light_view(), flat(16, 16, nothing_there)), one_sided),
                                     floor_at(8, size));
    for (const float v : mask.visibility.pixels) ASSERT_EQ(v, 1.0f);
    EXPECT_EQ(std::count(mask.report.warnings.begin(), mask.report.warnings.end(),
                         "there are no silhouettes before the light: shadows have hard edges"),
              1);
}

TEST(Smoothie, RefusesAWidthThatTheLightDecides)
{
    const Scene scene = smoothie_scene(sphere_light(1), {half_plane(4)}, floor_at(8, size));
    const Error error = error_of([&] { engine().mask(scene, Smoothie{.t = 0.1}); });
    EXPECT_EQ(error.code(), ErrorCode::invalid_input);
    EXPECT_TRUE(holds(error.what(), "technique.t") && holds(error.what(), "t_from light")) << error.message();
}

} // namespace
} // namespace penumbra::test::wedges
