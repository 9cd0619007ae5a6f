// PNG files as they come, and as libpng gets them: the same samples, and nothing for it to complain about.
#include <filesystem>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <sys/mman.h>

#include "io/png.hpp"
#include "io/png_chunks.hpp"
#include "io/support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

constexpr std::uint64_t no_limit = std::uint64_t{1} << 30;

std::vector<std::byte> stored(const std::string& name) { return read_file(PENUMBRA_FUZZ_CORPUS "/image_png/" + name, name); }

// Integers as OpenImageIO reads them, from a file as it stands.
std::vector<std::uint16_t> by_openimageio(std::span<const std::byte> png, OIIO::ImageSpec& spec)
{
    OIIO::Filesystem::IOMemReader memory(png.data(), png.size());
    const auto input = OIIO::ImageInput::create("png");
    OIIO::ImageSpec wanted;
    wanted.attribute("oiio:UnassociatedAlpha", 1);
    EXPECT_TRUE(input->set_ioproxy(&memory) && input->open("x.png", spec, wanted)) << input->geterror();
    std::vector<std::uint16_t> samples(spec.image_pixels() * static_cast<std::size_t>(spec.nchannels));
    EXPECT_TRUE(input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeUInt16, samples.data())) << input->geterror();
    return samples;
}

// How much `act` prints to standard error.
template <class Act> off_t printed(const Act& act)
{
    const int before = ::dup(STDERR_FILENO), caught = ::memfd_create("caught", MFD_CLOEXEC);
    ::dup2(caught, STDERR_FILENO);
    act();
    std::fflush(stderr);
    const off_t bytes = ::lseek(caught, 0, SEEK_END);
    ::dup2(before, STDERR_FILENO);
    ::close(before);
    ::close(caught);
    return bytes;
}

std::vector<std::byte> bytes_of(std::initializer_list<int> values)
{
    std::vector<std::byte> bytes;
    for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
    return bytes;
}

struct Chunk {
    std::string type;
    std::vector<std::byte> data;
};

// 3 x 2 pixels of 8 bits by default.
Chunk header(int bits, int colour, int width = 3, int height = 2, int interlaced = 0)
{
    return {"IHDR", bytes_of({0, 0, width >> 8, width & 255, 0, 0, height >> 8, height & 255, bits, colour, 0, 0, interlaced})};
}

// A zlib stream of `bytes`.
Chunk pixels(std::vector<std::byte> bytes)
{
    std::vector<std::byte> png;
    append_rows(png, bytes, 1);
    return {"IDAT", {png.begin() + 8, png.end() - 4}};
}

std::vector<std::byte> png_of(const std::vector<Chunk>& chunks)
{
    std::vector<std::byte> png(png_signature.begin(), png_signature.end());
    for (const Chunk& chunk : chunks) append_chunk(png, chunk.type, chunk.data);
    append_chunk(png, "IEND", {});
    return png;
}

} // namespace

TEST(PngUnpack, EveryKindKeepsItsSamples)
{
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(PENUMBRA_FUZZ_CORPUS "/image_png")) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("found_")) continue;
        SCOPED_TRACE(name);
        const std::vector<std::byte> png = stored(name), unpacked = unpacked_png(png, name, no_limit);
        OIIO::ImageSpec before, after;
        const std::vector<std::uint16_t> expected = by_openimageio(png, before);
        EXPECT_EQ(by_openimageio(unpacked, after), expected);
        EXPECT_EQ(after.nchannels, before.nchannels);
        EXPECT_EQ(after.format, before.format);
        ++files;
    }
    EXPECT_GE(files, 30);
}

