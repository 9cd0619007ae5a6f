// The parser of scenes: what it makes of a text, and in what time.
#include <algorithm>
#include <chrono>
#include <string>

#include <gtest/gtest.h>

#include "io/json_value.hpp"

namespace penumbra::test {
namespace {

using nlohmann::json;

TEST(ParseJson, MakesWhatTheLibraryMakes)
{
    for (const char* text : {"null", "true", "-3", "18446744073709551615", "1.5e-3", "\"a\\u00e9\"", "[]", "{}", "[[], {}, [1, [2]], 3]",
                             R"({"b": {"x": [1, {"y": null}], "z": "t"}, "a": [true, false, -0.0], "": {}})"}) {
        const json expected = json::parse(text), made = parse_json(text);
        EXPECT_EQ(made, expected) << text;
        EXPECT_EQ(made.dump(), expected.dump()) << text;
        EXPECT_EQ(made.type(), expected.type()) << text;
    }
}

TEST(ParseJson, TellsEqualKeysOfOneObjectAlone)
{
    EXPECT_NO_THROW(parse_json(R"({"a": {"a": 1}, "b": [{"a": 1}, {"a": 2}]})"));
    EXPECT_THROW(parse_json(R"({"b": {}, "a": {"a": 1}, "b": 2})"), Error);
    EXPECT_THROW(parse_json(R"([{"a": 1, "b": [], "a": 1}])"), Error);
}

TEST(ParseJson, TakesThirtyTwoLevels)
{
    const auto nested = [](std::size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); };
    EXPECT_NO_THROW(parse_json(nested(32)));
    EXPECT_THROW(parse_json(nested(33)), Error);
}

// As long as the library takes without looking at keys: five times leave room for that. Quadratic it took a thousand times as long.
TEST(ParseJson, TakesTimeInProportionToTheText)
{
    std::string text = "[{}";
    for (int i = 1; i < 300000; ++i) text += ",{}";
    text += "]";
    const auto seconds = [&](const auto& parse) {
        double least = 1e9;
        for (int run = 0; run < 3; ++run) {
            const auto begin = std::chrono::steady_clock::now();
            EXPECT_EQ(parse(text).size(), 300000u);
            least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
        }
        return least;
    };
    EXPECT_LT(seconds([](const std::string& all) { return parse_json(all); }), 5 * seconds([](const std::string& all) { return json::parse(all); }));
}

} // namespace
} // namespace penumbra::test
