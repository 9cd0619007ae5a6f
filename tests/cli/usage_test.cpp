// What a person or script meets before any work is done: help, wrong calls, no device.
#include <nlohmann/json.hpp>

#include <penumbra/engine.hpp>

#include "command.hpp"
#include "technique/table.hpp"

namespace penumbra::test {
namespace {

bool holds(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

TEST(Usage, HelpNamesEveryVerb)
{
    const Ran ran = penumbra({"--help"});
    EXPECT_EQ(ran.code, 0);
    EXPECT_EQ(ran.err, "");
    for (const char* verb : {"mask", "depth", "compare", "batch", "info"}) EXPECT_TRUE(holds(ran.out, verb)) << verb;
}

TEST(Usage, EveryVerbHasHelpWithItsUsage)
{
    for (const std::string verb : {"mask", "depth", "compare", "batch", "info"}) {
        const Ran ran = penumbra({verb, "--help"});
        EXPECT_EQ(ran.code, 0) << verb;
        EXPECT_EQ(ran.err, "") << verb;
        EXPECT_TRUE(holds(ran.out, "Usage: penumbra " + verb)) << ran.out;
    }
}

TEST(Usage, HelpOfMaskHasEveryTechniqueAndKey)
{
    const Ran ran = penumbra({"mask", "--help"});
    for (const TechniqueRow& row : technique_table()) {
        EXPECT_TRUE(holds(ran.out, "\n  " + std::string(row.kind) + "\n")) << row.kind;
        for (const SettingKey& key : row.keys) {
            EXPECT_TRUE(holds(ran.out, "    " + std::string(key.name) + "=")) << row.kind << "." << key.name;
            EXPECT_TRUE(holds(ran.out, key.meaning)) << row.kind << "." << key.name;
        }
    }
}

TEST(Usage, Version)
{
    const Ran ran = penumbra({"--version"});
    EXPECT_EQ(ran.code, 0);
    EXPECT_EQ(ran.out, "penumbra " + version() + "\n");
}

TEST(Usage, WrongCalls)
{
    expect_one_error(penumbra({}), 2, {"no verb", "mask", "batch"});
    expect_one_error(penumbra({"masc"}), 2, {"\"masc\"", "mask"});
    expect_one_error(penumbra({"mask"}), 2, {"SCENE.json", "penumbra mask --help"});
    expect_one_error(penumbra({"mask", "scene.json"}), 2, {"-o", "penumbra mask --help"});
    expect_one_error(penumbra({"mask", "scene.json", "-o", "mask.exr", "--fast"}), 2, {"--fast"});
    expect_one_error(penumbra({"mask", "scene.json", "other.json", "-o", "mask.exr"}), 2, {"other.json"});
    expect_one_error(penumbra({"mask", "scene.json", "-o", "a.exr", "-o", "b.exr"}), 2, {"-o"});
    expect_one_error(penumbra({"--fast"}), 2, {});
}

class MaskUsage : public CommandTest {};

TEST_F(MaskUsage, MissingScene)
{
    expect_one_error(penumbra({"mask", path("none.json"), "-o", path("mask.exr")}), 2, {path("none.json"), "no such file"});
    EXPECT_TRUE(files().empty());
}

TEST_F(MaskUsage, SceneThatIsNoScene)
{
    write_text(path("scene.json"), "{ \"penumbra\": 1, ");
    expect_one_error(penumbra({"mask", path("scene.json"), "-o", path("mask.exr")}), 2, {path("scene.json")});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));
}

TEST_F(MaskUsage, UnknownTechniqueKeyOrValue)
{
    const std::string scene = write_scene("scene.json"), mask = path("mask.exr");
    expect_one_error(penumbra({"mask", scene, "-o", mask, "--technique", "auto"}), 2,
                     {"--technique auto", "soft_shadow_map", "ray_traced"});
    expect_one_error(penumbra({"mask", scene, "-o", mask, "--set", "side=both"}), 2, {"--set side=both", "unknown key", "sides"});
    expect_one_error(penumbra({"mask", scene, "-o", mask, "--set", "sides=top"}), 2, {"sides", "top", "front", "both"});
    expect_one_error(penumbra({"mask", scene, "-o", mask, "--set", "resolution=-1"}), 2, {"resolution", "-1"});
    expect_one_error(penumbra({"mask", scene, "-o", mask, "--set", "resolution=7x"}), 2, {"resolution", "7x"});
    expect_one_error(penumbra({"mask", scene, "-o", mask, "--set", "project=1"}), 2, {"project", "true or false"});
    expect_one_error(penumbra({"mask", scene, "-o", mask, "--set", "bias=nan"}), 2, {"bias"});
    expect_one_error(penumbra({"mask", scene, "-o", mask, "--set", "bias"}), 2, {"KEY=VALUE"});
    expect_one_error(penumbra({"mask", scene, "-o", mask, "--set", "=1"}), 2, {"KEY=VALUE"});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));
}

