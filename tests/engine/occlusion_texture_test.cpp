// occlusion_texture through the engine: shadows with a known answer, rays, invariants, and what is refused.
#include <numeric>
#include <thread>

#include "engine/soft_shadow_volume_scenes.hpp"

#include "support/child.hpp"

namespace penumbra::test {
namespace {

using wedges::against_rays;
using wedges::ball;
using wedges::engine;
using wedges::floor_at;
using wedges::mask_of;
using wedges::record;
using wedges::scene_of;

Metrics compared(const Scene& scene, const OcclusionTexture& settings)
{
    return compare(mask_of(scene, settings), mask_of(scene, RayTraced{.samples = 1024}));
}

DirectionalLight sun(double degrees) { return {.direction = {0, 0, -1}, .angular_diameter_deg = degrees, .up = Vec3(0, 1, 0)}; }

// --- Known answers -----------------------------

// Rectangles [x0, x1] x [y0, y1] at depth 4 that do not overlap, a light of half extents U and V, and a floor at depth 8, seen with
// tangents of 1.
struct Plate {
    double x0, x1, y0, y1;
};

double closed_form(const std::vector<Plate>& plates, double U, double V, int pixels, int x, int y)
{
    const double px = ((2 * x + 1.0) / pixels - 1) * 8, py = (1 - (2 * y + 1.0) / pixels) * 8;
    // l = (o z_p - p z_o) / (z_p - z_o)
    const auto overlap = [](double o0, double o1, double p, double H) {
        return std::max(0.0, std::min(2 * o1 - p, H) - std::max(2 * o0 - p, -H)) / (2 * H);
    };
    double hidden = 0;
    for (const Plate& plate : plates) hidden += overlap(plate.x0, plate.x1, px, U) * overlap(plate.y0, plate.y1, py, V);
    return 1 - hidden;
}

Scene plates_scene(const std::vector<Plate>& plates, double U, double V, int pixels)
{
    std::vector<TriangleMesh> meshes;
    for (const Plate& plate : plates) meshes.push_back(sheet(plate.x0, plate.x1, plate.y0, plate.y1, 4));
    return scene_of(rectangle_light(U, V), meshes, floor_at(8, pixels));
}

struct Off {
    double worst = 0;
    int penumbra = 0;
};

Off from_closed_form(const std::vector<Plate>& plates, double U, double V, const OcclusionTexture& settings)
{
    const int pixels = 48;
    const Image mask = mask_of(plates_scene(plates, U, V, pixels), settings);
    Off off;
    for (int y = 0; y < pixels; ++y)
        for (int x = 0; x < pixels; ++x) {
            const double expected = closed_form(plates, U, V, pixels, x, y);
            off.penumbra += expected > 0 && expected < 1;
            off.worst = std::max(off.worst, std::abs(static_cast<double>(mask.at(x, y)) - expected));
        }
    return off;
}

// Borders on those of texels: 64 texels over [-2, 2].
const std::vector<std::vector<Plate>> plates = {
    {{-2, 2, -2, 2}}, {{-2, -1, -2, 2}, {-0.5, 0.25, -1, 1}, {0.25, 2, 1, 2}}, {{-2, 2, -2, -1.9375}, {1.9375, 2, -1, 2}}};

// A table is exact: six roundings of places up to 2 x 64 texels beyond the window, whose kernel is h texels each way, on four borders, and
// eight of the counts.
TEST(SlicesClosedForm, TablesAreExactForAPlanarParallelCaster)
{
    for (const auto& [U, V] : {std::pair{1.0, 1.0}, {2.0, 0.25}, {0.25, 8.0}, {0.05, 0.05}, {30.0, 30.0}})
        for (const auto& list : plates)
            for (const int slices : {1, 16, 64}) {
                const double hx = U / 2 * 16, hy = V / 2 * 16; // half the kernel, in texels of 1/16
                // The light's reach on the plane, U + 8 scene units, as texels.
                const double reach = (std::max(U, V) + 8 + 2) * 16 * 2, meets = (2 * hx + 2) * (2 * hy + 2) / (4 * hx * hy);
                const double bound = 0x1p-24 * (6 * reach * (1 / hx + 1 / hy) + 8 * meets + 8);
                const Off off = from_closed_form(list, U, V, {.slices = slices, .resolution = 64, .prefilter = Prefilter::summed_area});
                EXPECT_LE(off.worst, bound) << U << " x " << V << ", " << slices << " slices";
                EXPECT_LT(bound, 2e-3);
                if (U <= 2 && V <= 2 && U > 0.1) {
                    EXPECT_GT(off.penumbra, 10);
                }
            }
}

// N-buffers know boxes of 2^l texels. Between two of them, a share a of the way, a straight border is off most where the true kernel, 2^a
// wide, just leaves it: the smaller box sees all and the larger one q = 1/2 + 2^a / 4; at a corner q^2, so that 1 comes out as 1 - a (1 -
// q^2): up to 0.137, half way. Bilinear lookups round off a kink of 1 / 2^l by a sixth of it, on each axis. 16 bits: half a unit a level.
TEST(SlicesClosedForm, NBuffersAreOffByTheirBoxes)
{
    for (const auto& [half, level] : {std::pair{1.0, 4}, {0.75, 3}, {0.5, 3}, {1.4, 4}, {2.0, 5}})
        for (const LevelStorage storage : {LevelStorage::binary32, LevelStorage::normalized16}) {
            const double size = half * 16; // of the kernel in texels
            ASSERT_EQ(static_cast<int>(std::floor(std::log2(size))), level);
            const double a = std::log2(size) - level, q = 0.5 + std::exp2(a) / 4;
            const double bound = a * (1 - q * q) + 2 / (6 * std::exp2(level)) + (level + 1) * 0.5 / 65535;
            const Off off = from_closed_form(plates[0], half, half, {.slices = 4, .resolution = 64, .storage = storage});
            std::printf("[  MEASURE ] N-buffer, kernel of %g texels: off by %.4f, bound %.4f\n", size, off.worst, bound);
            EXPECT_LE(off.worst, bound) << half;
            EXPECT_GT(off.penumbra, 100);
        }
}

// A light that is hardly one: outside of the texels along a border, lit or not.
TEST(SlicesClosedForm, PointsOfLightGiveHardShadows)
{
    for (const Light& light : {Light(rectangle_light(1e-9, 1e-9)), Light(point_light()), Light(rectangle_light(1e-30, 1e-30))})
        for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap, Prefilter::summed_area}) {
            Scene scene = plates_scene(plates[1], 0, 0, 61);
            scene.light = light;
            const Image mask = mask_of(scene, OcclusionTexture{.resolution = 64, .prefilter = prefilter});
            int dark = 0;
            for (int y = 0; y < 61; ++y)
                for (int x = 0; x < 61; ++x) {
                    const double px = ((2 * x + 1.0) / 61 - 1) * 4, py = (1 - (2 * y + 1.0) / 61) * 4;
                    double nearest = 1e9;
                    bool inside = false;
                    for (const Plate& p : plates[1]) {
                        nearest = std::min(
                            {nearest, std::max(std::abs(px - p.x0), 0.0), std::abs(px - p.x1), std::abs(py - p.y0), std::abs(py - p.y1)});
                        inside |= px > p.x0 && px < p.x1 && py > p.y0 && py < p.y1;
                    }
                    if (nearest < 1.0 / 16) continue; // a texel
                    ASSERT_EQ(mask.at(x, y), inside ? 0.0f : 1.0f) << x << ", " << y;
                    dark += inside;
                }
            EXPECT_GT(dark, 150);
        }
}

