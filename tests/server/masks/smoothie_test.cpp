// GET /v1/techniques describes smoothie: every key with its range and default, and the lights it takes.
#include <nlohmann/json.hpp>

#include "server/client.hpp"
#include "server/program.hpp"

namespace penumbra::test {
namespace {

TEST(Descriptions, Smoothie)
{
    const nlohmann::json list = nlohmann::json::parse(get(shared_port(), "/v1/techniques").body)["techniques"];
    const auto found = std::ranges::find_if(list, [](const auto& technique) { return technique["kind"] == "smoothie"; });
    ASSERT_NE(found, list.end());
    const nlohmann::json& keys = (*found)["schema"]["properties"];
    EXPECT_EQ(keys["t_from"]["default"], "light");
    EXPECT_EQ(keys["t"]["default"], 0.05);
    EXPECT_EQ(keys["t"]["minimum"], 0.0);
    EXPECT_EQ(keys["t"]["maximum"], 2.0);
    EXPECT_EQ(keys["silhouettes"]["enum"], (std::vector<std::string>{"object", "image"}));
    EXPECT_EQ(keys["falloff"]["enum"], (std::vector<std::string>{"sinusoidal", "linear"}));
    EXPECT_EQ(keys["two_sided"]["default"], true);
    EXPECT_EQ((*found)["lights"], (std::vector<std::string>{"rectangle", "sphere", "point", "directional"}));
}

} // namespace
} // namespace penumbra::test
