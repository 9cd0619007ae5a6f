// penumbra mask over meshes as people have them, closed, open and tangled: soft_shadow_volume beside rays.
#include <algorithm>
#include <cstdio>
#include <map>
#include <sstream>
#include <tuple>

#include <nlohmann/json.hpp>

#include <penumbra/metrics.hpp>
#include <penumbra/scene.hpp>

#include "command.hpp"
#include "io/mesh_io.hpp"
#include "scene/camera.hpp"

namespace penumbra::test {
namespace {

const std::string models = PENUMBRA_TEST_MODELS;
const std::string glmark2 = std::string(PENUMBRA_BUNNY).substr(0, std::string(PENUMBRA_BUNNY).rfind('/'));

struct Model {
    std::string name, path;
    std::uint64_t open, tangled; // edges of one triangle, and of more than two: what is known of the file
    double single = 0.1;         // limit of the mean error with one silhouette for all of the light
};

void PrintTo(const Model& model, std::ostream* out) { *out << model.path; }

// Edges of one triangle and of more than two, counted without our topology. Triangles without area are no part of the surface.
std::pair<std::uint64_t, std::uint64_t> odd_edges(const TriangleMesh& mesh)
{
    std::map<std::tuple<float, float, float>, int> places;
    const auto place = [&](std::uint32_t vertex) {
        const Imath::V3f& p = mesh.positions[vertex];
        return places.try_emplace({p.x, p.y, p.z}, static_cast<int>(places.size())).first->second;
    };
    std::map<std::pair<int, int>, int> uses;
    for (const auto& t : mesh.triangles) {
        const Vec3 a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
        if ((b - a).cross(c - a) == Vec3(0, 0, 0)) continue;
        for (std::size_t k = 0; k < 3; ++k) {
            const int from = place(t[k]), to = place(t[(k + 1) % 3]);
            ++uses[std::minmax(from, to)];
        }
    }
    std::pair<std::uint64_t, std::uint64_t> odd;
    for (const auto& [edge, count] : uses) {
        odd.first += count == 1;
        odd.second += count > 2;
    }
    return odd;
}

// The light is a square of side 1, or the sphere in it, 8 above the floor; the mesh fills a cube of side 2 half-way.
constexpr double light_height = 8, light_half = 0.5, mesh_height = 3, tangent = 0.5;
constexpr int pixels = 128;

class ModelCommand : public CommandTest, public ::testing::WithParamInterface<Model> {
protected:
    // Writes the scene with this light, the mesh fitted into its cube; returns its path.
    std::string write_model_scene(const std::string& name, const std::string& light) const
    {
        const Imath::Box3d box = bounds(read_mesh(GetParam().path, "mesh"));
        const Vec3 size = box.size();
        const double scale = 2 / std::max({size.x, size.y, size.z});
        const Vec3 to = Vec3(0, mesh_height, 0) - box.center() * scale;
        const nlohmann::json view = {{"kind", "light"}, {"tan_half_fov", {tangent, tangent}}};
        const nlohmann::json scene = {
            {"penumbra", 1},
            {"light", nlohmann::json::parse(light)},
            {"objects",
             {{{"mesh", GetParam().path}, {"scale", scale}, {"translate", {to.x, to.y, to.z}}, {"receives", false}},
              {{"quad", {{"center", {0, 0, 0}}, {"half_u", {4, 0, 0}}, {"half_v", {0, 0, -4}}}}, {"casts", false}}}},
            {"receivers", {{"camera", view}, {"resolution", {pixels, pixels}}}},
        };
        write_text(path(name), scene.dump(2));
        return path(name);
    }

    // The mask by these flags; the report's warnings come along.
    Image mask_of(const std::string& scene, const std::string& technique, const std::vector<std::string>& settings,
                  std::vector<std::string>* warnings = nullptr) const
    {
        Arguments arguments{"mask", scene, "-o", path("mask.exr"), "--technique", technique, "--report", path("report.json")};
        for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
        const Ran ran = penumbra(arguments);
        EXPECT_EQ(ran.code, 0) << ran.err;
        if (ran.code != 0) return {};
        if (warnings) *warnings = nlohmann::json::parse(text_of(path("report.json"))).at("warnings").get<std::vector<std::string>>();
        return read_image(path("mask.exr"));
    }

