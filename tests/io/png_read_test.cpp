// PNG files by libspng beside OpenImageIO (libpng): the same samples; what is broken is refused in silence.
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

// As OpenImageIO reads it.
std::vector<float> by_openimageio(std::span<const std::byte> png, OIIO::ImageSpec& spec)
{
    OIIO::Filesystem::IOMemReader memory(png.data(), png.size());
    const auto input = OIIO::ImageInput::create("png");
    OIIO::ImageSpec wanted;
    wanted.attribute("oiio:UnassociatedAlpha", 1);
    EXPECT_TRUE(input->set_ioproxy(&memory) && input->open("x.png", spec, wanted)) << input->geterror();
    std::vector<float> samples(spec.image_pixels() * static_cast<std::size_t>(spec.nchannels));
    EXPECT_TRUE(input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeFloat, samples.data())) << input->geterror();
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

TEST(PngRead, EveryKindKeepsItsSamples)
{
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(PENUMBRA_FUZZ_CORPUS "/image_png")) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("found_")) continue;
        SCOPED_TRACE(name);
        const std::vector<std::byte> png = stored(name);
        OIIO::ImageSpec spec;
        const std::vector<float> expected = by_openimageio(png, spec);
        const Image image = decode_image(png, name);
        EXPECT_EQ(image.width, spec.width);
        EXPECT_EQ(image.height, spec.height);
        EXPECT_EQ(image.channels, spec.nchannels);
        EXPECT_EQ(image.pixels, expected);
        EXPECT_EQ(decode_png(png, name, no_limit).bits, spec.format == OIIO::TypeUInt16 ? 16 : 8);
        ++files;
    }
    EXPECT_GE(files, 30);
}

TEST(PngRead, WhatIsBrokenIsRefusedInSilence)
{
    const Chunk grey = header(8, 0), colours = header(8, 3);
    const Chunk rows = pixels(bytes_of({0, 1, 2, 3, 0, 4, 5, 6})), palette{"PLTE", bytes_of({1, 2, 3, 4, 5, 6})};
    const struct {
        const char* what;
        std::vector<Chunk> chunks;
    } cases[] = {
        {"no header", {rows}},
        {"two headers", {grey, grey, rows}},
        {"a short header", {{"IHDR", bytes_of({0, 0, 0, 3})}, rows}},
        {"no columns", {header(8, 0, 0, 2), rows}},
        {"3 bits", {header(3, 0), rows}},
        {"16 bits of palette", {header(16, 3), palette, rows}},
        {"colour type 5", {header(8, 5), rows}},
        {"interlace method 2", {header(8, 0, 3, 2, 2), rows}},
        {"no pixels", {grey}},
        {"no stream", {grey, {"IDAT", bytes_of({1, 2, 3})}}},
        {"too few pixels", {grey, pixels(bytes_of({0, 1, 2, 3, 0, 4, 5}))}},
        {"a bomb", {header(8, 0, 30000, 30000), rows}},
        {"filter 5", {grey, pixels(bytes_of({0, 1, 2, 3, 5, 4, 5, 6}))}},
        {"no palette", {colours, rows}},
        {"a palette of 4 bytes", {colours, {"PLTE", bytes_of({1, 2, 3, 4})}, rows}},
        {"a palette of 3 for 1 bit", {header(1, 3), {"PLTE", bytes_of({1, 2, 3, 4, 5, 6, 7, 8, 9})}, rows}},
        {"a late palette", {colours, rows, palette}},
    };
    for (const auto& [what, chunks] : cases) {
        SCOPED_TRACE(what);
        const std::vector<std::byte> png = png_of(chunks);
        EXPECT_EQ(printed([&] {
                      const Error error = error_of([&] { decode_image(png, "x"); });
                      EXPECT_EQ(error.code(), ErrorCode::invalid_input);
                      EXPECT_MENTIONS(error, "x is truncated or broken");
                  }),
                  0);
    }
}

TEST(PngRead, WhatIsOddButSoundIsReadInSilence)
{
    // Pixels beyond the palette's end are black.
    const std::vector<std::byte> beyond =
        png_of({header(8, 3), {"PLTE", bytes_of({255, 0, 0})}, pixels(bytes_of({0, 0, 1, 9, 0, 0, 255, 0}))});
    // Only the low 8 of a transparent colour's 16 bits count.
    const std::vector<std::byte> clear = png_of({header(8, 0), {"tRNS", bytes_of({7, 2})}, pixels(bytes_of({0, 1, 2, 3, 0, 4, 5, 6}))});
    // A palette in an image of grey, a broken colour profile, and bytes behind the pixels.
    Chunk longer = pixels(bytes_of({0, 1, 2, 3, 0, 4, 5, 6}));
    longer.data.push_back(std::byte{7});
    const std::vector<std::byte> odd = png_of({header(8, 0), {"PLTE", bytes_of({1, 2, 3})}, {"iCCP", bytes_of({1})}, longer});
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

TEST(PngRead, LimitsComeBeforePixels)
{
    const std::vector<std::byte> png = png_of({header(16, 2, 300, 200), {"IDAT", bytes_of({1})}});
    EXPECT_EQ(error_of([&] { decode_png(png, "x", 300 * 200 * 3 - 1); }).code(), ErrorCode::too_large);
    EXPECT_EQ(error_of([&] { decode_png(png, "x", 300 * 200 * 3); }).code(), ErrorCode::invalid_input);
}
