// A fitted view of the light without ground: its texels go to what casts, and nothing that receives is missed.
#include <algorithm>
#include <map>

#include <penumbra/mask_job.hpp>

#include "support/maps.hpp"

namespace penumbra::test {
namespace {

const Engine& engine()
{
    static const Engine shared;
    return shared;
}

Object quad(const Vec3& center, double half)
{
    Object object{.name = "quad", .mesh = {}};
    for (const auto& [x, z] : {std::pair{-half, half}, {half, half}, {half, -half}, {-half, -half}}) object.mesh.positions.emplace_back(center + Vec3(x, 0, z));
    object.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return object;
}

// A camera that looks straight down from a height of 6.
constexpr int pixels = 96;
Receivers from_above(double half_extent)
{
    const PinholeCamera above{.frame = {.origin = {0, 6, 0}, .x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}}, .tan_half_fov = {half_extent, half_extent}};
    return {.camera = above, .width = pixels, .height = pixels, .depth = {}, .surface = {}};
}

// A plate of side 1 hangs at a height of 1 over a floor of side 40, below a lamp at 5.
Scene plate_over_floor()
{
    return {.light = RectangleLight{.center = {0, 5, 0}, .half_u = {.2, 0, 0}, .half_v = {0, 0, -.2}, .emission = {}},
            .objects = {quad({0, 0, 0}, 20), quad({0, 1, 0}, .5)},
            .occluders = {.camera = LightCamera{}, .width = 64, .height = 64, .front = {}, .back = {}, .layers = {}},
            .receivers = from_above(.3),
            .technique = {},
            .output = {},
            .warnings = {}};
}

// The share of the square lamp that the plate leaves, seen from the floor at y (README of the closed forms: overlap on each axis).
double truth(const Vec3& p, double y)
{
    double hidden = 1;
    for (const double at : {p.x, p.z}) {
        const auto edge = [&](double plate) { return at + (plate - at) * (5 - y) / (1 - y); };
        hidden *= std::clamp((std::min(edge(.5), .2) - std::max(edge(-.5), -.2)) / .4, 0., 1.);
    }
    return 1 - hidden;
}

double error_on(const Mask& mask, double y)
{
    double sum = 0, shadow = 0;
    for (int row = 0; row < pixels; ++row)
        for (int column = 0; column < pixels; ++column) {
            const double reach = .3 * (6 - y), x = (2 * (column + .5) / pixels - 1) * reach, z = (2 * (row + .5) / pixels - 1) * reach;
            if (y == 0 && std::max(std::abs(x), std::abs(z)) < .6) continue; // the plate itself is in the way
            const double right = truth({x, y, z}, y);
            if (right > .999) continue;
            sum += std::abs(mask.visibility.at(column, row) - right);
            ++shadow;
        }
    return sum / shadow;
}

TEST(GroundIsLeftOut, AndTheTexelsGoToWhatCasts)
{
    const Scene scene = plate_over_floor();
    for (const Technique& technique : {Technique(SoftShadowMap{.sides = Sides::front}), Technique(ShadowMap{.filter = ShadowFilter::hard})}) {
        const Scene complete = with_depth(scene, technique);
        const auto& view = std::get<LightCamera>(complete.occluders.camera);
        EXPECT_NEAR(view.tan_half_fov->x, .5 / 4 * (1 + 2. / 64), 1e-6) << "the plate, and a texel beside it";
        EXPECT_EQ(engine().mask(scene, technique).visibility.pixels, engine().mask(complete, technique).visibility.pixels);
    }
    const Mask mask = engine().mask(scene, SoftShadowMap{.sides = Sides::front});
    EXPECT_LT(error_on(mask, 0), .02);
    EXPECT_TRUE(mask.report.warnings.empty()) << mask.report.warnings.front();

    // With the floor in its view the plate is less than two texels wide.
    const Prepared unknown = engine().prepare(scene.light, scene.occluders, Geometry(scene.objects), SoftShadowMap{.sides = Sides::front});
    EXPECT_GT(error_on(engine().shade(unknown, with_depth(scene.receivers, scene.light, Geometry(scene.objects))), 0), .1);
}

// The share of receivers that see some of the light. Micro-patches at different depths leave gaps between them: at the plate's outline.
double lit_share(const Image& mask)
{
    return static_cast<double>(std::ranges::count_if(mask.pixels, [](float v) { return v > 0; })) / static_cast<double>(mask.pixels.size());
}

// Receivers whose own depth shows a cellar: the floor casts on it.
TEST(GroundIsLeftOut, UnlessAReceiverLiesBehindIt)
{
    Scene scene = plate_over_floor();
    scene.receivers.depth = flat(pixels, pixels, 8);
    for (const Technique& technique : {Technique(SoftShadowMap{.sides = Sides::front}), Technique(ShadowMap{.filter = ShadowFilter::hard}), Technique(Smoothie{})}) {
        const Mask mask = engine().mask(scene, technique);
        EXPECT_LT(lit_share(mask.visibility), .05) << kind_of(technique);
    }
}

// Keeps what is prepared for one light, as services do.
class Keeper : public MaskKeeper {
public:
    std::optional<Prepared> prepared(std::size_t, int) override { return kept; }
    std::optional<Prepared> prepared_in_any_frame(std::size_t) override { return std::nullopt; }
    void keep(std::size_t, int, const Prepared& prepared) override
    {
        kept = prepared;
        ++times;
    }
    std::shared_ptr<const Receivers> receivers() override { return nullptr; }
    void keep(std::shared_ptr<const Receivers>) override {}

    std::optional<Prepared> kept;
    int times = 0;
};

TEST(GroundIsLeftOut, WhatWasPreparedForOtherReceiversIsPreparedAnew)
{
    const Scene above = plate_over_floor();
    Scene below = above;
    below.receivers.depth = flat(pixels, pixels, 8);
    const Technique technique = SoftShadowMap{.sides = Sides::front};
    Keeper keeper;
    std::vector<Image> masks;
    for (const Scene& scene : {above, above, below, above}) {
        const MaskJob job = job_of(scene, technique);
        engine().masks(job, {.keeper = &keeper, .before = {}}, [&](NamedMask&& named) { masks.push_back(std::move(named.mask.visibility)); });
    }
    EXPECT_EQ(keeper.times, 2);
    EXPECT_EQ(masks[0].pixels, masks[1].pixels);
    EXPECT_LT(lit_share(masks[2]), .05);

    // Who shades such receivers by hand is warned.
    const Mask mask = engine().shade(engine().prepare(above, technique), below.receivers);
    ASSERT_FALSE(mask.report.warnings.empty());
    EXPECT_TRUE(holds(mask.report.warnings.front() + mask.report.warnings.back(), "behind ground")) << mask.report.warnings.front();
}

} // namespace
} // namespace penumbra::test