    Metrics record(const std::string& what, const Image& mask, const Image& rays) const
    {
        const Metrics m = compare(mask, rays);
        std::printf("[  MEASURE ] %s, %s: mae %.4f rmse %.4f bias %+.4f max %.3f (%llu pixels of shadow)\n", GetParam().name.c_str(),
                    what.c_str(), m.mae_shadow, m.rmse_shadow, m.bias_shadow, m.max, static_cast<unsigned long long>(m.pixels_shadow));
        return m;
    }
};

const std::string square = R"({"kind": "rectangle", "center": [0, 8, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5])";
const std::string sphere = R"({"kind": "sphere", "center": [0, 8, 0], "radius": 0.5})";
const std::vector<std::string> many_rays{"samples=256"};

// One silhouette for all of the light: the papers' figures stay below a tenth, whether the surface is closed or not. Where surfaces lie in
// layers, `overlap` = sum adds what hides the same light: two layers make min(1, 2 o) of o, a quarter too much on average where a penumbra
// takes all values alike. So the engine, whose parts lie one in the other, has a tenth and a quarter.
constexpr double layered = 0.1 + 0.25;

// What 256 stratified rays are themselves off by, on average (the bunny: .0038, by `penumbra_bench wedges`).
constexpr double noise = 0.005;

// Where on the floor no line to the light passes the mesh's bounding box, by half a pixel at least, all of the light is seen to the bit:
// no edge is on the light there, and no triangle before its centre.
void expect_lit_outside(const Image& mask, const Imath::Box3d& box)
{
    Imath::Box2d shadow;
    for (int corner = 0; corner < 8; ++corner)
        for (const double light_x : {-light_half, light_half})
            for (const double light_z : {-light_half, light_half}) {
                const Vec3 at(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y, corner & 4 ? box.max.z : box.min.z);
                const double along = light_height / (light_height - at.y);
                shadow.extendBy(Vec2(light_x + (at.x - light_x) * along, light_z + (at.z - light_z) * along));
            }
    const double pixel = 2 * tangent * light_height / pixels;
    int outside = 0, dark = 0;
    for (int y = 0; y < mask.height; ++y)
        for (int x = 0; x < mask.width; ++x) {
            const Vec2 at((x + 0.5 - pixels / 2) * pixel, (y + 0.5 - pixels / 2) * pixel); // image x is world x, down is world z
            if (at.x > shadow.min.x - pixel / 2 && at.x < shadow.max.x + pixel / 2 && at.y > shadow.min.y - pixel / 2 &&
                at.y < shadow.max.y + pixel / 2)
                continue;
            ++outside;
            for (int c = 0; c < mask.channels; ++c) dark += mask.at(x, y, c) != 1;
        }
    EXPECT_GT(outside, pixels * pixels / 8) << "the scene leaves nothing to look at";
    EXPECT_EQ(dark, 0) << "of " << outside;
}

void expect_visibility(const Image& mask)
{
    ASSERT_EQ(mask.pixel_count(), static_cast<std::size_t>(pixels * pixels));
    for (const float v : mask.pixels) ASSERT_TRUE(v >= 0 && v <= 1) << v;
    EXPECT_LT(*std::ranges::min_element(mask.pixels), 0.5F) << "there is no shadow";
}

TEST_P(ModelCommand, SaysHowTheSurfaceHangsTogether)
{
    const std::string scene = write_model_scene("scene.json", square + "}");
    EXPECT_EQ(odd_edges(read_mesh(GetParam().path, "mesh")), std::pair(GetParam().open, GetParam().tangled));

    // Placing a mesh rounds to float32 anew, which joins vertices of very fine ones.
    const auto [open, tangled] = odd_edges(load_scene(scene).objects.front().mesh);

    std::vector<std::string> warnings;
    (void)mask_of(scene, "soft_shadow_volume", {}, &warnings);
    const auto expect = [&](std::uint64_t count, const std::string& text) {
        const auto said = std::ranges::find_if(warnings, [&](const std::string& w) { return w.find(text) != std::string::npos; });
        ASSERT_EQ(said != warnings.end(), count > 0) << text;
        if (count > 0) {
            EXPECT_EQ(said->find(std::to_string(count) + text), 0u) << *said;
        }
    };
    expect(open, " edges of the casters have one triangle alone");
    expect(tangled, " edges of the casters have more than two triangles");
}

TEST_P(ModelCommand, AnalyticBesideRays)
{
    const std::string scene = write_model_scene("scene.json", square + "}");
    const Image rays = mask_of(scene, "ray_traced", many_rays);
    const Imath::Box3d box = bounds(load_scene(scene).objects.front().mesh);
    double single = 0, split = 0;
    for (const std::string overlap : {"sum", "max"}) {
        const auto with = [&](int splits) {
            const Image mask = mask_of(scene, "soft_shadow_volume", {"overlap=" + overlap, "light_splits=" + std::to_string(splits)});
            expect_visibility(mask);
            expect_lit_outside(mask, box);
            return record(overlap + ", " + std::to_string(splits) + " splits", mask, rays).mae_shadow;
        };
        if (overlap == "sum") {
            single = with(1);
            split = with(4);
            continue;
        }
        // Of sheets behind each other max keeps the one that hides most: both sides of one surface count once, surfaces apart from each
        // other come out too bright. The truth is near the one or the other; the limits are not derived: the engine, several layers of
        // open parts, has .12 and .043.
        EXPECT_LT(std::min(single, with(1)), 0.15);
        EXPECT_LT(std::min(split, with(4)), 0.05);
    }
    EXPECT_LT(single, GetParam().single);
    EXPECT_LT(split, single / 2 + noise) << "both artefacts fade with the parts of the light, whose width is a quarter";
}

TEST_P(ModelCommand, TextureBesideRays)
{
    Image checker{.width = 4, .height = 4, .channels = 3, .pixels = {}};
    for (int i = 0; i < 16; ++i) {
        const bool red = (i % 4 + i / 4) % 2 == 0;
        for (const float v : {red ? 1.0F : 0.0F, red ? 0.2F : 0.3F, red ? 0.0F : 1.0F}) checker.pixels.push_back(v);
    }
    write_image(path("checker.exr"), checker);
    const std::string scene = write_model_scene("scene.json", square + R"(, "emission": "checker.exr"})");
    const Image mask = mask_of(scene, "soft_shadow_volume", {"coverage=texture", "light_splits=2"});
    ASSERT_EQ(mask.channels, 3);
    expect_visibility(mask);
    const double error = record("checkered, 2 splits", mask, mask_of(scene, "ray_traced", many_rays)).mae_shadow;

    // The light's colours weigh what is hidden, but hide no more.
    const std::string plain = write_model_scene("plain.json", square + "}");
    const Image even = mask_of(plain, "soft_shadow_volume", {"light_splits=2"});
    EXPECT_LT(error, record("even, 2 splits", even, mask_of(plain, "ray_traced", many_rays)).mae_shadow + 2 * noise);
}

TEST_P(ModelCommand, LinearBesideRays)
{
    const std::string scene = write_model_scene("scene.json", sphere);
    const Image rays = mask_of(scene, "ray_traced", many_rays);
    for (const std::string coverage : {"analytic", "linear"}) {
        const Image mask = mask_of(scene, "soft_shadow_volume", {"coverage=" + coverage});
        expect_visibility(mask);
        const double error = record("sphere, " + coverage, mask, rays).mae_shadow;
        // Linear wedges take around fine detail what they like (docs/soft_shadow_volume.md): no bound holds for them.
        if (coverage == "analytic") {
            EXPECT_LT(error, GetParam().single);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(
    Meshes, ModelCommand,
    ::testing::Values(Model{"bunny", PENUMBRA_BUNNY, 0, 0}, Model{"horse", glmark2 + "/horse.3ds", 0, 24},
                      Model{"wuson_ply", models + "/PLY/Wuson.ply", 412, 0}, Model{"spider_obj", models + "/OBJ/spider.obj", 72, 0},
                      Model{"sphere_with_hole", models + "/STL/sphereWithHole.stl", 9, 0},
                      Model{"max_export", models + "/STL/3DSMaxExport.STL", 0, 16},
                      Model{"engine", models + "/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb", 13308, 0, layered},
                      Model{"box_gltf", models + "/glTF2/BoxTextured-glTF/BoxTextured.gltf", 0, 0},
                      Model{"fels", models + "/3DS/fels.3ds", 0, 0}),
    [](const auto& test) { return test.param.name; });

} // namespace
} // namespace penumbra::test