// The receiver's place among the slices: nearer than all of them, on a plane between two, between two, on the last plane.
TEST(SlicesReceivers, OnAndBetweenPlanes)
{
    // Planes at 4, 5, 6, 7, 8: sheets over the whole view in the first and the last slice.
    const std::vector<TriangleMesh> casters = {sheet(-20, 20, -20, 20, 4), sheet(-20, 20, -20, 20, 8)};
    // Prepared for any receivers: for these alone the last sheet is ground, and no slice would be made for it.
    const auto seen = [&](float z, SelfShadow self) {
        const Scene scene = scene_of(rectangle_light(1, 1), casters, floor_at(z, 3, 0.1));
        const Prepared prepared = engine().prepare(scene.light, scene.occluders, Geometry(scene.objects), OcclusionTexture{.slices = 4, .resolution = 16, .prefilter = Prefilter::nbuffer, .combine = Combine::product, .self_shadow = self});
        return engine().shade(prepared, scene.receivers).visibility.at(1, 1);
    };
    for (const SelfShadow self : {SelfShadow::fade, SelfShadow::own, SelfShadow::omit}) {
        EXPECT_EQ(seen(1, self), 1.0f);
        EXPECT_EQ(seen(4, self), 1.0f); // on the caster itself
        EXPECT_EQ(seen(6, self), 0.0f); // a slice further: fully shadowed
        EXPECT_EQ(seen(100, self), 0.0f);
    }
    // Fade: from the slice's far plane on, over the next slice; own: over the slice itself; omit: at once beyond the far plane. (2^-20:
    // what counts as on the plane.)
    EXPECT_EQ(seen(5, SelfShadow::fade), 1.0f);
    EXPECT_NEAR(seen(5.5, SelfShadow::fade), 0.5f, 5 * 0x1p-20);
    EXPECT_NEAR(seen(4.5, SelfShadow::own), 0.5f, 8 * 0x1p-24);
    EXPECT_EQ(seen(5, SelfShadow::own), 0.0f);
    EXPECT_EQ(seen(5, SelfShadow::omit), 1.0f);
    EXPECT_EQ(seen(5.001f, SelfShadow::omit), 0.0f);
}