TEST_F(MaskUsage, OutputThatCannotBe)
{
    const std::string scene = write_scene("scene.json");
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.jpg")}), 2, {"mask.jpg", "exr"});
    expect_one_error(penumbra({"mask", scene, "-o", path("mask")}), 2, {"extension"});
    expect_one_error(penumbra({"mask", scene, "-o", path("none/mask.exr")}), 2, {path("none")});
    expect_one_error(penumbra({"mask", scene, "-o", path(".")}), 2, {"folder"});
    expect_one_error(penumbra({"mask", scene, "-o", scene}), 2, {"same file"});
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.exr"), "--report", path("none/report.json")}), 2,
                     {"--report", path("none")});
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.exr"), "--report", path("mask.exr")}), 2, {"same file"});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));
}

TEST_F(MaskUsage, BitsThatTheFormatDoesNotHave)
{
    const std::string scene = write_scene("scene.json", R"({"kind": "soft_shadow_map"})", R"(, "output": {"format": "png", "bits": 32})");
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.png")}), 2, {"32", "png"});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));
}

TEST_F(MaskUsage, NeverReplacesAnInput)
{
    const std::string scene = path("scene.json");
    write_text(scene, R"({"penumbra": 1, "receivers": {"depth": "receiver.exr"}})");
    write_text(path("receiver.exr"), "precious");
    expect_one_error(penumbra({"mask", scene, "-o", path("receiver.exr")}), 2, {"receiver.exr", "/receivers/depth"});
    EXPECT_EQ(text_of(path("receiver.exr")), "precious");
}

TEST_F(MaskUsage, NoDevice)
{
    const std::string scene = write_scene("scene.json");
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.exr"), "--report", path("report.json")}, no_device), 1, {"device"});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));
}

TEST_F(MaskUsage, DeviceThatIsNotThere)
{
    const std::string scene = write_scene("scene.json");
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.exr"), "--device", "no such accelerator"}), 1, {"no such accelerator"});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));
}

// Wrong input is found before a device is looked for.
TEST_F(MaskUsage, InputErrorsNeedNoDevice)
{
    const std::string scene = write_scene("scene.json");
    expect_one_error(penumbra({"mask", scene, "-o", path("mask.exr"), "--set", "nothing=1"}, no_device), 2, {"unknown key"});
}

TEST(Info, JsonHoldsDevicesAndTechniques)
{
    const Ran ran = penumbra({"info", "--json"});
    ASSERT_EQ(ran.code, 0) << ran.err;
    const auto json = nlohmann::json::parse(ran.out);
    EXPECT_EQ(json.at("version"), version());
    EXPECT_FALSE(json.at("build").at("type").get<std::string>().empty());
    ASSERT_FALSE(json.at("devices").empty());
    int selected = 0;
    for (const auto& device : json.at("devices")) {
        selected += device.at("selected").get<bool>() ? 1 : 0;
        EXPECT_GT(device.at("max_allocation_bytes").get<std::uint64_t>(), 0u);
    }
    EXPECT_EQ(selected, 1);
    EXPECT_EQ(json.at("techniques").size(), technique_table().size());
    EXPECT_TRUE(json.at("environment").contains("PENUMBRA_DEVICE"));
}

TEST(Info, TextNamesTheDevice)
{
    const auto json = nlohmann::json::parse(penumbra({"info", "--json"}).out);
    const Ran ran = penumbra({"info"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_TRUE(holds(ran.out, json.at("devices").at(0).at("name").get<std::string>())) << ran.out;
    EXPECT_TRUE(holds(ran.out, "PENUMBRA_CACHE_DIR"));
}

TEST(Info, WithoutADeviceShowsTheRestAndFails)
{
    const Ran ran = penumbra({"info", "--json"}, no_device);
    EXPECT_EQ(ran.code, 1);
    EXPECT_TRUE(ran.err.starts_with("penumbra: ")) << ran.err;
    const auto json = nlohmann::json::parse(ran.out);
    EXPECT_TRUE(json.at("devices").empty());
    EXPECT_EQ(json.at("techniques").size(), technique_table().size());
}

} // namespace
} // namespace penumbra::test
