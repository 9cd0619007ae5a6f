// penumbra compare; needs no device.
#include <limits>

#include <nlohmann/json.hpp>

#include <penumbra/image.hpp>

#include "command.hpp"

namespace penumbra::test {
namespace {

class CompareCommand : public CommandTest {
protected:
    std::string write(const std::string& name, int width, int height, int channels, std::vector<float> pixels) const
    {
        write_image(path(name), Image{width, height, channels, std::move(pixels)});
        return path(name);
    }
};

TEST_F(CompareCommand, JsonHasTheContractsKeysInOrder)
{
    const std::string test = write("test.pfm", 4, 1, 1, {0.5f, 0, 0.75f, 1}),
                      reference = write("reference.pfm", 4, 1, 1, {0.25f, 0.5f, 0.75f, 1});
    const Ran ran = penumbra({"compare", test, reference, "--json"}, no_device);
    ASSERT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(ran.err, "");
    const auto json = nlohmann::ordered_json::parse(ran.out);
    std::vector<std::string> keys;
    for (const auto& item : json.items()) keys.push_back(item.key());
    EXPECT_EQ(keys, (std::vector<std::string>{"mae_shadow", "rmse_shadow", "bias_shadow", "mae", "rmse", "max", "p99", "pixels_shadow",
                                              "pixels", "p99_shadow", "off_1_255_shadow", "off_0_05_shadow"}));
    EXPECT_DOUBLE_EQ(json["mae"], 0.75 / 4);
    EXPECT_DOUBLE_EQ(json["mae_shadow"], 0.25);
    EXPECT_DOUBLE_EQ(json["bias_shadow"], -0.25 / 3);
    EXPECT_EQ(json["max"], 0.5);
    EXPECT_EQ(json["pixels"], 4);
    EXPECT_EQ(json["pixels_shadow"], 3);
}

TEST_F(CompareCommand, TableForPeople)
{
    const std::string mask = write("mask.pfm", 2, 1, 1, {0.5f, 1});
    const Ran ran = penumbra({"compare", mask, mask});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_NE(ran.out.find("mean absolute error"), std::string::npos) << ran.out;
    EXPECT_NE(ran.out.find("pixels                               1             2\n"), std::string::npos) << ran.out;
}

TEST_F(CompareCommand, PictureOfTheDifference)
{
    const std::string test = write("test.pfm", 3, 1, 1, {0.5f, 0, 1}), reference = write("reference.pfm", 3, 1, 1, {0.5f, 1, 0});
    const Ran ran = penumbra({"compare", test, reference, "-o", path("difference.png"), "--full-scale", "1"});
    ASSERT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(text_of(path("difference.png")).at(24), 8); // bits
    EXPECT_EQ(read_image(path("difference.png")).pixels, (std::vector<float>{1, 1, 1, 0, 0, 1, 1, 0, 0}));
}

TEST_F(CompareCommand, RefusesWhatCannotBeCompared)
{
    const std::string a = write("a.pfm", 2, 1, 1, {0, 0}), b = write("b.pfm", 1, 2, 1, {0, 0}),
                      c = write("c.pfm", 2, 1, 3, {0, 0, 0, 0, 0, 0});
    const std::string nan = write("nan.exr", 2, 1, 1, {0, std::numeric_limits<float>::quiet_NaN()});
    expect_one_error(penumbra({"compare", a, b}), 2, {a, "2 x 1", "1 x 2"});
    expect_one_error(penumbra({"compare", a, c}), 2, {"1 and reference has 3 channels"});
    expect_one_error(penumbra({"compare", nan, a}), 2, {"test: pixel (1, 0)", "nan"});
    expect_one_error(penumbra({"compare", a, path("none.exr")}), 2, {path("none.exr")});
    expect_one_error(penumbra({"compare", a}), 2, {"REFERENCE"});
    expect_one_error(penumbra({"compare", a, a, "-o", path("d.png"), "--full-scale", "0"}), 2, {"full scale"});
    expect_one_error(penumbra({"compare", a, a, "-o", path("d.png"), "--full-scale", "wide"}), 2, {"full-scale"});
    expect_one_error(penumbra({"compare", a, a, "-o", a}), 2, {"same file"});
    expect_one_error(penumbra({"compare", a, a, "-o", path("d.gif")}), 2, {"d.gif"});
    EXPECT_EQ(files(), (std::vector<std::string>{"a.pfm", "b.pfm", "c.pfm", "nan.exr"}));
}

} // namespace
} // namespace penumbra::test
