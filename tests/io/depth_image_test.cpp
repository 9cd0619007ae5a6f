#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "io/support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

// An image by OpenImageIO itself: `values` go to the channels as they stand, channel c of pixel i is values[c] + i * step.
struct Recipe {
    std::string plugin = "openexr";
    std::vector<std::string> channels{"Y"};
    OIIO::TypeDesc type = OIIO::TypeFloat;
    int width = 3, height = 2;
    std::function<void(OIIO::ImageSpec&)> adjust = [](OIIO::ImageSpec&) {};
};

template <class Sample> std::vector<std::byte> make(const Recipe& recipe, const std::vector<Sample>& pixels)
{
    OIIO::ImageSpec spec(recipe.width, recipe.height, static_cast<int>(recipe.channels.size()), recipe.type);
    spec.channelnames = recipe.channels;
    recipe.adjust(spec);
    std::vector<unsigned char> buffer;
    OIIO::Filesystem::IOVecOutput memory(buffer);
    const auto output = OIIO::ImageOutput::create(recipe.plugin);
    EXPECT_TRUE(output && output->set_ioproxy(&memory) && output->open("made." + recipe.plugin, spec))
        << (output ? output->geterror() : "");
    EXPECT_TRUE(output->write_image(OIIO::BaseTypeFromC<Sample>::value, pixels.data()) && output->close()) << output->geterror();
    const std::byte* first = reinterpret_cast<const std::byte*>(buffer.data());
    return {first, first + buffer.size()};
}

// Channel c holds 10 * (c + 1) + pixel.
std::vector<std::byte> exr_with(const std::vector<std::string>& channels)
{
    std::vector<float> pixels;
    for (int i = 0; i < 6; ++i)
        for (std::size_t c = 0; c < channels.size(); ++c) pixels.push_back(10 * static_cast<float>(c + 1) + static_cast<float>(i));
    return make(Recipe{.channels = channels}, pixels);
}

} // namespace

TEST(DepthImage, FindsTheDepthChannel)
{
    struct Case {
        std::vector<std::string> channels;
        std::string asked;
        float first; // of pixel 0
    };
    for (const Case& c :
         {Case{{"R", "G", "B", "Z"}, "", 40}, Case{{"R", "G", "B", "A", "depth.Z"}, "", 50},
          Case{{"View.Combined.R", "View.Depth.Z"}, "", 20}, Case{{"Y"}, "", 10}, Case{{"Y", "A"}, "", 10}, Case{{"distance"}, "", 10},
          Case{{"R", "G", "B"}, "G", 20}, Case{{"Z", "depth.Z"}, "depth.Z", 20}}) {
        SCOPED_TRACE(c.channels.back() + ", asked for \"" + c.asked + "\"");
        const RawDepth raw = decode_raw_depth(exr_with(c.channels), c.asked, "x");
        ASSERT_EQ(raw.samples.size(), 6u);
        EXPECT_EQ(raw.type, SampleType::float32);
        for (int i = 0; i < 6; ++i) EXPECT_EQ(raw.samples[static_cast<std::size_t>(i)], c.first + static_cast<float>(i));
    }
}

TEST(DepthImage, ListsTheChannelsWhenInDoubt)
{
    const Error doubt = error_of([] { decode_raw_depth(exr_with({"R", "G", "B"}), "", "receivers.depth: a.exr"); });
    EXPECT_EQ(doubt.code(), ErrorCode::invalid_input);
    EXPECT_MENTIONS(doubt, "receivers.depth: a.exr");
    EXPECT_MENTIONS(doubt, "R, G, B");
    const Error missing = error_of([] { decode_raw_depth(exr_with({"R", "G", "B", "Z"}), "depth", "x"); });
    EXPECT_MENTIONS(missing, "\"depth\"");
    EXPECT_MENTIONS(missing, "R, G, B, Z");
}

TEST(DepthImage, IntegersComeAsStored)
{
    const std::vector<std::uint16_t> deep{0, 1, 1000, 32768, 65534, 65535};
    const std::vector<std::uint8_t> shallow{0, 1, 2, 127, 254, 255};
    for (const char* plugin : {"png", "tiff"}) {
        const RawDepth wide = decode_raw_depth(make(Recipe{.plugin = plugin, .type = OIIO::TypeUInt16}, deep), "", "x");
        EXPECT_EQ(wide.type, SampleType::uint16);
        EXPECT_EQ(wide.samples, std::vector<float>(deep.begin(), deep.end()));
        const RawDepth narrow = decode_raw_depth(make(Recipe{.plugin = plugin, .type = OIIO::TypeUInt8}, shallow), "", "x");
        EXPECT_EQ(narrow.type, SampleType::uint8);
        EXPECT_EQ(narrow.samples, std::vector<float>(shallow.begin(), shallow.end()));
    }
    const std::vector<std::uint32_t> deepest{0, 1, 65536, 1u << 24, 1u << 31, 4294967295u};
    for (const char* plugin : {"tiff", "openexr"}) {
        const RawDepth raw = decode_raw_depth(make(Recipe{.plugin = plugin, .type = OIIO::TypeUInt32}, deepest), "", "x");
        EXPECT_EQ(raw.type, SampleType::uint32) << plugin;
        EXPECT_EQ(raw.samples, std::vector<float>(deepest.begin(), deepest.end())) << plugin;
    }
}