// --- No shadow of its own -----------------------

Image own_mask(const TriangleMesh& mesh, const Light& light, const OcclusionTexture& settings, int pixels = 96)
{
    Scene scene = scene_of(light, {mesh}, {});
    scene.objects[0].receives = true;
    scene.receivers = {.camera = light_view(0.5), .width = pixels, .height = pixels, .depth = {}};
    return mask_of(scene, settings);
}

TEST(SlicesSelfShadow, ABoxsTopIsLit)
{
    for (const SelfShadow self : {SelfShadow::fade, SelfShadow::own, SelfShadow::omit})
        for (const int slices : {1, 4, 16, 64})
            for (const bool leak_fix : {false, true})
                for (const float v : own_mask(closed_box({-1, -1, 3}, {1, 1, 5}), rectangle_light(1, 1),
                                              {.slices = slices, .combine = Combine::product, .leak_fix = leak_fix, .self_shadow = self}, 48)
                                         .pixels)
                    ASSERT_EQ(v, 1.0f) << slices;
}

// A ball's lit side is one surface across many slices: those before a point's own hold the cap around the axis, which the light's size lets
// the kernel reach.
TEST(SlicesSelfShadow, ABallsLitSideDarkensTowardsItsRim)
{
    for (const int slices : {4, 16, 64}) {
        Scene scene = scene_of(rectangle_light(0.25, 0.25), {ball({0, 0, 4}, 1, 64, 128)}, {});
        scene.objects[0].receives = true;
        scene.receivers = {.camera = light_view(0.3), .width = 96, .height = 96, .depth = {}};
        const Metrics m = compare(mask_of(scene, OcclusionTexture{.slices = slices}), mask_of(scene, RayTraced{.samples = 256}));
        record("ball's own lit side, " + std::to_string(slices) + " slices", m);
        const Image mask = mask_of(scene, OcclusionTexture{.slices = slices});
        // Around the axis, 1/4 of the radius: nothing before it in its own slice or the one before but itself.
        EXPECT_GT(mask.at(48, 48), 0.999f) << slices;
        EXPECT_LT(m.mae, 0.12) << slices;
    }
}

// --- Rays -----------------------------------------

TEST(SlicesAgainstRays, ElongatedLights)
{
    for (const auto& [u, v] : {std::pair{2.0, 0.2}, {0.1, 1.5}, {2.0, 2.0}}) {
        const Scene scene = scene_of(rectangle_light(u, v), {sheet(-1.1, 1.3, -0.9, 1.7, 4)}, floor_at(8));
        for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::summed_area}) {
            const Metrics m = compared(scene, {.prefilter = prefilter});
            record((prefilter == Prefilter::nbuffer ? "N-buffer " : "table ") + std::to_string(u) + " x " + std::to_string(v), m);
            EXPECT_LT(m.rmse_shadow, prefilter == Prefilter::nbuffer ? 0.05 : 0.005);
        }
    }
}

TEST(SlicesAgainstRays, TheSun)
{
    const Receivers floor =
        receivers(LightCamera{.tan_half_fov = {}, .half_extent = Vec2(4, 4), .center = Vec3(0, 0, 10)}, flat(96, 96, 20));
    for (const double degrees : {0.53, 5.0}) {
        const Scene scene = scene_of(sun(degrees), {sheet(-1.1, 1.3, -0.9, 1.7, 4)}, floor);
        const Metrics m = compared(scene, {});
        record("sun of " + std::to_string(degrees) + " degrees", m);
        EXPECT_LT(m.rmse_shadow, 0.05) << degrees;
        EXPECT_LT(std::abs(m.bias_shadow), 0.02) << degrees;
    }
}

TEST(SlicesAgainstRays, LayersAndSplitLightsConverge)
{
    const Scene scene = scene_of(rectangle_light(0.7, 0.7), {sheet(-1, 1, -1, 1, 3), sheet(-1, 1, -1, 1, 5)}, floor_at(8));
    double before = 1;
    for (const int splits : {1, 2, 4}) {
        const Metrics m = compared(scene, {.prefilter = Prefilter::summed_area, .combine = Combine::layered, .light_splits = splits});
        record("stacked squares, " + std::to_string(splits) + " x " + std::to_string(splits), m);
        EXPECT_LT(m.rmse_shadow, before);
        before = m.rmse_shadow;
    }
    EXPECT_LT(before, 0.03);
}