TEST(PngUnpack, WhatLibpngWouldComplainAboutIsRefusedInSilence)
{
    const Chunk grey = header(8, 0), colours = header(8, 3);
    const Chunk rows = pixels(bytes_of({0, 1, 2, 3, 0, 4, 5, 6})), palette{"PLTE", bytes_of({1, 2, 3, 4, 5, 6})};
    const struct {
        std::string expected;
        std::vector<Chunk> chunks;
    } cases[] = {
        {"IHDR", {rows}},
        {"IHDR", {grey, grey, rows}},
        {"13", {{"IHDR", bytes_of({0, 0, 0, 3})}, rows}},
        {"no pixels", {header(8, 0, 0, 2), rows}},
        {"3 bits of colour type 0", {header(3, 0), rows}},
        {"16 bits of colour type 3", {header(16, 3), palette, rows}},
        {"8 bits of colour type 5", {header(8, 5), rows}},
        {"which PNG does not have", {header(8, 0, 3, 2, 2), rows}},
        {"unpacked", {grey}},
        {"unpacked", {grey, {"IDAT", bytes_of({1, 2, 3})}}},
        {"unpacked", {grey, pixels(bytes_of({0, 1, 2, 3, 0, 4, 5}))}},
        {"unpacked", {grey, pixels(bytes_of({0, 1, 2, 3, 0, 4, 5, 6, 0}))}},
        {"cannot hold", {header(8, 0, 30000, 30000), rows}},
        {"filter", {grey, pixels(bytes_of({0, 1, 2, 3, 5, 4, 5, 6}))}},
        {"palette has 0", {colours, rows}},
        {"palette has 4", {colours, {"PLTE", bytes_of({1, 2, 3, 4})}, rows}},
        {"palette has 9", {header(1, 3), {"PLTE", bytes_of({1, 2, 3, 4, 5, 6, 7, 8, 9})}, rows}},
        {"PLTE", {colours, palette, palette, rows}},
        {"PLTE", {colours, rows, palette}},
        {"tRNS", {grey, {"tRNS", bytes_of({1})}, rows}},
        {"tRNS", {header(8, 4), {"tRNS", bytes_of({0, 1})}, rows}},
        {"tRNS", {header(1, 3), {"PLTE", bytes_of({1, 2, 3})}, {"tRNS", bytes_of({1, 2, 3})}, rows}},
    };
    for (const auto& [expected, chunks] : cases) {
        const std::vector<std::byte> png = png_of(chunks);
        EXPECT_EQ(printed([&] { EXPECT_MENTIONS(error_of([&] { decode_image(png, "x"); }), expected); }), 0) << expected;
    }
}

TEST(PngUnpack, WhatIsOddButSoundIsReadInSilence)
{
    // Pixels beyond the palette's end are black.
    const std::vector<std::byte> beyond =
        png_of({header(8, 3), {"PLTE", bytes_of({255, 0, 0})}, pixels(bytes_of({0, 0, 1, 9, 0, 0, 255, 0}))});
    // Only the low 8 of a transparent colour's 16 bits count.
    const std::vector<std::byte> clear = png_of({header(8, 0), {"tRNS", bytes_of({7, 2})}, pixels(bytes_of({0, 1, 2, 3, 0, 4, 5, 6}))});
    // A palette in an image of grey, a broken colour profile, and bytes behind the pixels.
    Chunk longer = pixels(bytes_of({0, 1, 2, 3, 0, 4, 5, 6}));
    longer.data.push_back(std::byte{7});
    const std::vector<std::byte> odd = png_of({header(8, 0), {"PLTE", bytes_of({1, 2})}, {"iCCP", bytes_of({1})}, longer});
    Image a, b, c;
    EXPECT_EQ(printed([&] {
                  a = decode_image(beyond, "x");
                  b = decode_image(clear, "x");
                  c = decode_image(odd, "x");
              }),
              0);
    EXPECT_EQ(a.channels, 3);
    EXPECT_EQ(std::vector(a.pixels.begin(), a.pixels.begin() + 9), (std::vector<float>{1, 0, 0, 0, 0, 0, 0, 0, 0}));
    ASSERT_EQ(b.channels, 2);
    EXPECT_EQ(b.pixels[3], 0) << "the second pixel is clear";
    EXPECT_EQ(b.pixels[5], 1);
    EXPECT_NEAR(c.pixels[5], 6.0 / 255, 0x1p-24);
}

TEST(PngUnpack, LimitsComeBeforePixels)
{
    const std::vector<std::byte> png = png_of({header(16, 2, 300, 200), {"IDAT", bytes_of({1})}});
    EXPECT_EQ(error_of([&] { unpacked_png(png, "x", 300 * 200 * 3 - 1); }).code(), ErrorCode::too_large);
    EXPECT_EQ(error_of([&] { unpacked_png(png, "x", 300 * 200 * 3); }).code(), ErrorCode::invalid_input);
    std::vector<std::byte> wide = bytes_of({0, 15, 66, 65, 0, 0, 0, 1, 8, 0, 0, 0, 0}); // 1000001
    EXPECT_EQ(error_of([&] { unpacked_png(png_of({{"IHDR", wide}, {"IDAT", {}}}), "x", no_limit); }).code(), ErrorCode::too_large);
}
