// What holds for every technique that there is, walked by the table: its range, the same bits again, what it takes and what it refuses.
#include <algorithm>

#include <malloc.h>

#include <penumbra/describe.hpp>

#include "support/maps.hpp"

#include "scene/light_space.hpp"
#include "technique/table.hpp"

namespace penumbra::test {
namespace {

TriangleMesh level_quad(double x, double y, double half)
{
    const auto at = [&](double dx, double dz) {
        return Imath::V3f(static_cast<float>(x + dx * half), static_cast<float>(y), static_cast<float>(dz * half));
    };
    return {.positions = {at(-1, 1), at(1, 1), at(1, -1), at(-1, -1)}, .triangles = {{0, 1, 2}, {0, 2, 3}}};
}

const std::vector<Light> lights = {
    RectangleLight{.center = {0, 6, 0}, .half_u = {0.5, 0, 0}, .half_v = {0, 0, -0.3}, .emission = {}},
    SphereLight{.center = {0.2, 6, 0}, .radius = 0.4, .up = {}},
    PointLight{.center = {0, 6, 0.1}, .up = {}},
    DirectionalLight{.direction = {0.1, -1, 0.2}, .angular_diameter_deg = 4, .up = {}},
};

// A plate at height `y` over a floor, seen by a camera of its own.
Scene plate_over_floor(const Light& light, double y = 2, int width = 31, int height = 17)
{
    Scene scene;
    scene.light = light;
    scene.objects.push_back({.name = "plate", .mesh = level_quad(0.2, y, 0.8), .casts = true, .receives = false});
    scene.objects.push_back({.name = "floor", .mesh = level_quad(0, 0, 3), .casts = false, .receives = true});
    scene.occluders.width = scene.occluders.height = 64;
    scene.receivers = {.camera = PinholeCamera{.frame = {.origin = {0, 9, 0}, .x = {1, 0, 0}, .y = {0, 0, -1}, .z = {0, 1, 0}},
                                               .tan_half_fov = {0.4, 0.3}},
                       .width = width,
                       .height = height,
                       .depth = {}};
    return scene;
}

bool takes(const TechniqueRow& row, const std::string& kind)
{
    return std::find(row.lights.begin(), row.lights.end(), kind) != row.lights.end();
}

TEST(EveryTechnique, TakesTheLightsOfItsRowAndRefusesTheOthersByName)
{
    const Engine engine;
    for (const TechniqueRow& row : technique_table())
        for (const Light& light : lights) {
            const std::string kind = kind_of(light);
            SCOPED_TRACE(std::string(row.kind) + " under a " + kind);
            if (takes(row, kind)) {
                const Mask mask = engine.mask(plate_over_floor(light), row.defaults);
                EXPECT_EQ(mask.visibility.width, 31);
                EXPECT_EQ(mask.visibility.height, 17);
                // The plate hides some of the floor, and not all of it.
                const auto [darkest, brightest] = std::ranges::minmax(mask.visibility.pixels);
                EXPECT_LT(darkest, 0.5F);
                EXPECT_EQ(brightest, 1.0F);
                continue;
            }
            try {
                engine.mask(plate_over_floor(light), row.defaults);
                ADD_FAILURE() << "taken, though its row does not say so";
            } catch (const Error& error) {
                EXPECT_EQ(error.code(), ErrorCode::unsupported);
                EXPECT_EQ(error.path(), "light.kind");
                EXPECT_TRUE(holds(error.message(), std::string(row.kind) + " cannot take a " + kind + " light")) << error.what();
            }
        }
}

// Depth is known to a share of the distance from the camera, and rounding is one of the camera's place: with a camera far away both are more than the few units
// in the last place of the receiver's distance from the light.
TEST(EveryTechnique, LeavesALitPlaneThatCastsAloneFromHoweverFarItIsSeen)
{
    const Engine engine;
    for (const TechniqueRow& row : technique_table())
        for (const Light& light : lights)
            for (const double distance : {6., 60., 600., 6000.}) {
                const std::string kind = kind_of(light);
                if (!takes(row, kind)) continue;
                Scene scene = plate_over_floor(light);
                scene.objects.erase(scene.objects.begin());
                scene.objects.front().casts = true;
                scene.receivers.camera = PinholeCamera{.frame = {.origin = {0, distance * 0.8, distance * 0.6}, .x = {1, 0, 0}, .y = {0, 0.6, -0.8}, .z = {0, 0.8, 0.6}},
                                                       .tan_half_fov = {2 / distance, 2 / distance}};
                // Every receiver by itself: a tolerance would see that nothing casts on any.
                Technique technique = row.defaults;
                for (const SettingKey& key : row.keys)
                    if (key.name == "tolerance") key.set(technique, 0.);
                EXPECT_GE(std::ranges::min(engine.mask(scene, technique).visibility.pixels), 0.999F) << row.kind << " under a " << kind << " from " << distance << " units";
            }
}

TEST(EveryTechnique, WithEveryChoiceGivesVisibilityFromZeroToOne)
{
    const Engine engine;
    int masks = 0;
    for (const Technique& technique : technique_choices())
        for (const Light& light : lights) {
            const TechniqueRow& row = row_of(kind_of(technique));
            if (!takes(row, kind_of(light))) continue;
            try {
                const Mask mask = engine.mask(plate_over_floor(light), technique);
                for (const float v : mask.visibility.pixels) ASSERT_TRUE(v >= 0 && v <= 1) << row.kind << ": " << v;
                ++masks;
            } catch (const Error& error) {
                // A choice that does not go with this light says which.
                EXPECT_EQ(error.code(), ErrorCode::invalid_input) << error.what();
                EXPECT_TRUE(error.path().starts_with("technique.")) << error.what();
            }
        }
    EXPECT_GT(masks, 100);
}

// What memory holds before it is written: this byte's complement, where the C library can be told so. Devices on the CPU allocate by it.
void fill_new_memory(int byte)
{
#ifdef M_PERTURB
    mallopt(M_PERTURB, byte);
#else
    static_cast<void>(byte);
#endif
}

// Whatever was in its memory before: what is read was written. Receivers close to what casts, and so far behind it that hardly a digit of its depth is left.
TEST(EveryTechnique, GivesTheSameBitsAgain)
{
    const Engine engine;
    int masks = 0;
    for (const Technique& technique : technique_choices())
        for (const Light& light : lights)
            for (const double down : {0., 30.}) {
                const TechniqueRow& row = row_of(kind_of(technique));
                if (!takes(row, kind_of(light))) continue;
                Scene scene = plate_over_floor(light);
                scene.objects.back().mesh = level_quad(0, -down, 3 + down);
                try {
                    fill_new_memory(85);
                    const Mask once = engine.mask(scene, technique);
                    fill_new_memory(165);
                    EXPECT_EQ(once.visibility.pixels, engine.mask(scene, technique).visibility.pixels) << row.kind << " under a " << kind_of(light) << ", " << down << " below";
                    ++masks;
                } catch (const Error& error) {
                    EXPECT_EQ(error.code(), ErrorCode::invalid_input) << error.what(); // a choice that does not go with this light
                }
            }
    fill_new_memory(0);
    EXPECT_GT(masks, 200);
}

// A plate above the light is behind its plane.
TEST(EveryTechnique, IsLitWhereWhatCastsIsBehindTheLight)
{
    const Engine engine;
    for (const TechniqueRow& row : technique_table()) {
        Scene scene = plate_over_floor(lights.front(), 8);
        scene.occluders.camera = LightCamera{.tan_half_fov = Vec2(0.6, 0.6), .half_extent = {}, .center = {}};
        for (const float v : engine.mask(scene, row.defaults).visibility.pixels) ASSERT_EQ(v, 1) << row.kind;
    }
}

TEST(EveryTechnique, TakesImagesOfAnySize)
{
    const Engine engine;
    for (const TechniqueRow& row : technique_table())
        for (const auto& [width, height] : {std::pair{1, 1}, {1, 61}, {61, 1}, {7, 61}, {17, 16}}) {
            const Mask mask = engine.mask(plate_over_floor(lights.front(), 2, width, height), row.defaults);
            EXPECT_EQ(mask.visibility.pixels.size(), static_cast<std::size_t>(width * height)) << row.kind;
            for (const float v : mask.visibility.pixels) ASSERT_TRUE(v >= 0 && v <= 1) << row.kind << ": " << v;
        }
}

} // namespace
} // namespace penumbra::test