// A thin sheet on edge, in slices that its pieces do not fill: light comes between them. Seen in the next slice too (3.4.1), pieces
// overlap.
TEST(SlicesAgainstRays, LeakFixClosesATiltedSheet)
{
    const TriangleMesh tilted = sheet({Vec3{-3, -1.5, 2.5}, Vec3{3, -1.5, 2.5}, Vec3{3, 1.5, 6.5}, Vec3{-3, 1.5, 6.5}});
    const Scene scene = scene_of(rectangle_light(1.5, 1.5), {tilted}, floor_at(9));
    const Image rays = mask_of(scene, RayTraced{.samples = 1024});
    const auto leaks = [&](const OcclusionTexture& settings) {
        const Image mask = mask_of(scene, settings);
        record(settings.leak_fix ? "tilted sheet, leak fix" : "tilted sheet, leaks", compare(mask, rays));
        double sum = 0;
        int count = 0;
        for (std::size_t i = 0; i < rays.pixels.size(); ++i)
            if (rays.pixels[i] < 0.02f) {
                sum += static_cast<double>(mask.pixels[i]);
                ++count;
            }
        EXPECT_GT(count, 20);
        return sum / count;
    };
    const double without = leaks({.slices = 16, .combine = Combine::product}), with = leaks({.slices = 16, .combine = Combine::product, .leak_fix = true});
    std::printf("[  MEASURE ] light in the umbra of a tilted sheet: %.4f without, %.4f with the leak fix\n", without, with);
    EXPECT_GT(without, 0.05);
    EXPECT_LT(with, without / 2);
}

// --- Invariants ----------------------------------

std::vector<TriangleMesh> clutter()
{
    std::vector<TriangleMesh> meshes = {sheet(-2, 2, -2, -1.5, 3), sheet(1.5, 2, -2, 2, 6), ball({0, 0.2, 4.5}, 0.7, 12, 24),
                                        closed_box({-1.6, 0.5, 3.5}, {-0.9, 1.4, 5})};
    return meshes;
}

const std::vector<OcclusionTexture> settings = {
    {},
    {.slices = 64, .prefilter = Prefilter::summed_area, .combine = Combine::layered, .layers = 8},
    {.slices = 7, .placement = Placement::reciprocal, .resolution = 33, .prefilter = Prefilter::mipmap, .combine = Combine::sum},
    {.slices = 9,
     .placement = Placement::occupied,
     .resolution = 100,
     .storage = LevelStorage::binary32,
     .combine = Combine::max,
     .leak_fix = true,
     .self_shadow = SelfShadow::own},
    {.slices = 5, .resolution = 64, .combine = Combine::layered_max, .layers = 2, .self_shadow = SelfShadow::omit, .light_splits = 3},
};

Receivers scattered() { return receivers(light_view(0.8), random_map(61, 41, 2.5, 12, 0.05, 3)); }

TEST(SlicesInvariants, VisibilityIsFromZeroToOneAndExactlyOneWhereNothingIs)
{
    for (const double half : {0.0, 1e-6, 0.1, 3.0, 1000.0})
        for (const OcclusionTexture& s : settings) {
            for (const float v : mask_of(scene_of(rectangle_light(half, half), clutter(), scattered()), s).pixels)
                ASSERT_TRUE(v >= 0 && v <= 1) << v;
        }
    // Every number of parts adds up to all of the light.
    for (int splits = 1; splits <= 16; ++splits) {
        const Scene lit = scene_of(rectangle_light(0.1, 0.1), {sheet(-0.1, 0.1, -0.1, 0.1, 4)}, receivers(light_view(0.5), flat(3, 1, 5)));
        const Image mask = mask_of(lit, OcclusionTexture{.slices = 1, .resolution = 4, .light_splits = splits});
        EXPECT_EQ(mask.at(0, 0), 1.0f) << splits;
        EXPECT_EQ(mask.at(2, 0), 1.0f) << splits;
        EXPECT_LT(mask.at(1, 0), 0.5f) << splits;
    }
}

std::string hashes()
{
    const Engine own;
    std::string text;
    for (const OcclusionTexture& s : settings)
        for (const Light& light : {Light(rectangle_light(0.4, 0.7)), Light(sun(3))}) {
            if (s.light_splits > 1 && std::holds_alternative<DirectionalLight>(light)) continue;
            if (s.placement == Placement::reciprocal && std::holds_alternative<DirectionalLight>(light)) continue;
            Scene scene = scene_of(light, clutter(), scattered());
            scene.receivers.camera = PinholeCamera{.frame = {}, .tan_half_fov = {0.8, 0.8}};
            text += "hash " + std::to_string(hash_of(own.mask(scene, s).visibility.pixels)) + "\n";
        }
    return text;
}

