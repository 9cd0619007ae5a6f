// What the encoders promise beyond pixels: the same bytes for the same image, nothing of the place and time of writing, files that others
// read.
#include <chrono>
#include <cmath>
#include <random>
#include <thread>

#include <Imath/half.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "io/png.hpp"
#include "io/support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

const OutputFormat formats[] = {{"exr", 32}, {"exr", 16}, {"tif", 32}, {"tif", 16}, {"tif", 8},
                                {"png", 16}, {"png", 8},  {"pfm", 32}, {"hdr", 32}};

std::vector<std::vector<std::byte>> encoded(const Image& image)
{
    std::vector<std::vector<std::byte>> files;
    for (const OutputFormat& format : formats) files.push_back(encode_image(image, format));
    files.push_back(encode_depth({.width = image.width, .height = image.height, .depth = image.pixels}));
    return files;
}

Image noise(int width, int height, int channels)
{
    Image image = ramp(width, height, channels);
    std::mt19937 random(20066);
    for (float& value : image.pixels) value = static_cast<float>(random() >> 8) * 0x1p-24f;
    return image;
}

// A PNG's samples by OpenImageIO alone; `spec` is set to what it says of the file.
std::vector<std::uint16_t> png_samples(std::span<const std::byte> png, OIIO::ImageSpec& spec)
{
    OIIO::Filesystem::IOMemReader memory(png.data(), png.size());
    const auto input = OIIO::ImageInput::create("png");
    OIIO::ImageSpec wanted;
    wanted.attribute("oiio:UnassociatedAlpha", 1);
    EXPECT_TRUE(input->set_ioproxy(&memory) && input->open("made.png", spec, wanted)) << input->geterror();
    std::vector<std::uint16_t> samples(static_cast<std::size_t>(spec.width * spec.height * spec.nchannels));
    if (spec.format == OIIO::TypeUInt16) {
        EXPECT_TRUE(input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeUInt16, samples.data())) << input->geterror();
        return samples;
    }
    std::vector<std::uint8_t> bytes(samples.size());
    EXPECT_TRUE(input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeUInt8, bytes.data())) << input->geterror();
    return {bytes.begin(), bytes.end()};
}

std::size_t count_of(std::span<const std::byte> bytes, std::string_view word)
{
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find(word, at)) != std::string_view::npos; ++at) ++count;
    return count;
}

} // namespace

TEST(ImageEncode, SamePixelsSameBytes)
{
    const Image image = ramp(61, 17, 1);
    const auto first = encoded(image);
    std::this_thread::sleep_for(std::chrono::milliseconds(1100)); // a clock of whole seconds moves on
    const auto second = encoded(image);
    for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i], second[i]) << "file " << i;
}

TEST(ImageEncode, NothingOfPlaceAndTime)
{
    char host[256] = "";
    ASSERT_EQ(gethostname(host, sizeof host - 1), 0);
    const auto today = std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now());
    const std::string year = std::to_string(static_cast<int>(std::chrono::year_month_day(today).year()));
    for (const auto& bytes : encoded(constant(3, 3, 0.5f))) {
        // Shorter names may stand in a file by chance.
        if (std::strlen(host) > 4) {
            EXPECT_EQ(count_of(bytes, host), 0u);
        }
        for (const char* separator : {":", "-", "/"}) EXPECT_EQ(count_of(bytes, year + separator), 0u);
    }
}

TEST(PngEncode, OpenImageIOReadsTheNearestIntegers)
{
    for (const auto& size : {std::pair{1, 1}, {1, 61}, {61, 1}, {7, 93}, {130, 131}})
        for (const int channels : {1, 2, 3, 4})
            for (const int bits : {8, 16}) {
                SCOPED_TRACE(std::to_string(size.first) + " x " + std::to_string(size.second) + " x " + std::to_string(channels) + ", " +
                             std::to_string(bits) + " bits");
                const Image image = noise(size.first, size.second, channels);
                OIIO::ImageSpec spec;
                const std::vector<std::uint16_t> samples = png_samples(encode_png(image, bits), spec);
                EXPECT_EQ(spec.width, image.width);
                EXPECT_EQ(spec.height, image.height);
                ASSERT_EQ(spec.nchannels, channels);
                EXPECT_EQ(spec.format, bits == 8 ? OIIO::TypeUInt8 : OIIO::TypeUInt16);
                for (std::size_t i = 0; i < samples.size(); ++i)
                    ASSERT_EQ(samples[i], std::lround(static_cast<double>(image.pixels[i]) * (bits == 8 ? 255 : 65535))) << i;
            }
}

