// Which channel of which part is depth: by names that mean it, or nobody's guess.
#include "io/made_images.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

using Names = std::vector<std::string>;
using Parts = std::vector<ImagePart>;

// "part/channel" of what is picked, or the complaint.
std::string picked(const Parts& parts, const PlaneRequest& request = {})
{
    try {
        const PlanePick pick = pick_planes(parts, request, "x");
        std::string text = std::to_string(pick.part);
        for (const int channel : pick.channels)
            text += (text.size() == 1 ? "/" : " ") + parts[static_cast<std::size_t>(pick.part)].channels[static_cast<std::size_t>(channel)];
        return text;
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_LT(std::string(error.what()).size(), 1500u);
        return error.what();
    }
}

std::string picked(std::initializer_list<const char*> channels) { return picked(Parts{{"", Names(channels.begin(), channels.end())}}); }

void expect_says(const std::string& text, std::initializer_list<const char*> words)
{
    for (const char* word : words) EXPECT_NE(text.find(word), std::string::npos) << word << " in: " << text;
}

} // namespace

TEST(DepthChannel, IsFoundByNamesThatMeanDepth)
{
    for (const char* name :
         {"Z", "z", "depth", "Depth", "ZDepth", "depth.Z", "Depth.Z", "Depth.V", "depth.Y", "ViewLayer.Depth.Z", "View Layer.depth.Z",
          "ZDepth.R", "VRayZDepth.R", "FinalImageMovieRenderQueue_WorldDepth.R", "rgba.depth", "Z.Z"})
        EXPECT_EQ(picked({"R", "G", "B", "A", name, "N.X", "N.Y", "N.Z"}), std::string("0/") + name);
    EXPECT_EQ(picked({"ZDepth.R", "ZDepth.G", "ZDepth.B", "ZDepth.A", "R"}), "0/ZDepth.R") << "a layer of depth holds one";
}

TEST(DepthChannel, OtherZsAreNone)
{
    for (const char* name :
         {"Normal.Z", "N.Z", "P.Z", "Position.Z", "Vector.Z", "ViewLayer.Mist.Z", "UV.Z", "normal_z", "Pz", "DepthOfField.Z", "Depth.A"})
        expect_says(picked({"R", "G", "B", name}), {"no channel that is depth for certain", "R, G, B", name, "encoding.channel"});
    expect_says(picked({"X", "Y", "Z"}), {"no channel that is depth for certain", "X, Y, Z"});
}

TEST(DepthChannel, TheOnlyOneIsDepth)
{
    EXPECT_EQ(picked({"Y"}), "0/Y");
    EXPECT_EQ(picked({"distance", "A"}), "0/distance");
    EXPECT_EQ(picked({"Normal.Z"}), "0/Normal.Z");
    // Not the first single one of several parts.
    expect_says(picked(Parts{{"mist", {"Y"}}, {"shadow", {"Y"}}}),
                {"no channel that is depth", "part 0 \"mist\": Y; part 1 \"shadow\": Y", "encoding.part"});
    EXPECT_EQ(picked(Parts{{"preview", {"A"}}, {"other", {"Y"}}}), "1/Y");
}

TEST(DepthChannel, TwoAreAnErrorThatListsThem)
{
    expect_says(picked({"Z", "depth.Z", "R"}), {"more than one depth: Z, depth.Z", "it has Z, depth.Z, R", "encoding.channel"});
    expect_says(picked({"a.Depth.Z", "b.Depth.Z"}), {"more than one depth: a.Depth.Z, b.Depth.Z"});
    expect_says(picked(Parts{{"left", {"depth.Z"}}, {"right", {"depth.Z"}}}),
                {"depth.Z in part 0 \"left\"", "depth.Z in part 1 \"right\"", "encoding.part"});
    // However many there are, the line stays readable.
    Names many{"a.depth.Z", "b.depth.Z"};
    for (int i = 0; i < 1000; ++i) many.push_back("layer" + std::to_string(i) + ".R");
    expect_says(picked(Parts{{"", many}}), {"and 9", " more"});
}