TEST(SlicesInvariants, DISABLED_PrintHashes) { std::fputs(("\n" + hashes()).c_str(), stdout); }

TEST(SlicesInvariants, SameBitsInEveryRunAndWithAnyNumberOfThreads)
{
    const std::string here = hashes();
    EXPECT_EQ(hashes(), here);
    for (const char* threads : {"1", "3"})
        EXPECT_EQ(child_output("SlicesInvariants.DISABLED_PrintHashes", {{"POCL_MAX_PTHREAD_COUNT", threads}}, "hash "), here) << threads;
}

// Casters at the corners of the range keep window and slices as they are. Places are then the same to the bit and counts only grow; a mean
// of levels is rounded eight times, a table's six times for each texel that its kernel meets over its area.
TEST(SlicesInvariants, AnAddedCasterNeverBrightens)
{
    const std::vector<TriangleMesh> frame = {sheet(-8, -7.5, -8, -7.5, 2), sheet(7.5, 8, 7.5, 8, 2), sheet(-8, -7.5, 7.5, 8, 7),
                                             sheet(7.5, 8, -8, -7.5, 7)};
    for (const Combine combine : {Combine::product, Combine::sum, Combine::max})
        for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap, Prefilter::summed_area}) {
            std::vector<TriangleMesh> casters = frame;
            // Prepared for any receivers: for these alone some of the frame is ground, and the slices would move when it is needed.
            const auto mask = [&] {
                const Scene scene = scene_of(rectangle_light(0.5, 0.5), casters, scattered());
                const Prepared prepared = engine().prepare(scene.light, scene.occluders, Geometry(scene.objects),
                                                           OcclusionTexture{.slices = 8, .prefilter = prefilter, .combine = combine});
                return engine().shade(prepared, scene.receivers).visibility;
            };
            Image before = mask();
            int darker = 0;
            for (int n = 0; n < 6; ++n) {
                casters.push_back(sheet(-3 + n * 0.8, -1.5 + n * 0.8, -2, 1.5 - n * 0.5, 2.5 + n * 0.6));
                const Image after = mask();
                for (std::size_t i = 0; i < after.pixels.size(); ++i) {
                    ASSERT_LE(after.pixels[i], before.pixels[i] + 32 * 8 * 0x1p-24f) << i;
                    darker += after.pixels[i] < before.pixels[i] - 0.01f;
                }
                before = after;
            }
            EXPECT_GT(darker, 300);
        }
}

// Powers of two change no rounding; other scales round elsewhere, and then a texel whose line grazes a border may change: one of the
// kernel's texels.
TEST(SlicesInvariants, ScenesOfAnyScale)
{
    const auto mask = [](double scale) {
        std::vector<TriangleMesh> meshes = clutter();
        for (TriangleMesh& mesh : meshes)
            for (Imath::V3f& p : mesh.positions) p *= static_cast<float>(scale);
        Receivers r = scattered();
        for (float& z : r.depth->depth) z *= static_cast<float>(scale);
        return mask_of(scene_of(rectangle_light(scale, scale), meshes, r),
                       OcclusionTexture{.slices = 8, .prefilter = Prefilter::summed_area, .combine = Combine::sum});
    };
    const Image one = mask(1);
    for (const double scale : {0x1p-20, 0x1p20}) EXPECT_EQ(mask(scale).pixels, one.pixels) << scale;
    for (const double scale : {1e-6, 1e-3, 1e3, 1e6}) {
        const Metrics m = compare(mask(scale), one);
        record("scale " + std::to_string(scale), m);
        EXPECT_LT(m.rmse, 1e-4) << scale;
        EXPECT_LT(m.max, 0.01) << scale;
    }
}

// Mirrored about x = 0, and turned by a quarter about the axis.
TEST(SlicesInvariants, MirroredAndTurnedScenes)
{
    const auto mask = [](const std::function<Imath::V3f(const Imath::V3f&)>& move, const DepthMap& depth, double u, double v) {
        std::vector<TriangleMesh> meshes = clutter();
        for (TriangleMesh& mesh : meshes)
            for (Imath::V3f& p : mesh.positions) p = move(p);
        return mask_of(scene_of(rectangle_light(u, v), meshes, receivers(light_view(0.8), depth)),
                       OcclusionTexture{.slices = 8, .prefilter = Prefilter::summed_area});
    };
    const DepthMap depth = random_map(41, 41, 2.5, 12, 0.05, 3);
    const DepthMap mirrored = map_of(41, 41, [&](int x, int y) { return depth.at(40 - x, y); });
    const DepthMap turned = map_of(41, 41, [&](int x, int y) { return depth.at(y, 40 - x); }); // (x, y) -> (y, -x), y up
    const Image whole = mask([](const Imath::V3f& p) { return p; }, depth, 0.3, 0.9);
    const Image other = mask([](const Imath::V3f& p) { return Imath::V3f(-p.x, p.y, p.z); }, mirrored, 0.3, 0.9);
    const Image quarter = mask([](const Imath::V3f& p) { return Imath::V3f(p.y, -p.x, p.z); }, turned, 0.9, 0.3);
    double worst = 0;
    int dark = 0;
    for (int y = 0; y < 41; ++y)
        for (int x = 0; x < 41; ++x) {
            worst = std::max(worst, std::abs(static_cast<double>(other.at(x, y)) - static_cast<double>(whole.at(40 - x, y))));
            worst = std::max(worst, std::abs(static_cast<double>(quarter.at(x, y)) - static_cast<double>(whole.at(y, 40 - x))));
            dark += whole.at(x, y) < 0.9f;
        }
    std::printf("[  MEASURE ] mirrored and turned: off by %.2g\n", worst);
    EXPECT_LT(worst, 0.01); // a texel of a kernel of a hundred, where a line grazes a border
    EXPECT_GT(dark, 150);
}

