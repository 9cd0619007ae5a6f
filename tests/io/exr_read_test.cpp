// Plain EXR files by OpenEXRCore beside OpenImageIO: the same samples, bit for bit, or nothing.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <random>

#include <Imath/half.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "io/exr_header.hpp"
#include "io/exr_read.hpp"
#include "io/support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

constexpr std::uint64_t no_limit = std::uint64_t{1} << 30;

struct Recipe {
    const char* compression = "zip";
    std::vector<std::pair<std::string, OIIO::TypeDesc>> channels{{"Z", OIIO::TypeFloat}};
    int width = 7, height = 93;
    std::function<void(OIIO::ImageSpec&)> adjust = [](OIIO::ImageSpec&) {};
};

// Smooth, so that it becomes smaller, or noise, of which chunks are stored as they are. Every kind of float is in either.
std::vector<std::byte> samples_of(OIIO::TypeDesc type, std::size_t count, bool smooth, std::mt19937& random)
{
    std::vector<std::byte> bytes(count * type.size());
    for (std::size_t i = 0; i < count; ++i) {
        const float value = 2 + std::sin(0.01f * static_cast<float>(i));
        std::uint32_t bits = type == OIIO::TypeUInt32 ? static_cast<std::uint32_t>(i) : std::bit_cast<std::uint32_t>(value);
        if (type == OIIO::TypeHalf) bits = imath_float_to_half(value);
        if (!smooth || random() % 64 == 0) bits = static_cast<std::uint32_t>(random());
        std::memcpy(&bytes[i * type.size()], &bits, type.size());
    }
    return bytes;
}

std::vector<std::byte> make(const Recipe& recipe, bool smooth)
{
    OIIO::ImageSpec spec(recipe.width, recipe.height, static_cast<int>(recipe.channels.size()), OIIO::TypeFloat);
    spec.channelnames.clear();
    for (const auto& [name, type] : recipe.channels) {
        spec.channelnames.push_back(name);
        spec.channelformats.push_back(type);
    }
    spec.attribute("compression", recipe.compression);
    recipe.adjust(spec);

    // Pixels with their channels together, each in its own type.
    std::mt19937 random(20064);
    const std::size_t count = static_cast<std::size_t>(recipe.width) * static_cast<std::size_t>(recipe.height);
    std::vector<std::byte> pixels(count * spec.pixel_bytes(true));
    std::size_t at = 0;
    for (const auto& [name, type] : recipe.channels) {
        const std::vector<std::byte> channel = samples_of(type, count, smooth, random);
        for (std::size_t i = 0; i < count; ++i)
            std::memcpy(&pixels[i * spec.pixel_bytes(true) + at], &channel[i * type.size()], type.size());
        at += type.size();
    }
    std::vector<unsigned char> buffer;
    OIIO::Filesystem::IOVecOutput memory(buffer);
    const auto output = OIIO::ImageOutput::create("openexr");
    EXPECT_TRUE(output->set_ioproxy(&memory) && output->open("made.exr", spec) && output->write_image(OIIO::TypeUnknown, pixels.data()) &&
                output->close())
        << output->geterror();
    const std::byte* first = reinterpret_cast<const std::byte*>(buffer.data());
    return {first, first + buffer.size()};
}

// What OpenImageIO reads of a channel, in its own type; empty when it refuses the file.
std::vector<float> oracle(std::span<const std::byte> exr, const std::string& channel)
{
    OIIO::Filesystem::IOMemReader memory(exr.data(), exr.size());
    const auto input = OIIO::ImageInput::create("openexr");
    OIIO::ImageSpec spec;
    if (!input->set_ioproxy(&memory) || !input->open("made.exr", spec)) return {};
    const int c = spec.channelindex(channel);
    if (c < 0) return {};
    std::vector<float> values(spec.image_pixels());
    if (spec.channelformat(c) == OIIO::TypeUInt32) {
        std::vector<std::uint32_t> whole(values.size());
        if (!input->read_image(0, 0, c, c + 1, OIIO::TypeUInt32, whole.data()) || input->has_error()) return {};
        return {whole.begin(), whole.end()};
    }
    if (!input->read_image(0, 0, c, c + 1, OIIO::TypeFloat, values.data()) || input->has_error()) return {};
    return values;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b)
{
    return std::ranges::equal(a, b, [](float x, float y) { return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y); });
}

