// penumbra mask --technique smoothie: its keys by flag, what it reports and refuses.
#include <nlohmann/json.hpp>

#include <penumbra/image.hpp>

#include "command.hpp"

namespace penumbra::test {
namespace {

class SmoothieCommand : public CommandTest {};

TEST_F(SmoothieCommand, KeysByFlag)
{
    const std::string scene = write_scene("scene.json");
    for (const char* mask : {"soft.pfm", "narrow.pfm"}) {
        Arguments call{"mask", scene, "-o", path(mask), "--technique", "smoothie", "--set", "two_sided=false", "--report", path("r.json")}; // which only darkens
        if (mask[0] == 'n') call.insert(call.end(), {"--set", "t_from=t", "--set", "t=0"});
        const Ran ran = penumbra(call);
        EXPECT_EQ(ran.code, 0) << ran.err;
        EXPECT_EQ(ran.err, "");
    }
    const Image soft = read_image(path("soft.pfm")), narrow = read_image(path("narrow.pfm"));
    double darker = 0;
    for (std::size_t i = 0; i < soft.pixels.size(); ++i) {
        ASSERT_LE(soft.pixels[i], narrow.pixels[i]) << i;
        darker += narrow.pixels[i] - soft.pixels[i];
    }
    EXPECT_GT(darker, 1);

    const auto report = nlohmann::json::parse(text_of(path("r.json")));
    EXPECT_EQ(report.at("technique"), "smoothie");
    EXPECT_EQ(report.at("settings").at("t_from"), "t");
    EXPECT_EQ(report.at("settings").at("t"), 0.0);
    EXPECT_EQ(report.at("settings").at("falloff"), "sinusoidal");
}

TEST_F(SmoothieCommand, Refuses)
{
    const std::string scene = write_scene("scene.json");
    const auto set = [&](const std::string& value) {
        return penumbra({"mask", scene, "-o", path("m.pfm"), "--technique", "smoothie", "--set", value});
    };
    expect_one_error(set("t=0.1"), 2, {"technique.t", "t_from"});
    expect_one_error(set("t=2.5"), 2, {"t", "2.5", "2"});
    expect_one_error(set("falloff=cubic"), 2, {"falloff", "cubic", "sinusoidal", "linear"});
    expect_one_error(set("width=1"), 2, {"width", "t_from"});
    EXPECT_EQ(files(), (std::vector<std::string>{"scene.json"}));
}

} // namespace
} // namespace penumbra::test