// --- Depth maps alone ------------------------------

Image map_mask(const Light& light, const Occluders& o, const Receivers& r, const OcclusionTexture& s = {})
{
    return engine().shade(engine().prepare(light, o, s), r).visibility;
}

// A plane given as a map and as a mesh: borders lie within a rounding of each other, and the bits are the same but for texels there.
TEST(SlicesOfMaps, APlaneIsItsMesh)
{
    const OcclusionTexture s{.resolution = 64, .prefilter = Prefilter::summed_area};
    // Columns 16 to 48 of 64 over tangents of 1, at depth 4: [-2, 2].
    const Occluders o = occluders(light_view(), boxes(64, 64, 4, {{16, 48, 16, 48}}));
    const Receivers floor = floor_at(8, 48);
    const Image from_map = map_mask(rectangle_light(1, 1), o, floor, s), from_mesh = mask_of(plates_scene(plates[0], 1, 1, 48), s);
    EXPECT_LT(compare(from_map, from_mesh).max, 1e-4); // places of 64 texels to 2^-22, over a kernel of 8
}

TEST(SlicesOfMaps, FrontBackAndLayersAllCast)
{
    const Receivers floor = floor_at(12, 48);
    const auto part = [](float z, int from, int to) { return boxes(64, 64, z, {{from, to, 16, 48}}); };
    Occluders o = occluders(light_view(), part(4, 8, 20));
    o.layers = {part(5, 24, 36), part(6, 40, 56)};
    const Image all = map_mask(rectangle_light(0.2, 0.2), o, floor);
    // The middle of each of the three shadows: map columns 14, 30 and 48 of 64 are pixels 10, 22 and 36 of 48.
    for (const int x : {10, 22, 36}) EXPECT_LT(all.at(x, 24), 0.01f) << x;
    for (const int x : {1, 46}) EXPECT_EQ(all.at(x, 24), 1.0f) << x;
    o.layers.clear();
    const Image first = map_mask(rectangle_light(0.2, 0.2), o, floor);
    for (const int x : {22, 36}) EXPECT_EQ(first.at(x, 24), 1.0f) << x;
}

// Between front and back the solid is filled: a receiver inside it is in the dark, where two shells would leave it lit from the side.
TEST(SlicesOfMaps, TheSolidBetweenFrontAndBackCasts)
{
    const auto scene = [](const Light& light, const LightCamera& view, float near, float far, const Receivers& r) {
        Occluders o = occluders(view, boxes(64, 64, near, {{16, 48, 16, 48}}));
        o.layers = {boxes(64, 64, far, {{16, 48, 16, 48}})};
        const OcclusionTexture product{.slices = 8, .combine = Combine::product}; // layered_max takes the greater of two sides for the union of both
        const Image shells = map_mask(light, o, r, product);
        o.back = o.layers[0];
        o.layers.clear();
        return std::pair{shells, map_mask(light, o, r, product)};
    };
    // A receiver off to the side, whose lines to a wide light cross the solid's flank.
    const Receivers side =
        receivers(light_view(1.5), map_of(33, 33, [](int x, int y) { return x == 28 && y == 16 ? 8.0f : nothing_there; }));
    const auto [shells, solid] = scene(rectangle_light(4, 4), light_view(), 2, 6, side);
    EXPECT_LT(solid.at(28, 16), shells.at(28, 16) - 0.02f) << shells.at(28, 16);
    // Directional: depth counts from the view's own centre, which need not be the light's, nor on its axis.
    for (const Vec3& centre : {Vec3(0, 0, 0), Vec3(5, -3, 7)}) {
        const LightCamera view{.tan_half_fov = {}, .half_extent = Vec2(4, 4), .center = centre};
        const Receivers floor = receivers(view, flat(33, 33, 9));
        Occluders o = occluders(view, boxes(64, 64, 2, {{16, 48, 16, 48}}));
        o.back = boxes(64, 64, 6, {{16, 48, 16, 48}});
        const Prepared prepared = engine().prepare(sun(20), o, OcclusionTexture{.slices = 8});
        const Mask mask = engine().shade(prepared, floor);
        // A front and a back at either end and all eight slices between.
        ASSERT_FALSE(mask.report.notes.empty());
        EXPECT_TRUE(holds(mask.report.notes[0], "8 occlusion textures hold anything")) << mask.report.notes[0];
        EXPECT_LT(mask.visibility.at(16, 16), 0.05f);
        EXPECT_EQ(mask.visibility.at(1, 1), 1.0f);
    }
}