TEST(DepthChannel, PartsGiveTheirNamesToChannels)
{
    const Parts alike{{"beauty", {"R", "G", "B"}}, {"normal", {"R", "G", "B"}}, {"depth", {"R", "G", "B"}}};
    EXPECT_EQ(picked(alike), "2/R");
    EXPECT_EQ(picked(alike, {.channel = "G", .part = 1}), "1/G");
    EXPECT_EQ(picked(alike, {.channel = "B", .part = "beauty"}), "0/B");
    EXPECT_EQ(picked(alike, {.channel = "depth.G"}), "2/G");
    expect_says(picked(alike, {.channel = "R"}), {"more than one depth", "R in part 0 \"beauty\"", "encoding.part"});
    expect_says(picked(alike, {.channel = {}, .part = 1}), {"no channel that is depth for certain"});
    expect_says(picked(alike, {.channel = {}, .part = 3}), {"has no part 3", "part 2 \"depth\": R, G, B"});
    expect_says(picked(alike, {.channel = {}, .part = "mist"}), {"has no part \"mist\""});
    EXPECT_EQ(picked(Parts{{"rgba", {"R", "G", "B", "A", "Z"}}, {"N", {"X", "Y", "Z"}}}), "0/Z");
    EXPECT_EQ(picked(Parts{{"beauty", {"R", "G", "B"}}, {"Z", {"Z"}}, {"Mist", {"Z"}}, {"P", {"P.X", "P.Y", "P.Z"}}}), "1/Z");
    expect_says(picked(Parts{{"beauty", {"R"}}, {"Mist", {"Z"}}}), {"no channel that is depth"});
    expect_says(picked(Parts{{"", {"Z"}, true}}), {"deep image"});
    EXPECT_EQ(picked(Parts{{"", {"Z"}, true}, {"flat", {"depth"}}}), "1/depth");
}

TEST(DepthChannel, PositionsAreThree)
{
    const PlaneRequest position{.planes = Planes::position};
    EXPECT_EQ(picked(Parts{{"", {"R", "G", "B", "P.X", "P.Y", "P.Z"}}}, position), "0/P.X P.Y P.Z");
    EXPECT_EQ(picked(Parts{{"", {"ViewLayer.Position.Z", "ViewLayer.Position.Y", "ViewLayer.Position.X", "N.X", "N.Y", "N.Z"}}}, position),
              "0/ViewLayer.Position.X ViewLayer.Position.Y ViewLayer.Position.Z");
    EXPECT_EQ(picked(Parts{{"", {"R", "G", "B", "A"}}}, position), "0/R G B");
    EXPECT_EQ(picked(Parts{{"beauty", {"R", "G", "B"}}, {"WorldPosition", {"R", "G", "B"}}}, position), "1/R G B");
    EXPECT_EQ(picked(Parts{{"", {"N.X", "N.Y", "N.Z", "my.R", "my.G", "my.B"}}}, {.planes = Planes::position, .channel = "my"}),
              "0/my.R my.G my.B");
    expect_says(picked(Parts{{"", {"R", "G", "B", "N.X", "N.Y", "N.Z"}}}, position), {"no channel that is a position"});
    expect_says(picked(Parts{{"", {"Z"}}}, position), {"no channel that is a position"});
}

TEST(DepthChannel, PartsOfFiles)
{
    const std::vector<float> one(6, 1), two(6, 2), three(6, 3);
    const MadeImage exr{.width = 3,
                        .height = 2,
                        .parts = {{"beauty", {{"R", one}, {"G", one}, {"B", one}}}, {"second", {{"R", two}, {"G", two}, {"B", three}}}}};
    const std::vector<std::byte> bytes = bytes_of(exr);
    EXPECT_EQ(decode_raw_depth(bytes, "R", "x", max_image_samples, 1).samples, two);
    EXPECT_EQ(decode_raw_depth(bytes, "B", "x", max_image_samples, "second").samples, three);
    expect_says(error_of([&] { decode_raw_depth(bytes, "R", "x"); }).what(), {"part 0 \"beauty\"", "part 1 \"second\"", "encoding.part"});
    expect_says(error_of([&] { decode_raw_depth(bytes, "", "x"); }).what(), {"no channel that is depth"});

    const MadeImage single{.width = 3, .height = 2, .parts = {{"depth", {{"Z", two}}}}};
    EXPECT_EQ(decode_raw_depth(bytes_of(single), "", "x", max_image_samples, 0).samples, two);
    EXPECT_EQ(error_of([&] { decode_raw_depth(bytes_of(single), "", "x", max_image_samples, 1); }).code(), ErrorCode::invalid_input);
}

TEST(DepthChannel, PagesOfATiff)
{
    const std::vector<float> one(6, 1), two(6, 2);
    const MadeImage tiff{.width = 3, .height = 2, .parts = {{"", {{"Y", one}}}, {"", {{"Y", two}}}}, .plugin = "tiff"};
    const std::vector<std::byte> bytes = bytes_of(tiff);
    EXPECT_EQ(decode_raw_depth(bytes, "", "x", max_image_samples, 0).samples, one);
    EXPECT_EQ(decode_raw_depth(bytes, "", "x", max_image_samples, 1).samples, two);
    expect_says(error_of([&] { decode_raw_depth(bytes, "", "x"); }).what(), {"several pages", "encoding.part"});
    expect_says(error_of([&] { decode_raw_depth(bytes, "", "x", max_image_samples, 2); }).what(), {"no part 2"});
}
