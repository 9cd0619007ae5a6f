// Soft shadow volumes through the engine: closed forms, symmetry, odd lights, what the engine says and refuses.
#include <map>

#include "engine/soft_shadow_volume_scenes.hpp"

namespace penumbra::test::wedges {
namespace {

// --- Closed forms ---------------------------------------------------------------------------------------------------------------------

// V = 1 - the sum over sheets that do not overlap of the product over axes of overlap([l0, l1], [-H, H]) / 2H, l = (o z_p - p z_o) / (z_p -
// z_o).
TEST(WedgesClosedForm, RectanglesBeforeARectangle)
{
    const std::vector<std::array<double, 4>> all = {{-1.5, 0.5, -1, 1.25}, {1, 2.5, -2, 0.5}, {-3, -2, -3, 3}, {0.75, 3, 1.5, 2}};
    const double z_o = 4, z_p = 8;
    for (const auto& [half_u, half_v] : {std::pair{1.0, 1.0}, {0.5, 2.0}, {2.0, 0.5}})
        for (std::size_t count = 1; count <= all.size(); ++count) {
            std::vector<TriangleMesh> casters;
            for (std::size_t i = 0; i < count; ++i) casters.push_back(sheet(all[i][0], all[i][1], all[i][2], all[i][3], z_o));
            const Image mask = mask_of(scene_of(rectangle_light(half_u, half_v), casters, floor_at(static_cast<float>(z_p))));
            int penumbra = 0;
            double worst = 0;
            for (int y = 0; y < 64; ++y)
                for (int x = 0; x < 64; ++x) {
                    const double p_x = ((2 * x + 1.0) / 64 - 1) * z_p, p_y = (1 - (2 * y + 1.0) / 64) * z_p;
                    const auto overlap = [&](double o0, double o1, double p, double H) {
                        const double l0 = (o0 * z_p - p * z_o) / (z_p - z_o), l1 = (o1 * z_p - p * z_o) / (z_p - z_o);
                        return std::max(0.0, std::min(l1, H) - std::max(l0, -H)) / (2 * H);
                    };
                    double expected = 1;
                    for (std::size_t i = 0; i < count; ++i)
                        expected -= overlap(all[i][0], all[i][1], p_x, half_u) * overlap(all[i][2], all[i][3], p_y, half_v);
                    penumbra += expected > 0 && expected < 1;
                    worst = std::max(worst, std::abs(mask.at(x, y) - expected));
                }
            EXPECT_LE(worst, bound_of(count, 40)) << count << " sheets, light " << half_u;
            EXPECT_GT(penumbra, 300);
        }
}

// A half-plane's edge and the disc that faces the receiver: the plane through receiver and edge passes the centre at a sine of s, which on
// the disc is a distance of t = L s / (R cos), L the receiver's; beyond it lies a circular segment.
TEST(WedgesClosedForm, HalfPlanesBeforeASphere)
{
    for (const double radius : {0.5, 1.5})
        for (const double far : {4.0, 5.5}) { // parallel to the light's plane; tilted
            const Vec3 a(0.25, -30, 4), b(0.25, 30, far);
            const TriangleMesh half = mesh_of({a, b, Vec3(60, 30, far), Vec3(60, -30, 4)}, {{0, 2, 1}, {0, 3, 2}});
            const Image mask = mask_of(scene_of(sphere_light(radius), {half}, floor_at(8)));
            int penumbra = 0;
            double worst = 0;
            for (int y = 16; y < 48; ++y)
                for (int x = 0; x < 64; ++x) {
                    const Vec3 p(((2 * x + 1.0) / 64 - 1) * 8, (1 - (2 * y + 1.0) / 64) * 8, 8);
                    // The centre's distance from the edge's plane, positive where it lies on the sheet's side: the line on the disc is as
                    // far from it.
                    const Vec3 normal = (a - p).cross(b - p).normalized();
                    const double away = normal.dot(-p) * (normal.dot(Vec3(30, 0, 4) - p) > 0 ? 1 : -1), sine = away / p.length();
                    const double t = std::clamp(-away / std::sqrt(1 - sine * sine) / radius, -1.0, 1.0);
                    const double lit = 1 - (std::acos(t) - t * std::sqrt(1 - t * t)) / pi;
                    penumbra += lit > 0 && lit < 1;
                    worst = std::max(worst, std::abs(mask.at(x, y) - lit));
                }
            EXPECT_LE(worst, bound_of(1, 60 / radius)) << radius << ", " << far;
            EXPECT_GT(penumbra, 50);
        }
}

// --- Symmetry --------------------

std::vector<TriangleMesh> some_casters()
{
    return {closed_box({-1, -0.5, 3}, {1, 1, 4}),
            mesh_of({{-2, -1.5, 3}, {2, -1.5, 6}, {2, 1.5, 6.5}, {-2, 1.5, 3.5}}, {{0, 1, 2}, {0, 2, 3}}), torus_knot({1, 1, 5})};
}

std::vector<TriangleMesh> moved(std::vector<TriangleMesh> meshes, const std::function<Vec3(const Vec3&)>& map, bool turns_round = false)
{
    for (TriangleMesh& mesh : meshes) {
        for (Imath::V3f& p : mesh.positions) p = Imath::V3f(map(Vec3(p)));
        if (turns_round)
            for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
    }
    return meshes;
}

TEST(WedgesSymmetry, Scale)
{
    for (const bool sphere : {false, true}) {
        const auto at_scale = [&](double scale) {
            const Light light = sphere ? Light(sphere_light(0.5 * scale)) : Light(rectangle_light(0.75 * scale, 0.5 * scale));
            return mask_of(scene_of(light, moved(some_casters(), [scale](const Vec3& p) { return p * scale; }),
                                    floor_at(static_cast<float>(8 * scale), 48)));
        };
        const Image one = at_scale(1);
        for (const double scale : {0x1p-20, 0x1p20}) EXPECT_EQ(at_scale(scale).pixels, one.pixels) << scale;
        for (const double scale : {1e-6, 1e6}) {
            // Every vertex rounds anew, which moves its edges by the bound of one; thousands of edges, of which a receiver sees tens.
            const Metrics m = compare(at_scale(scale), one);
            EXPECT_LE(m.max, 2 * bound_of(10, 40)) << scale;
        }
    }
}

TEST(WedgesSymmetry, MirroredAndTurned)
{
    for (const auto& [kind, light, turned] :
         {std::tuple<std::string, Light, Light>{"rectangle", rectangle_light(0.75, 0.5), rectangle_light(0.5, 0.75)},
          {"sphere", sphere_light(0.5), sphere_light(0.5)}}) {
        const Image a = mask_of(scene_of(light, some_casters(), floor_at(8, 48)));
        const Image b = mask_of(scene_of(light,
                                         moved(
                                             some_casters(), [](const Vec3& p) { return Vec3(-p.x, p.y, p.z); }, true),
                                         floor_at(8, 48)));
        const Image c =
            mask_of(scene_of(turned, moved(some_casters(), [](const Vec3& p) { return Vec3(-p.y, p.x, p.z); }), floor_at(8, 48)));
        int penumbra = 0;
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 48; ++x) {
                EXPECT_NEAR(a.at(x, y), b.at(47 - x, y), 2 * bound_of(10, 40)) << kind << ", mirrored: " << x << ", " << y;
                // (x, y) turns to (-y, x): column 47 - row, row counted from the other end.
                EXPECT_NEAR(a.at(x, y), c.at(y, 47 - x), 2 * bound_of(10, 40)) << kind << ", turned: " << x << ", " << y;
                penumbra += a.at(x, y) > 0 && a.at(x, y) < 1;
            }
        EXPECT_GT(penumbra, 100);
    }
}

// --- Odd lights --------------------

// Lines, dots and lights of a hundred scenes: as near to the truth as any.
TEST(WedgesLights, OfEveryExtent)
{
    for (const auto& [half_u, half_v] : {std::pair{1.0, 0.0}, {0.0, 1.0}, {0.0, 0.0}, {1e-6, 1e-6}, {800.0, 800.0}, {1.0, 1e-9}}) {
        // Without a second edge a rectangle shines down (-Y), where the others shine along -Z.
        std::vector<TriangleMesh> casters = {sheet(-1.1, 1.3, -0.9, 1.7, 4)};
        if (half_v == 0) casters = moved(casters, [](const Vec3& p) { return Vec3(p.x, p.z, -p.y); });
        const Scene scene = scene_of(rectangle_light(half_u, half_v), casters, receivers(light_view(0.9), flat(61, 61, 8)));
        const Image mask = mask_of(scene);
        for (const float v : mask.pixels) ASSERT_TRUE(v >= 0 && v <= 1) << v;
        const Metrics m = compare(mask, mask_of(scene, RayTraced{.samples = 4096}));
        record("light of " + std::to_string(half_u) + " x " + std::to_string(half_v), m);
        EXPECT_LT(m.rmse_shadow, noise) << half_u << " x " << half_v;
        EXPECT_GT(half_u > 100 ? m.pixels : m.pixels_shadow, 100u);
    }
}

// What passes through the light is not what the technique is for: a visibility comes out all the same.
TEST(WedgesLights, TouchedAndCrossed)
{
    const std::vector<std::pair<std::string, TriangleMesh>> meshes = {
        {"a sheet that touches the light", mesh_of({{0.5, -1, 0}, {0.5, -1, 4}, {0.5, 1, 4}, {0.5, 1, 0}}, {{0, 1, 2}, {0, 2, 3}})},
        {"a sheet across the light", mesh_of({{0.5, -1, -2}, {0.5, -1, 4}, {0.5, 1, 4}, {0.5, 1, -2}}, {{0, 1, 2}, {0, 2, 3}})},
        {"a slanted sheet through the light's centre", mesh_of({{-2, -2, -1}, {2, -2, 1}, {2, 2, 1}, {-2, 2, -1}}, {{0, 1, 2}, {0, 2, 3}})},
        {"a closed box around the light", closed_box({-9, -9, -1}, {9, 9, 5})}};
    for (const auto& [name, mesh] : meshes)
        for (const auto& [kind, light] : {std::pair<std::string, Light>{"rectangle", rectangle_light(1, 1)}, {"sphere", sphere_light(1)}}) {
            const Scene scene = scene_of(light, {mesh}, floor_at(8));
            const Image mask = mask_of(scene);
            for (const float v : mask.pixels) ASSERT_TRUE(v >= 0 && v <= 1) << v;
            record(kind + ", " + name, compare(mask, mask_of(scene, RayTraced{.samples = 1024})));
        }
}

// --- What the engine says --------------------

std::string warnings_of(const Scene& scene)
{
    std::string all;
    for (const std::string& warning : engine().mask(scene, SoftShadowVolume{}).report.warnings) all += warning + "\n";
    return all;
}

TEST(WedgesWarnings, OfMeshes)
{
    const Receivers r = floor_at(8, 16);
    EXPECT_EQ(warnings_of(scene_of(rectangle_light(1, 1), {closed_box({-1, -1, 3}, {1, 1, 4})}, r)), "");
    EXPECT_TRUE(
        holds(warnings_of(scene_of(rectangle_light(1, 1), {sheet(-1, 1, -1, 1, 4)}, r)), "4 edges of the casters have one triangle alone"));
    const TriangleMesh fan = mesh_of({{0, -1, 4}, {0, 1, 4}, {1, 0, 3}, {-1, 0, 3}, {0.5, 0, 5}}, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}});
    EXPECT_TRUE(holds(warnings_of(scene_of(rectangle_light(1, 1), {fan}, r)), "1 edges of the casters have more than two triangles"));
    TriangleMesh box = closed_box({-1, -1, 3}, {1, 1, 4});
    box.triangles.push_back({0, 1, 1});
    EXPECT_EQ(warnings_of(scene_of(rectangle_light(1, 1), {box}, r)), "1 triangles without area were left out\n");
    const Scene behind = scene_of(rectangle_light(1, 1), {closed_box({-1, -1, -4}, {1, 1, -3})}, r);
    EXPECT_TRUE(holds(warnings_of(behind), "no triangle faces the light: nothing casts shadows"));
    for (const float v : mask_of(behind).pixels) EXPECT_EQ(v, 1.0F);
    // The light inside a closed box sees only backs.
    EXPECT_TRUE(
        holds(warnings_of(scene_of(rectangle_light(1, 1), {closed_box({-9, -9, -9}, {9, 9, 20})}, r)), "no triangle faces the light"));
}

TEST(WedgesErrors, LightsThatItCannotTake)
{
    const Scene sun = scene_of(DirectionalLight{.direction = {0, 0, -1}, .angular_diameter_deg = 0.5, .up = Vec3(0, 1, 0)},
                               {sheet(-1, 1, -1, 1, 4)}, floor_at(8));
    const Error error = error_of([&] { mask_of(sun); });
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_TRUE(holds(error.what(), "soft_shadow_volume cannot take a directional light")) << error.what();

    const Error split =
        error_of([&] { mask_of(scene_of(sphere_light(1), {sheet(-1, 1, -1, 1, 4)}, floor_at(8)), SoftShadowVolume{.light_splits = 2}); });
    EXPECT_EQ(split.code(), ErrorCode::invalid_input);
    EXPECT_TRUE(holds(split.what(), "technique.light_splits: is 2 and the light a sphere")) << split.what();

    const Error nothing = error_of([&] { mask_of(scene_of(rectangle_light(1, 1), {}, floor_at(8))); });
    EXPECT_EQ(nothing.code(), ErrorCode::invalid_input);
    EXPECT_TRUE(holds(nothing.what(), "needs objects that cast or occluders.depth.front")) << nothing.what();
}

} // namespace
} // namespace penumbra::test::wedges