// --- What is refused, and what is said -----------------

void expect_refused(const Scene& scene, const OcclusionTexture& s, ErrorCode code, const std::string& message, const std::string& hint)
{
    const Error error = error_of([&] { engine().mask(scene, s); });
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_TRUE(holds(error.what(), message)) << error.what();
    EXPECT_TRUE(holds(error.hint(), hint)) << error.what() << " / " << error.hint();
}

// A disc counts as the square of its variance.
TEST(SlicesAgainstRays, ASphereIsItsSquare)
{
    const std::vector<TriangleMesh> casters = {ball({0, 0, 4}, 1, 64, 128)};
    const Scene sphere = scene_of(sphere_light(0.5), casters, floor_at(8, 96)),
                square = scene_of(rectangle_light(std::sqrt(0.75) * 0.5, std::sqrt(0.75) * 0.5), casters, floor_at(8, 96));
    const Image mask = mask_of(sphere, OcclusionTexture{});
    EXPECT_EQ(mask.pixels, mask_of(square, OcclusionTexture{}).pixels);
    const Metrics m = compare(mask, mask_of(sphere, RayTraced{.samples = 1024}));
    record("a ball under a sphere light", m);
    EXPECT_LT(m.mae_shadow, 0.03); // of the disc: .01; the rest is what layers make of a ball
}

// Beyond the last caster every slice counts in full, however thick it is: the plate lies .05 above the floor, in a slice of .19.
TEST(SlicesAgainstRays, APlateJustAboveTheFloorHasItsUmbra)
{
    const std::vector<TriangleMesh> casters = {sheet(-3, -2.5, -0.25, 0.25, 5), sheet(-1, 1, -1, 1, 7.95)};
    const Scene scene = scene_of(rectangle_light(0.5, 0.5), casters, floor_at(8, 96, 2));
    for (const bool known : {true, false}) {
        const Receivers floor = with_depth(scene, OcclusionTexture{}).receivers;
        const Prepared prepared = known ? engine().prepare(scene, OcclusionTexture{})
                                        : engine().prepare(scene.light, scene.occluders, Geometry(scene.objects), OcclusionTexture{});
        const Image mask = engine().shade(prepared, floor).visibility;
        EXPECT_LT(mask.at(48, 48), 1e-4F) << known; // the rounding of a table's sums
        const Metrics m = compare(mask, mask_of(scene, RayTraced{.samples = 1024}));
        record(known ? "plate above the floor" : "plate above any receivers", m);
        EXPECT_LT(m.mae_shadow, 0.03);
    }
}

TEST(SlicesErrors, LightsThatItCannotTake)
{
    const auto scene = [](const Light& light) { return scene_of(light, {sheet(-1, 1, -1, 1, 4)}, floor_at(8, 8)); };
    RectangleLight textured = rectangle_light(1, 1);
    textured.emission = Image{.width = 1, .height = 1, .channels = 1, .pixels = {1.0f}};
    expect_refused(scene(textured), {}, ErrorCode::unsupported, "occlusion_texture cannot take a textured light", "");
    const Prepared prepared = engine().prepare(scene(rectangle_light(1, 1)), OcclusionTexture{});
    EXPECT_EQ(error_of([&] { engine().with_emission(prepared, *textured.emission); }).code(), ErrorCode::unsupported);
}

TEST(SlicesErrors, SettingsThatDoNotGoTogether)
{
    const auto scene = [](const Light& light) { return scene_of(light, {sheet(-1, 1, -1, 1, 4)}, floor_at(8, 8)); };
    Scene under_sun = scene(sun(1));
    under_sun.receivers = receivers(LightCamera{.tan_half_fov = {}, .half_extent = Vec2(4, 4), .center = {}}, flat(8, 8, 20));
    expect_refused(under_sun, {.light_splits = 2}, ErrorCode::invalid_input, "technique.light_splits: is 2", "only rectangles are split");
    expect_refused(under_sun, {.placement = Placement::reciprocal}, ErrorCode::invalid_input, "technique.placement: is reciprocal",
                   "uniform or occupied");
    for (const Combine combine : {Combine::sum, Combine::layered, Combine::layered_max})
        expect_refused(scene(rectangle_light(1, 1)), {.combine = combine, .leak_fix = true}, ErrorCode::invalid_input, "technique.leak_fix",
                       "combine product or max");
}