// Every channel of the file by both; fails where ours reads nothing.
void expect_same(std::span<const std::byte> exr)
{
    check_exr_header(exr, "x", no_limit);
    const auto file = PlainExr::open(exr);
    ASSERT_TRUE(file.has_value());
    std::vector<std::size_t> all;
    for (std::size_t c = 0; c < file->channels().size(); ++c) {
        const auto samples = file->read(std::array{c});
        ASSERT_TRUE(samples.has_value()) << file->channels()[c].name;
        EXPECT_TRUE(same_bits(*samples, oracle(exr, file->channels()[c].name))) << file->channels()[c].name;
        all.push_back(c);
    }
    // Together, interleaved.
    const auto together = file->read(all);
    ASSERT_TRUE(together.has_value());
    for (const std::size_t c : all) {
        std::vector<float> one;
        for (std::size_t i = c; i < together->size(); i += all.size()) one.push_back((*together)[i]);
        EXPECT_TRUE(same_bits(one, oracle(exr, file->channels()[c].name))) << file->channels()[c].name;
    }
}

const std::vector<std::pair<std::string, OIIO::TypeDesc>> mixed{{"R", OIIO::TypeHalf},  {"G", OIIO::TypeHalf},  {"B", OIIO::TypeHalf},
                                                                {"A", OIIO::TypeFloat}, {"Z", OIIO::TypeFloat}, {"id", OIIO::TypeUInt32}};

} // namespace

TEST(ExrRead, ReadWhatOpenImageIOReads)
{
    for (const char* compression : {"none", "zips", "zip"})
        for (const auto& size : {std::pair{1, 1}, {1, 61}, {61, 1}, {7, 93}, {64, 17}, {253, 331}})
            for (const bool smooth : {true, false})
                for (const OIIO::TypeDesc& type : {OIIO::TypeUInt32, OIIO::TypeHalf, OIIO::TypeFloat}) {
                    SCOPED_TRACE(std::string(compression) + " " + type.c_str() + " " + std::to_string(size.first) + " x " +
                                 std::to_string(size.second) + (smooth ? " smooth" : " noise"));
                    expect_same(make({compression, {{"Z", type}}, size.first, size.second}, smooth));
                    expect_same(make({compression, mixed, size.first, size.second}, smooth));
                }
}

TEST(ExrRead, OtherKindsAreLeftToOpenImageIO)
{
    const auto plain = [](const Recipe& recipe) { return PlainExr::open(make(recipe, true)).has_value(); };
    EXPECT_TRUE(plain({}));
    for (const char* compression : {"rle", "piz", "pxr24", "b44", "b44a"}) EXPECT_FALSE(plain({.compression = compression})) << compression;
    EXPECT_FALSE(plain({.adjust = [](OIIO::ImageSpec& spec) { spec.tile_width = spec.tile_height = 16; }})) << "tiles";
    EXPECT_FALSE(plain({.adjust = [](OIIO::ImageSpec& spec) { spec.attribute("Orientation", 6); }})) << "turned";
    // They are read none the less.
    for (const char* compression : {"rle", "piz", "pxr24"}) {
        const std::vector<std::byte> exr = make({.compression = compression}, true);
        EXPECT_TRUE(same_bits(decode_raw_depth(exr, "", "x").samples, oracle(exr, "Z"))) << compression;
    }
}

TEST(ExrRead, WindowsAndRowOrdersDoNotMatter)
{
    const auto moved = [](OIIO::ImageSpec& spec) { spec.x = spec.full_x = -1000, spec.y = spec.full_y = 12345; };
    const auto upward = [](OIIO::ImageSpec& spec) { spec.attribute("openexr:lineOrder", "decreasingY"); };
    for (const char* compression : {"none", "zips", "zip"}) {
        expect_same(make({.compression = compression, .adjust = moved}, true));
        expect_same(make({.compression = compression, .adjust = upward}, true));
    }
}

