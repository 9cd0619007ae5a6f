// penumbra mask and depth, with a device.
#include <nlohmann/json.hpp>

#include <penumbra/image.hpp>

#include "command.hpp"

namespace penumbra::test {
namespace {

class MaskCommand : public CommandTest {};

void expect_success(const Ran& ran)
{
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(ran.out, "");
    EXPECT_EQ(ran.err, "");
}

TEST_F(MaskCommand, WritesMaskAndReportAndNothingElse)
{
    const std::string scene = write_scene("scene.json");
    expect_success(penumbra({"mask", scene, "-o", path("mask.exr"), "--report", path("report.json")}));
    EXPECT_EQ(files(), (std::vector<std::string>{"mask.exr", "report.json", "scene.json"}));

    const Image mask = read_image(path("mask.exr"));
    EXPECT_EQ(mask.width, 40);
    EXPECT_EQ(mask.height, 31);
    EXPECT_EQ(mask.channels, 1);
    const auto [darkest, brightest] = std::ranges::minmax(mask.pixels);
    EXPECT_EQ(brightest, 1.0f);
    EXPECT_LT(darkest, 0.5f); // there is a shadow

    const auto report = nlohmann::json::parse(text_of(path("report.json")));
    EXPECT_EQ(report.at("technique"), "soft_shadow_map");
    EXPECT_EQ(report.at("resolution"), (std::vector<int>{40, 31}));
    EXPECT_FALSE(report.at("device").at("name").get<std::string>().empty());
    EXPECT_GE(report.at("total_ms").get<double>(), report.at("shade_ms").get<double>());
}

TEST_F(MaskCommand, SetOverridesTheScenesValueAndKeepsTheOthers)
{
    const std::string scene = write_scene("scene.json", R"({"kind": "soft_shadow_map", "sides": "front", "bias": 2})");
    expect_success(
        penumbra({"mask", scene, "-o", path("mask.exr"), "--set", "sides=both", "--set", "resolution=32", "--report", path("r.json")}));
    const auto settings = nlohmann::json::parse(text_of(path("r.json"))).at("settings");
    EXPECT_EQ(settings.at("sides"), "both");
    EXPECT_EQ(settings.at("resolution"), 32);
    EXPECT_EQ(settings.at("bias"), 2.0);
}

TEST_F(MaskCommand, AnotherTechniqueDropsTheScenesSettings)
{
    const std::string scene = write_scene("scene.json", R"({"kind": "soft_shadow_map", "sides": "front"})");
    const Ran ran = penumbra({"mask", scene, "-o", path("mask.exr"), "--technique", "shadow_map", "--report", path("r.json")});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(ran.err.rfind("penumbra: warning: ", 0), 0u) << ran.err; // the light's extent is ignored
    const auto report = nlohmann::json::parse(text_of(path("r.json")));
    EXPECT_EQ(report.at("technique"), "shadow_map");
    EXPECT_FALSE(report.at("settings").contains("sides"));

    expect_success(penumbra({"mask", scene, "-o", path("mask.exr"), "--technique", "soft_shadow_map", "--report", path("r.json")}));
    EXPECT_EQ(nlohmann::json::parse(text_of(path("r.json"))).at("settings").at("sides"), "front");
}

TEST_F(MaskCommand, EveryTechniqueMakesAShadowOfTheScene)
{
    const std::string scene = write_scene("scene.json");
    for (const std::string kind : {"shadow_map", "soft_shadow_map", "soft_shadow_volume", "occlusion_texture", "smoothie", "ray_traced"}) {
        const Ran ran = penumbra({"mask", scene, "-o", path(kind + ".exr"), "--technique", kind, "--report", path("r.json")});
        ASSERT_EQ(ran.code, 0) << ran.err;
        EXPECT_EQ(nlohmann::json::parse(text_of(path("r.json"))).at("technique"), kind);
        const Image mask = read_image(path(kind + ".exr"));
        const auto [darkest, brightest] = std::ranges::minmax(mask.pixels);
        EXPECT_EQ(brightest, 1.0f) << kind;
        EXPECT_LT(darkest, 0.5f) << kind;
    }
}

TEST_F(MaskCommand, FormatByExtensionBitsByTheScene)
{
    const std::string technique = R"({"kind": "soft_shadow_map"})";
    const std::string scene = write_scene("scene.json", technique, R"(, "output": {"format": "png", "bits": 8})");
    for (const std::string name : {"mask.png", "mask.exr", "mask.tif", "mask.pfm", "mask.hdr"})
        expect_success(penumbra({"mask", scene, "-o", path(name)}));

    // IHDR: length, "IHDR", width, height, then the bit depth.
    EXPECT_EQ(text_of(path("mask.png")).at(24), 8);
    // The bits are for PNG; EXR keeps its own default, without loss.
    const Image exr = read_image(path("mask.exr")), pfm = read_image(path("mask.pfm"));
    EXPECT_TRUE(exr.pixels == pfm.pixels);
}

TEST_F(MaskCommand, TheSameMaskTwice)
{
    const std::string scene = write_scene("scene.json");
    expect_success(penumbra({"mask", scene, "-o", path("a.pfm")}));
    expect_success(penumbra({"mask", scene, "-o", path("b.pfm")}));
    expect_same_bytes(path("a.pfm"), path("b.pfm"));
}

TEST_F(MaskCommand, WorkThatFailsLeavesWhatWasThere)
{
    // Nothing to make occluder depth from.
    write_text(path("scene.json"), R"({"penumbra": 1,
        "light": {"kind": "point", "center": [0, 6, 0]},
        "receivers": {"camera": {"kind": "light", "tan_half_fov": [1, 1]}, "resolution": [7, 7]}})");
    expect_one_error(penumbra({"mask", path("scene.json"), "-o", path("mask.exr")}), 2, {path("scene.json")});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));

    write_text(path("mask.exr"), "from before");
    expect_one_error(penumbra({"mask", path("scene.json"), "-o", path("mask.exr")}), 2, {});
    EXPECT_EQ(text_of(path("mask.exr")), "from before");
}