TEST(PngEncode, EveryStepOf16BitsIsKept)
{
    Image image{256, 256, 1, {}};
    for (int i = 0; i < 65536; ++i) image.pixels.push_back(static_cast<float>(i) / 65535);
    OIIO::ImageSpec spec;
    const std::vector<std::uint16_t> samples = png_samples(encode_png(image, 16), spec);
    for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_EQ(samples[i], i);
}

TEST(PngEncode, LargeDataIsSplitIntoChunks)
{
    // Noise does not become smaller: 2 MiB of it.
    const Image image = noise(1024, 1024, 1);
    const std::vector<std::byte> png = encode_png(image, 16);
    EXPECT_GE(count_of(png, "IDAT"), 2u);
    EXPECT_LT(png.size(), (std::size_t{2} << 20) + 4096) << "incompressible rows grow by a few bytes alone";
    const Image back = decode_image(png, "x");
    for (std::size_t i = 0; i < image.pixels.size(); ++i) ASSERT_NEAR(back.pixels[i], image.pixels[i], 0.5 / 65535 + 1e-7);
}

TEST(ExrEncode, OpenImageIOReadsTheSameSamples)
{
    // Noise of every size from 1 byte a chunk on: some chunks become smaller, some stay as they are, some would keep their very size.
    std::mt19937 random(20067);
    for (const int channels : {1, 2, 3, 4})
        for (const int bits : {16, 32})
            for (int width = 1; width < 60; ++width) {
                SCOPED_TRACE(std::to_string(width) + " x " + std::to_string(channels) + ", " + std::to_string(bits) + " bits");
                Image image = ramp(width, 35, channels);
                for (float& value : image.pixels)
                    if (random() % 4 == 0) value = static_cast<float>(random() >> 8) * 0x1p-24f;
                const std::vector<std::byte> exr = encode_image(image, {"exr", bits});
                OIIO::Filesystem::IOMemReader memory(exr.data(), exr.size());
                const auto input = OIIO::ImageInput::create("openexr");
                OIIO::ImageSpec spec;
                ASSERT_TRUE(input->set_ioproxy(&memory) && input->open("made.exr", spec)) << input->geterror();
                ASSERT_EQ(spec.nchannels, channels);
                EXPECT_EQ(spec.format, bits == 16 ? OIIO::TypeHalf : OIIO::TypeFloat);
                EXPECT_EQ(spec.channelnames[0], channels < 3 ? "Y" : "R");
                EXPECT_EQ(spec.alpha_channel, channels % 2 == 0 ? channels - 1 : -1);
                std::vector<float> samples(image.pixels.size()), expected = image.pixels;
                ASSERT_TRUE(input->read_image(0, 0, 0, channels, OIIO::TypeFloat, samples.data())) << input->geterror();
                if (bits == 16)
                    for (float& value : expected) value = imath_half_to_float(imath_float_to_half(value));
                EXPECT_EQ(samples, expected);
            }
}

TEST(PngDecode, HeadersStandFirstAndOnce)
{
    const std::vector<std::byte> png = encode_png(ramp(3, 2, 1), 16);
    const auto header = std::span(png).subspan(8, 25);
    std::vector<std::byte> twice(png);
    twice.insert(twice.begin() + 8, header.begin(), header.end());
    std::vector<std::byte> without(png);
    without.erase(without.begin() + 8, without.begin() + 33);
    for (const auto& bytes : {twice, without}) EXPECT_MENTIONS(error_of([&] { decode_image(bytes, "x"); }), "truncated or broken");
}