TEST(ExrRead, ChannelsAreTheSameOnes)
{
    // decode_raw_depth takes ours where the names are plain, else OpenImageIO's; a tiled copy always goes to OpenImageIO.
    using Names = std::vector<std::string>;
    for (const Names& names : {Names{"Z"},
                               {"Y"},
                               {"A"},
                               {"alpha"},
                               {"View.A"},
                               {"View.Depth.Z"},
                               {"a.Depth.Z", "b.Depth.Z"},
                               {"depth"},
                               {"R", "G", "B", "depth.Z"},
                               {"R", "G", "B"},
                               {"Y", "A"},
                               {"layer.depth", "layer.Y"},
                               {"B", "Z", "depth.Z"},
                               {"x."}})
        for (const std::string asked : {"", "Z", "A", "none"}) {
            SCOPED_TRACE(names.back() + ", asked for \"" + asked + "\"");
            Recipe recipe{.channels = {}};
            for (const std::string& name : names) recipe.channels.emplace_back(name, OIIO::TypeFloat);
            Recipe tiled = recipe;
            tiled.adjust = [](OIIO::ImageSpec& spec) { spec.tile_width = spec.tile_height = 16; };
            const auto answer = [&](const Recipe& one) -> std::pair<std::vector<float>, std::string> {
                try {
                    return {decode_raw_depth(make(one, true), asked, "x").samples, ""};
                } catch (const Error& error) {
                    return {{}, error.what()};
                }
            };
            const auto [ours, complaint] = answer(recipe);
            const auto [theirs, their_complaint] = answer(tiled);
            EXPECT_TRUE(same_bits(ours, theirs));
            EXPECT_EQ(complaint, their_complaint);
        }
}

TEST(ExrRead, LimitsHoldAsForEveryOtherFile)
{
    const std::vector<std::byte> exr = make({.channels = mixed}, true);
    const std::uint64_t samples = 7 * 93 * 6;
    EXPECT_NO_THROW(decode_raw_depth(exr, "Z", "x", samples));
    EXPECT_EQ(error_of([&] { decode_raw_depth(exr, "Z", "x", samples - 1); }).code(), ErrorCode::too_large);
}

TEST(ExrRead, BrokenFilesAreReadByNobodyOrAlike)
{
    std::mt19937 random(20065);
    for (const char* compression : {"none", "zips", "zip"}) {
        const std::vector<std::byte> whole = make({compression, {{"G", OIIO::TypeHalf}, {"Z", OIIO::TypeFloat}}, 19, 37}, true);
        for (int round = 0; round < 4000; ++round) {
            std::vector<std::byte> exr = whole;
            // Half of the edits in header and table, which are a small part of the file.
            for (auto edits = 1 + random() % 3; edits-- > 0;)
                exr[random() % (random() % 2 ? 900 : exr.size())] = static_cast<std::byte>(random());
            if (random() % 8 == 0) exr.resize(random() % exr.size());
            try {
                check_exr_header(exr, "x", 1 << 14);
                const auto file = PlainExr::open(exr);
                for (std::size_t c = 0; file && c < file->channels().size(); ++c)
                    if (const auto samples = file->read(std::array{c})) {
                        const std::vector<float> theirs = oracle(exr, file->channels()[c].name);
                        EXPECT_TRUE(theirs.empty() || same_bits(*samples, theirs)) << compression << ", round " << round;
                    }
            } catch (const Error&) {
            }
        }
    }
}

TEST(ExrRead, EveryTruncationIsAnError)
{
    for (const char* compression : {"none", "zips", "zip"}) {
        const std::vector<std::byte> whole = make({.compression = compression}, true);
        for (std::size_t size = 0; size < whole.size(); ++size) {
            const auto file = PlainExr::open(std::span(whole).first(size));
            ASSERT_FALSE(file && file->read(std::array{std::size_t{0}})) << compression << " cut to " << size;
        }
    }
}

TEST(ExrRead, ColoursComeInTheOrderOfPixels)
{
    const auto four = [](const char* a, const char* b, const char* c, const char* d) {
        return Recipe{.channels = {{a, OIIO::TypeHalf}, {b, OIIO::TypeHalf}, {c, OIIO::TypeHalf}, {d, OIIO::TypeFloat}}};
    };
    Recipe three = four("R", "G", "B", "A");
    three.channels.pop_back();
    for (Recipe recipe : {three, four("R", "G", "B", "A"), four("R", "G", "B", "Z")}) {
        const Image ours = decode_image(make(recipe, true), "x");
        recipe.adjust = [](OIIO::ImageSpec& spec) { spec.tile_width = spec.tile_height = 16; };
        EXPECT_TRUE(same_bits(ours.pixels, decode_image(make(recipe, true), "x").pixels)) << "tiles are left to OpenImageIO";
    }
}