TEST_F(MaskCommand, ReportThatCannotBeWrittenSaysThatTheMaskIs)
{
    const std::string scene = write_scene("scene.json");
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.exr"), "--report", "/dev/full"}), 1, {"mask.exr is written", "report"});
    EXPECT_EQ(read_image(path("mask.exr")).width, 40);
}

class DepthCommand : public CommandTest {};

TEST_F(DepthCommand, GivesTheSameMask)
{
    for (const std::string kind : {"soft_shadow_map", "shadow_map"}) {
        const std::string scene = write_scene("scene.json", R"({"kind": ")" + kind + R"("})");
        const std::string folder = path(kind + "/depth"); // made with the folder above it
        expect_success(penumbra({"depth", scene, "--out", folder}));
        EXPECT_EQ(penumbra({"mask", scene, "-o", path("direct.pfm")}).code, 0) << kind;
        EXPECT_EQ(penumbra({"mask", folder + "/scene.json", "-o", path("through.pfm")}).code, 0) << kind;
        expect_alike(path("direct.pfm"), path("through.pfm"));
        EXPECT_LT(std::ranges::min(read_image(path("direct.pfm")).pixels), 0.5f) << kind;
    }
}

TEST_F(DepthCommand, OtherCamerasAndFittedOnesComeThroughToo)
{
    const std::string scene = path("scene.json");
    write_text(scene, R"({
  "penumbra": 1,
  "light": { "kind": "rectangle", "center": [1, 6, 0.5], "half_u": [0.3, -0.1, 0.2], "half_v": [0.2, 0, -0.3] },
  "objects": [
    { "quad": { "center": [0.25, 2, 0], "half_u": [1, 0, 0], "half_v": [0, 0, -0.75] }, "rotate_deg": [10, 20, 30], "receives": false },
    { "quad": { "center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4] }, "casts": false }
  ],
  "occluders": { "resolution": [64, 48] },
  "receivers": { "camera": { "kind": "pinhole", "eye": [3, 5, 7], "target": [0, 0, 0], "up": [0, 1, 0], "vertical_fov_deg": 40 }, "resolution": [37, 23] },
  "technique": { "kind": "soft_shadow_map" }
})");
    expect_success(penumbra({"depth", scene, "--out", path("depth")}));
    EXPECT_EQ(penumbra({"mask", scene, "-o", path("direct.pfm")}).code, 0);
    EXPECT_EQ(penumbra({"mask", path("depth/scene.json"), "-o", path("through.pfm")}).code, 0);
    expect_alike(path("direct.pfm"), path("through.pfm"));
}

TEST_F(DepthCommand, CarriesATexturedLight)
{
    Image emission{2, 2, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25f, 0.25f, 0.25f}};
    write_image(path("emission.pfm"), emission);
    const std::string scene = write_scene("scene.json", R"({"kind": "soft_shadow_map"})");
    std::string text = text_of(scene);
    text.replace(text.find(R"("kind": "rectangle",)"), 20, R"("kind": "rectangle", "emission": "emission.pfm",)");
    write_text(scene, text);

    expect_success(penumbra({"depth", scene, "--out", path("depth")}));
    EXPECT_EQ(read_image(path("depth/emission.exr")).pixels, emission.pixels);
    const auto json = nlohmann::json::parse(text_of(path("depth/scene.json")));
    EXPECT_EQ(json.at("light").at("emission"), "emission.exr");
}

TEST_F(DepthCommand, Refuses)
{
    const std::string scene = write_scene("scene.json");
    expect_one_error(penumbra({"depth", scene, "--out", path("")}), 2, {"the scene's folder"});
    expect_one_error(penumbra({"depth", scene, "--out", path("d"), "--technique", "ray_traced"}), 2, {"ray_traced"});
    expect_one_error(penumbra({"depth", path("none.json"), "--out", path("d")}), 2, {"none.json"});
    expect_one_error(penumbra({"depth", scene, "--out", "/dev/null/depth"}), 1, {"--out"});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));
}

} // namespace
} // namespace penumbra::test