TEST(DepthImage, AlphaIsNotMultipliedIn)
{
    const std::vector<std::uint16_t> pixels{1000, 0, 2000, 100, 3000, 65535, 4000, 1, 5000, 2, 6000, 3};
    for (const char* plugin : {"png", "tiff"}) {
        const Recipe recipe{plugin, {"Y", "A"}, OIIO::TypeUInt16, 3, 2, [](OIIO::ImageSpec& spec) {
                                spec.alpha_channel = 1;
                                spec.attribute("oiio:UnassociatedAlpha", 1);
                            }};
        EXPECT_EQ(decode_raw_depth(make(recipe, pixels), "Y", "x").samples, (std::vector<float>{1000, 2000, 3000, 4000, 5000, 6000}))
            << plugin;
    }
}

TEST(DepthImage, HalfFloatsAreKnownAsSuch)
{
    const std::vector<float> values{0.5f, 1, 2, 4, 65504, 70000};
    const auto half_tiff = [](OIIO::ImageSpec& spec) { spec.attribute("tiff:half", 1); };
    for (const Recipe& recipe : {Recipe{.type = OIIO::TypeHalf}, Recipe{.plugin = "tiff", .type = OIIO::TypeHalf, .adjust = half_tiff}}) {
        const RawDepth raw = decode_raw_depth(make(recipe, values), "", "x");
        EXPECT_EQ(raw.type, SampleType::float16) << recipe.plugin;
        EXPECT_EQ(raw.samples[4], 65504);
        EXPECT_EQ(raw.samples[5], std::numeric_limits<float>::infinity());
    }
}

TEST(DepthImage, TilesAreReadToTheirEdges)
{
    std::vector<float> values(static_cast<std::size_t>(93 * 61));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
    const auto tiled = [](OIIO::ImageSpec& spec) { spec.tile_width = spec.tile_height = 32; };
    for (const char* plugin : {"openexr", "tiff"})
        EXPECT_EQ(decode_raw_depth(make(Recipe{.plugin = plugin, .width = 93, .height = 61, .adjust = tiled}, values), "", "x").samples,
                  values)
            << plugin;
}

TEST(DepthImage, PartsAreSearched)
{
    // OpenImageIO writes several parts to files only.
    const Folder folder;
    const std::string path = folder / "parts.exr";
    const auto output = OIIO::ImageOutput::create("openexr");
    OIIO::ImageSpec specs[2] = {OIIO::ImageSpec(3, 2, 3, OIIO::TypeFloat), OIIO::ImageSpec(3, 2, 1, OIIO::TypeFloat)};
    specs[0].attribute("oiio:subimagename", "beauty");
    specs[1].attribute("oiio:subimagename", "depth");
    specs[1].channelnames = {"Z"};
    const std::vector<float> beauty(18, 0.5f), depth{1, 2, 3, 4, 5, 6};
    ASSERT_TRUE(output->open(path, 2, specs) && output->write_image(OIIO::TypeFloat, beauty.data()));
    ASSERT_TRUE(output->open(path, specs[1], OIIO::ImageOutput::AppendSubimage) && output->write_image(OIIO::TypeFloat, depth.data()) &&
                output->close());
    EXPECT_EQ(decode_raw_depth(read_file(path, path), "", path).samples, depth);
    EXPECT_EQ(decode_raw_depth(read_file(path, path), "Z", path).samples, depth);
    EXPECT_EQ(decode_image(read_file(path, path), path).channels, 3) << "an image is the first part";
}

TEST(DepthImage, WhatWouldBeReadWronglyIsRefused)
{
    const std::vector<float> six(6, 1.0f);
    const auto refused = [&](const Recipe& recipe, const char* part) {
        const Error error =
            error_of([&] { decode_raw_depth(make(recipe, std::vector<float>(6 * recipe.channels.size(), 0.5f)), "", "x"); });
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_MENTIONS(error, part);
    };
    refused(Recipe{.plugin = "tiff", .adjust = [](OIIO::ImageSpec& spec) { spec.attribute("Orientation", 6); }}, "turned");
    refused(Recipe{.plugin = "tiff", .type = OIIO::TypeDesc::DOUBLE}, "bit");
    refused(Recipe{.plugin = "tiff", .type = OIIO::TypeInt16}, "int16");
    refused(
        Recipe{.plugin = "tiff", .type = OIIO::TypeUInt8, .adjust = [](OIIO::ImageSpec& spec) { spec.attribute("oiio:BitsPerSample", 4); }},
        "4-bit");
    refused(Recipe{.plugin = "tiff",
                   .channels = {"C", "M", "Y", "K"},
                   .type = OIIO::TypeUInt8,
                   .adjust = [](OIIO::ImageSpec& spec) { spec.attribute("tiff:ColorSpace", "CMYK"); }},
            "x ");
}

TEST(DepthImage, EncodedDepthReadsBackAsZ)
{
    DepthMap map;
    map.width = 2;
    map.height = 1;
    map.depth = {1.5f, nothing_there};
    const std::vector<std::byte> bytes = encode_depth(map);
    EXPECT_EQ(decode_raw_depth(bytes, "Z", "x").samples, map.depth);
    EXPECT_EQ(decode_raw_depth(bytes, "", "x").samples, map.depth);
}

TEST(DepthImage, PfmIsOneChannel)
{
    EXPECT_EQ(decode_raw_depth(encode_image({1, 2, 1, {3, 4}}, {"pfm", 32}), "", "x").samples, (std::vector<float>{3, 4}));
    EXPECT_MENTIONS(error_of([] { decode_raw_depth(encode_image(ramp(1, 1, 3), {"pfm", 32}), "", "x"); }), "R, G, B");
}
