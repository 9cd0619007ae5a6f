// Meshes as other programs write them, from the file to the mask.
#include <cmath>
#include <fstream>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/command.hpp"
#include <penumbra/image.hpp>

namespace penumbra::test {
namespace {

using Json = nlohmann::json;

// A point light 4 above a floor; the mesh is half-way, so its shadow is twice as large. The floor's view spans -2 to 2.
class MeshCommand : public CommandTest {
protected:
    Ran mask_of(const Json& object, const std::string& technique)
    {
        Json mesh = object;
        mesh["receives"] = false;
        const Json scene = {
            {"penumbra", 1},
            {"light", {{"kind", "point"}, {"center", {0, 4, 0}}}},
            {"objects", {mesh, {{"quad", {{"center", {0, 0, 0}}, {"half_u", {2, 0, 0}}, {"half_v", {0, 0, -2}}}}, {"casts", false}}}},
            {"occluders", {{"resolution", {512, 512}}}},
            {"receivers", {{"camera", {{"kind", "light"}, {"tan_half_fov", {0.5, 0.5}}}}, {"resolution", {128, 128}}}},
            {"technique", {{"kind", technique}}}};
        write_text(path("scene.json"), scene.dump());
        return penumbra({"mask", path("scene.json"), "-o", path("mask.exr")});
    }
    // The area on the floor that is in shadow.
    double shadow() const
    {
        const Image mask = read_image(path("mask.exr"));
        double dark = 0;
        for (const float v : mask.pixels) dark += 1 - v;
        return 16 * dark / static_cast<double>(mask.pixels.size());
    }
    // A square of side 1 at height 2 as OBJ with a cut-out that leaves a disc of a third of its width as a hole.
    void write_window() const
    {
        Image picture{.width = 64, .height = 64, .channels = 4, .pixels = {}};
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x)
                picture.pixels.insert(picture.pixels.end(), {1, 1, 1, std::hypot(x - 31.5, y - 31.5) < 64.0 / 3 ? 0.0f : 1.0f});
        write_image(path("a window.png"), picture, {"png", 8});
        write_text(path("window.mtl"), "newmtl pane\nmap_d a window.png\n");
        write_text(path("window.obj"), "mtllib window.mtl\nv -.5 2 .5\nv .5 2 .5\nv .5 2 -.5\nv -.5 2 -.5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                                       "usemtl pane\nf 1/1 2/2 3/3 4/4\n");
    }
};

TEST_F(MeshCommand, CutOutsCastAsTheyAreCut)
{
    write_window();
    const double square = 4, hole = 4 * std::numbers::pi / 9;
    for (const std::string technique : {"ray_traced", "shadow_map", "soft_shadow_map", "smoothie"}) {
        const Ran ran = mask_of({{"mesh", "window.obj"}}, technique);
        ASSERT_EQ(ran.code, 0) << ran.err;
        EXPECT_NEAR(shadow(), square - hole, 0.06) << technique;
        EXPECT_EQ(ran.err.find("window.obj has"), std::string::npos) << ran.err;
    }
    for (const std::string technique : {"soft_shadow_volume", "occlusion_texture"}) {
        const Ran ran = mask_of({{"mesh", "window.obj"}}, technique);
        ASSERT_EQ(ran.code, 0) << ran.err;
        EXPECT_NEAR(shadow(), square, 0.2) << technique;
        EXPECT_NE(ran.err.find("window.obj has materials that cut it out"), std::string::npos) << ran.err;
    }
}

TEST_F(MeshCommand, KeyholesFarFromTheOrigin)
{
    // A ring of two circles of 700 corners, joined by a cut, as one polygon of a survey: float32 has steps of half a unit there.
    std::ofstream out(path("ring.obj"));
    out << "\xef\xbb\xbf" << std::fixed;
    out.precision(9);
    for (const auto& [radius, sense] : {std::pair(0.8, -1), std::pair(0.4, 1)})
        for (int i = 0; i <= 700; ++i) {
            const double angle = sense * 2 * std::numbers::pi * i / 700;
            out << "v " << 4.5e6 + radius * std::cos(angle) << ' ' << 2 + 5.3e6 << ' ' << radius * std::sin(angle) - 1e6 << '\n';
        }
    out << 'f';
    for (int i = 1; i <= 1402; ++i) out << ' ' << i;
    out << '\n';
    out.close();
    const Ran ran = mask_of({{"mesh", "ring.obj"}, {"translate", {-4.5e6, -5.3e6, 1e6}}}, "ray_traced");
    ASSERT_EQ(ran.code, 0) << ran.err;
    EXPECT_NEAR(shadow(), 4 * std::numbers::pi * (0.64 - 0.16), 0.06);
}

TEST_F(MeshCommand, RequiredExtensionsAreRefusedInOneLine)
{
    write_text(path("a.gltf"), R"({"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"]})");
    expect_one_error(mask_of({{"mesh", "a.gltf"}}, "ray_traced"), 2, {"objects[0].mesh", "a.gltf", "KHR_draco_mesh_compression"});
    write_text(path("a.gltf"), R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "not%20there.bin"}]})");
    expect_one_error(mask_of({{"mesh", "a.gltf"}}, "ray_traced"), 2, {"objects[0].mesh", "not there.bin"});
}

TEST_F(MeshCommand, WeldJoinsASoup)
{
    // A square of two loose triangles, a millionth apart along their diagonal.
    write_text(path("soup.obj"), "v -.5 2 .5\nv .5 2 .5\nv .5 2 -.5\nv -.500001 2 .5\nv .5 2 -.500001\nv -.5 2 -.5\nf 1 2 3\nf 4 5 6\n");
    const Ran apart = mask_of({{"mesh", "soup.obj"}}, "soft_shadow_volume");
    EXPECT_NE(apart.err.find("soup.obj has cracks: 4 vertices"), std::string::npos) << apart.err;
    EXPECT_NE(apart.err.find("6 edges of the casters have one triangle alone"), std::string::npos) << apart.err;
    const Ran joined = mask_of({{"mesh", "soup.obj"}, {"weld", 2e-6}}, "soft_shadow_volume");
    EXPECT_EQ(joined.err.find("has cracks"), std::string::npos) << joined.err;
    EXPECT_NE(joined.err.find("soup.obj has 2 vertices that were joined with others within 2e-06"), std::string::npos) << joined.err;
    EXPECT_NE(joined.err.find("4 edges of the casters have one triangle alone"), std::string::npos) << joined.err;
    EXPECT_NEAR(shadow(), 4, 0.1);
}

} // namespace
} // namespace penumbra::test