TEST(SlicesErrors, NumbersOutOfRange)
{
    for (const auto& [key, value] : {std::pair{"slices", 0},
                                     {"slices", 65},
                                     {"resolution", 3},
                                     {"resolution", 4097},
                                     {"layers", 0},
                                     {"layers", 9},
                                     {"light_splits", 17}}) {
        const Error error = error_of([&, k = std::string(key), v = value] {
            technique_from({.kind = "occlusion_texture", .settings = {{k, std::int64_t{v}}}});
        });
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_TRUE(holds(error.what(), "technique." + std::string(key)) && holds(error.what(), std::to_string(value)))
            << error.what();
    }
}

TEST(SlicesErrors, NothingThatCasts)
{
    Scene scene = scene_of(rectangle_light(1, 1), {}, floor_at(8, 8));
    expect_refused(scene, {}, ErrorCode::invalid_input, "occlusion_texture needs objects that cast or occluders.depth.front", "");
    // Empty meshes and an empty map: nothing casts, with a warning.
    scene.objects.push_back(wedges::casting({}));
    const Mask empty = engine().mask(scene, OcclusionTexture{});
    for (const float v : empty.visibility.pixels) EXPECT_EQ(v, 1.0f);
    EXPECT_FALSE(empty.report.warnings.empty());
    for (const float v : map_mask(rectangle_light(1, 1), occluders(light_view(), flat(8, 8, nothing_there)), floor_at(8, 8)).pixels)
        EXPECT_EQ(v, 1.0f);
}

// Thinner than a texel's line can meet: slices with nothing in them.
TEST(SlicesErrors, SlicesThatHoldNothing)
{
    const Scene scene = scene_of(rectangle_light(1, 1), {mesh_of({{-1, -1, 4}, {1, 1, 5}, {-1, -1, 4}}, {{0, 1, 2}})}, floor_at(8, 8));
    for (const Prefilter prefilter : {Prefilter::nbuffer, Prefilter::mipmap, Prefilter::summed_area})
        for (const float v : mask_of(scene, OcclusionTexture{.prefilter = prefilter}).pixels) EXPECT_EQ(v, 1.0f);
}

TEST(SlicesErrors, MapsOfOtherSizesAndDeviceBuffers)
{
    Occluders o = occluders(light_view(), flat(8, 8, 4));
    o.layers = {flat(8, 7, 5)};
    const Error size = error_of([&] { engine().prepare(rectangle_light(1, 1), o, OcclusionTexture{}); });
    EXPECT_EQ(size.code(), ErrorCode::invalid_input);
    EXPECT_TRUE(holds(size.what(), "occluders.depth.layers[0]")) << size.what();
    const Error device = error_of([&] { engine().prepare(rectangle_light(1, 1), DeviceOccluders{}, OcclusionTexture{}); });
    EXPECT_EQ(device.code(), ErrorCode::unsupported);
    EXPECT_TRUE(holds(device.message(), "occlusion_texture") && holds(device.hint(), "depth maps in memory")) << device.what();
}

// What the hint names does fit.
TEST(SlicesErrors, TooLargeForTheDeviceNamesWhatFits)
{
    const Scene scene = scene_of(rectangle_light(4, 4), {ball({0, 0, 4}, 1, 32, 64)}, floor_at(8, 8));
    OcclusionTexture s{.slices = 64, .resolution = 4096, .storage = LevelStorage::binary32};
    const Error error = error_of([&] { engine().mask(scene, s); });
    EXPECT_EQ(error.code(), ErrorCode::too_large);
    EXPECT_TRUE(holds(error.what(), "64 slices of 4096 texels each way take") && holds(error.what(), "the device allows"))
        << error.what();
    int resolution = 0, slices = 0;
    ASSERT_EQ(std::sscanf(error.hint().c_str(), "a resolution of %d would fit, or %d slices", &resolution, &slices), 2) << error.hint();
    EXPECT_GT(resolution, 4);
    EXPECT_LT(resolution, 4096);
    EXPECT_GE(slices, 1);
    EXPECT_LT(slices, 64);
    std::printf("[  MEASURE ] %s\n", error.what());
    // A texel more each way would not fit.
    s.resolution = resolution + 1;
    EXPECT_EQ(error_of([&] { engine().mask(scene, s); }).code(), ErrorCode::too_large);
}

} // namespace
} // namespace penumbra::test
