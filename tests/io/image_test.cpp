#include <bit>
#include <cmath>
#include <limits>

#include "io/support.hpp"

using namespace penumbra;
using namespace penumbra::test;

namespace {

struct Case {
    const char* format;
    int bits;
    int channels_back; // 0: as written
    // The largest error that rounding to the format's nearest value may make of v in [0, 1].
    double (*bound)(double v);
};

double exact(double) { return 0; }
double step_8(double) { return 0.5 / 255 + 1e-7; } // half a step, and the float32 of the answer
double step_16(double) { return 0.5 / 65535 + 1e-7; }
double half_float(double v) { return std::max(v * 0x1p-11, 0x1p-25); } // 11 bits; below 2^-14 steps of 2^-24

// 8 bits behind an exponent that the three channels share: half a step of the largest is at most 2^-8 of it, and the ramp's channels are
// next to each other, so that the largest exceeds v by less than two steps of the ramp; images with one channel have no others.
double shared_exponent(double v) { return v * 0x1p-8 + 0x1p-9; }

const Case cases[] = {
    {"exr", 32, 0, exact},   {"exr", 16, 0, half_float}, {"tif", 32, 0, exact}, {"tif", 16, 0, step_16},         {"tif", 8, 0, step_8},
    {"png", 16, 0, step_16}, {"png", 8, 0, step_8},      {"pfm", 32, 0, exact}, {"hdr", 32, 3, shared_exponent},
};

const int sizes[][2] = {{1, 1}, {1, 61}, {61, 1}, {7, 93}, {64, 17}};

std::string label(const Case& c) { return std::string(c.format) + " " + std::to_string(c.bits); }

} // namespace

TEST(Image, EveryFormatReturnsWhatWasWritten)
{
    for (const Case& c : cases)
        for (const auto& size : sizes)
            for (const int channels : {1, 3}) {
                SCOPED_TRACE(label(c) + " " + std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(channels));
                const Image image = ramp(size[0], size[1], channels);
                const Image back = decode_image(encode_image(image, {c.format, c.bits}), "x");
                ASSERT_EQ(back.width, image.width);
                ASSERT_EQ(back.height, image.height);
                ASSERT_EQ(back.channels, c.channels_back ? c.channels_back : channels);
                for (int y = 0; y < image.height; ++y)
                    for (int x = 0; x < image.width; ++x)
                        for (int k = 0; k < back.channels; ++k) {
                            const float v = image.at(x, y, std::min(k, channels - 1));
                            ASSERT_LE(std::abs(back.at(x, y, k) - v), c.bound(v))
                                << x << ", " << y << ", " << k << ": " << v << " became " << back.at(x, y, k);
                        }
            }
}

TEST(Image, FourChannelsKeepTheirAlphaApart)
{
    // A sample may exceed its alpha: nothing is multiplied or divided by it.
    for (const Case& c : {cases[0], cases[2], cases[3], cases[5], cases[6]}) {
        SCOPED_TRACE(label(c));
        const Image image{2, 1, 4, {1, 0.5f, 0.25f, 0.5f, 0.75f, 0.5f, 1, 0}};
        const Image back = decode_image(encode_image(image, {c.format, c.bits}), "x");
        ASSERT_EQ(back.channels, 4);
        for (std::size_t i = 0; i < image.pixels.size(); ++i) EXPECT_NEAR(back.pixels[i], image.pixels[i], c.bound(image.pixels[i])) << i;
    }
}

TEST(Image, DefaultBitsAndSpellings)
{
    const Image image = ramp(3, 2, 1);
    const auto bits_of = [&](const char* format) { return encode_image(image, {format, 0}).size(); };
    EXPECT_EQ(bits_of("png"), encode_image(image, {"png", 16}).size());
    EXPECT_EQ(bits_of("tif"), encode_image(image, {"tif", 32}).size());
    EXPECT_EQ(bits_of("TIFF"), encode_image(image, {"tif", 32}).size());
    EXPECT_EQ(bits_of("exr"), encode_image(image, {"exr", 32}).size());
    EXPECT_EQ(encode_image(image, {"pfm", 0}), encode_image(image, {"PFM", 32}));
}

TEST(Image, UnknownFormatsAndBitsAreRefused)
{
    const Image image = ramp(2, 2, 1);
    for (const OutputFormat& format :
         {OutputFormat{"jpg", 8}, OutputFormat{"", 0}, OutputFormat{"png", 32}, OutputFormat{"exr", 8}, OutputFormat{"hdr", 16},
          OutputFormat{"pfm", 16}, OutputFormat{"tif", 12}, OutputFormat{"exr", -1}}) {
        SCOPED_TRACE(format.format + std::to_string(format.bits));
        const Error error = error_of([&] { encode_image(image, format); });
        EXPECT_EQ(error.code(), ErrorCode::usage);
        EXPECT_FALSE(error.hint().empty());
    }
    EXPECT_MENTIONS(error_of([&] { write_image("mask.jpg", image); }), "exr, tif, png, pfm, hdr");
    EXPECT_MENTIONS(error_of([&] { write_image("mask", image); }), "exr, tif, png, pfm, hdr");
    EXPECT_EQ(error_of([&] { encode_image(ramp(2, 2, 4), {"hdr", 32}); }).code(), ErrorCode::usage);
    EXPECT_EQ(error_of([&] { encode_image(ramp(2, 2, 2), {"pfm", 32}); }).code(), ErrorCode::usage);
    EXPECT_EQ(error_of([&] { encode_image(Image{}, {"exr", 32}); }).code(), ErrorCode::invalid_input);
    EXPECT_EQ(error_of([&] { encode_image(Image{2, 2, 1, {0, 1}}, {"exr", 32}); }).code(), ErrorCode::invalid_input);
}

TEST(Image, IntegersTakeVisibilityAndNothingElse)
{
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    for (const OutputFormat& format : {OutputFormat{"png", 16}, OutputFormat{"png", 8}, OutputFormat{"tif", 8}, OutputFormat{"tif", 16}}) {
        for (const float bad : {-0.001f, 1.001f, nan, inf, -inf}) {
            Image image = constant(5, 3, 0.5f);
            image.at(4, 2) = bad;
            const Error error = error_of([&] { encode_image(image, format); });
            EXPECT_EQ(error.code(), ErrorCode::invalid_input);
            EXPECT_MENTIONS(error, "pixel (4, 2)");
        }
        const Image back = decode_image(encode_image({2, 1, 1, {-5e-7f, 1 + 5e-7f}}, format), "x");
        EXPECT_EQ(back.pixels[0], 0);
        EXPECT_EQ(back.pixels[1], 1);
    }
}

TEST(Image, FloatsKeepWhatIsNotFinite)
{
    const float inf = std::numeric_limits<float>::infinity();
    const Image image{4, 1, 1, {inf, -inf, std::numeric_limits<float>::quiet_NaN(), 65504}};
    for (const OutputFormat& format :
         {OutputFormat{"exr", 32}, OutputFormat{"exr", 16}, OutputFormat{"tif", 32}, OutputFormat{"pfm", 32}}) {
        const Image back = decode_image(encode_image(image, format), "x");
        EXPECT_EQ(back.pixels[0], inf);
        EXPECT_EQ(back.pixels[1], -inf);
        EXPECT_TRUE(std::isnan(back.pixels[2]));
        EXPECT_EQ(back.pixels[3], 65504);
    }
    // A half-float has no 70000: it would become infinity without a word.
    EXPECT_MENTIONS(error_of([] { encode_image(constant(1, 1, 70000), {"exr", 16}); }), "65504");
    EXPECT_EQ(error_of([] { encode_image(constant(1, 1, -1), {"hdr", 32}); }).code(), ErrorCode::invalid_input);
}

TEST(Image, PngSaysThatItIsLinear)
{
    const std::vector<std::byte> bytes = encode_image(ramp(4, 4, 1), {"png", 16});
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    EXPECT_EQ(text.find("sRGB"), std::string_view::npos);
    const std::size_t gamma = text.find("gAMA");
    ASSERT_NE(gamma, std::string_view::npos);
    EXPECT_EQ(text.substr(gamma + 4, 4), std::string_view("\x00\x01\x86\xa0", 4)) << "100000 is 1.0";
    EXPECT_NEAR(decode_image(encode_image(constant(1, 1, 0.5f), {"png", 16}), "x").pixels[0], 0.5, 0.5 / 65535 + 1e-7);
}

TEST(Image, PngSaysThatItIsSrgb)
{
    const Image image = ramp(4, 4, 3);
    const std::vector<std::byte> bytes = encode_image(image, {.format = "png", .bits = 8, .srgb = true});
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    EXPECT_NE(text.find("sRGB"), std::string_view::npos);
    EXPECT_EQ(text.substr(text.find("gAMA") + 4, 4), std::string_view("\x00\x00\xb1\x8f", 4)) << "45455 is 1 / 2.2";
    // The samples are as they are without it.
    EXPECT_EQ(decode_image(bytes, "x").pixels, decode_image(encode_image(image, {"png", 8}), "x").pixels);
}

TEST(Image, PngChecksumsAreChecked)
{
    const std::vector<std::byte> whole = encode_image(ramp(5, 4, 3), {"png", 16});
    for (std::size_t at = 8; at < whole.size(); ++at) {
        std::vector<std::byte> bytes = whole;
        bytes[at] ^= std::byte{1};
        EXPECT_THROW(decode_image(bytes, "x"), Error) << "byte " << at;
    }
}

TEST(Image, EveryTruncationIsAnError)
{
    for (const Case& c : cases) {
        // Noise does not compress: each part of the file matters.
        Image image = constant(23, 37, 0);
        unsigned state = 1;
        for (float& v : image.pixels) v = static_cast<float>((state = state * 1664525u + 1013904223u) >> 8) * 0x1p-24f;
        const std::vector<std::byte> whole = encode_image(image, {c.format, c.bits});
        const std::size_t step = std::max<std::size_t>(whole.size() / 97, 1);
        for (std::size_t size = 0; size < whole.size(); size += step) {
            SCOPED_TRACE(label(c) + " cut to " + std::to_string(size) + " of " + std::to_string(whole.size()));
            const std::span part(whole.data(), size);
            EXPECT_EQ(error_of([&] { decode_image(part, "mask.exr"); }).code(), ErrorCode::invalid_input);
            EXPECT_MENTIONS(error_of([&] { decode_raw_depth(part, "", "depth.exr"); }), "depth.exr");
        }
        SCOPED_TRACE(label(c) + " without its last byte");
        EXPECT_EQ(error_of([&] { decode_image(std::span(whole.data(), whole.size() - 1), "x"); }).code(), ErrorCode::invalid_input);
    }
}

TEST(Image, GarbageIsRefusedByItsFirstBytes)
{
    for (const std::string_view text :
         {std::string_view(""), std::string_view("P"), std::string_view("GIF89a..."), std::string_view("\xff\xd8\xff\xe0 jpeg"),
          std::string_view("P5 2 2 255 abcd"), std::string_view("{\"penumbra\": 1}"), std::string_view("PFx")}) {
        const Error error = error_of([&] { decode_image(bytes_of(text), "receivers.depth: a.exr"); });
        EXPECT_EQ(error.code(), ErrorCode::invalid_input);
        EXPECT_EQ(error.message().rfind("receivers.depth: a.exr ", 0), 0u) << error.what();
    }
}

TEST(Image, TooLargeIsRefusedByItsHeader)
{
    for (const Case& c : cases) {
        const std::vector<std::byte> bytes = encode_image(ramp(20, 10, 3), {c.format, c.bits});
        EXPECT_NO_THROW(decode_image(bytes, "x", 600)) << label(c);
        EXPECT_EQ(error_of([&] { decode_image(bytes, "x", 599); }).code(), ErrorCode::too_large) << label(c);
    }
    // 4 billion samples announced, none there.
    EXPECT_EQ(error_of([] { decode_image(bytes_of("Pf\n65536 65536\n-1\n"), "x"); }).code(), ErrorCode::too_large);
    EXPECT_EQ(error_of([] { decode_image(bytes_of("PF\n2147483647 2147483647\n-1\n"), "x"); }).code(), ErrorCode::too_large);
}

TEST(Image, ExrHeadersThatClaimTheSkyAreRefused)
{
    const std::vector<std::byte> whole = encode_image(ramp(4, 4, 1), {"exr", 32});
    const std::string_view text(reinterpret_cast<const char*>(whole.data()), whole.size());
    const std::size_t window = text.find(std::string_view("dataWindow\0box2i\0", 17)) + 17 + 4;
    // Right and bottom, little-endian: one row of 2^28 pixels, a column of them, 2^31 either way.
    for (const std::string_view corner :
         {std::string_view("\xff\xff\xff\x0f\0\0\0\0", 8), std::string_view("\0\0\0\0\xff\xff\xff\x0f", 8),
          std::string_view("\xff\xff\xff\x7f\xff\xff\xff\x7f", 8), std::string_view("\xff\xff\xff\xff\0\0\0\0", 8)}) {
        std::vector<std::byte> bytes = whole;
        std::memcpy(&bytes[window + 8], corner.data(), 8);
        const ErrorCode code = error_of([&] { decode_image(bytes, "x"); }).code();
        EXPECT_TRUE(code == ErrorCode::invalid_input || code == ErrorCode::too_large);
    }
}

TEST(Image, ExrValuesOfAnotherSizeThanTheirTypeAreRefused)
{
    // OpenEXR would read as many bytes as the type has, and the next attribute out of the middle of something.
    const std::vector<std::byte> whole = encode_image(ramp(4, 4, 1), {"exr", 32});
    for (const std::string_view type :
         {std::string_view("chlist\0", 7), std::string_view("compression\0", 12), std::string_view("box2i\0", 6),
          std::string_view("float\0", 6), std::string_view("v2f\0", 4), std::string_view("lineOrder\0", 10)}) {
        const std::string_view text(reinterpret_cast<const char*>(whole.data()), whole.size());
        std::size_t at = text.find(type) + type.size();
        if (type.starts_with("compression") || type.starts_with("lineOrder")) at = text.find(type, at) + type.size(); // names as well
        for (const int change : {-1, 1}) {
            std::vector<std::byte> bytes = whole;
            bytes[at] = static_cast<std::byte>(std::to_integer<int>(bytes[at]) + change);
            const auto value = bytes.begin() + static_cast<std::ptrdiff_t>(at) + 4;
            if (change < 0)
                bytes.erase(value);
            else
                bytes.insert(value, std::byte{0});
            EXPECT_MENTIONS(error_of([&] { decode_image(bytes, "x"); }), "not what its type has");
        }
    }
    // A preview has the size of its pixels.
    const std::string_view preview("preview\0preview\0\x0c\0\0\0\1\0\0\0\1\0\0\0\1\2\3\4", 32);
    std::vector<std::byte> bytes = whole;
    const auto inserted = bytes.insert(bytes.begin() + 8, reinterpret_cast<const std::byte*>(preview.data()),
                                       reinterpret_cast<const std::byte*>(preview.data()) + preview.size());
    inserted[20] = std::byte{2};
    EXPECT_MENTIONS(error_of([&] { decode_image(bytes, "x"); }), "not what its type has");
}

TEST(Pfm, StandsBottomUpInEitherByteOrder)
{
    const std::string header = "Pf\n1 2\n";
    const auto little = bytes_of(header + "-1.0\n" + std::string("\x00\x00\x00\x40\x00\x00\x80\x3f", 8)); // 2, 1
    const auto big = bytes_of(header + "1.0\n" + std::string("\x40\x00\x00\x00\x3f\x80\x00\x00", 8));
    for (const auto& bytes : {little, big}) {
        const Image image = decode_image(bytes, "x");
        ASSERT_EQ(image.pixels.size(), 2u);
        EXPECT_EQ(image.at(0, 0), 1) << "the last row of the file is the top";
        EXPECT_EQ(image.at(0, 1), 2);
    }
}

TEST(Pfm, BrokenHeadersAreErrors)
{
    for (const char* text : {"Pf\n", "Pf\n1\n", "Pf\n1 1\n", "Pf\n0 1\n-1\n", "Pf\n-1 1\n-1\n", "Pf\n1 1\n0\nabcd", "Pf\n1 1\nnan\nabcd",
                             "Pf\nx 1\n-1\nabcd", "Pf\n1 99999999999\n-1\nabcd", "Pf\n1 1\n-1\nabc"})
        EXPECT_EQ(error_of([&] { decode_image(bytes_of(text), "x"); }).code(), ErrorCode::invalid_input) << text;
}

TEST(ImageFile, ReplacesOnlyWhenWhole)
{
    const Folder folder;
    const std::string path = folder / "mask.png";
    write_image(path, constant(2, 2, 0.25f));
    write_image(path, constant(2, 2, 0.75f));
    EXPECT_NEAR(read_image(path).pixels[0], 0.75, 1e-5);
    EXPECT_EQ(folder.files(), 1u) << "no temporary file stays";

    EXPECT_THROW(write_image(path, constant(2, 2, 7)), Error);
    EXPECT_NEAR(read_image(path).pixels[0], 0.75, 1e-5) << "a failed write leaves the old file";
    EXPECT_EQ(folder.files(), 1u);
}

TEST(ImageFile, FailuresSayWhere)
{
    const Folder folder;
    const Image image = constant(1, 1, 1);
    EXPECT_EQ(error_of([&] { write_image(folder / "none/mask.exr", image); }).code(), ErrorCode::output);
    EXPECT_MENTIONS(error_of([&] { write_image(folder / "none/mask.exr", image); }), "none is not there");
    std::filesystem::create_directory(folder / "folder.exr");
    EXPECT_EQ(error_of([&] { write_image(folder / "folder.exr", image); }).code(), ErrorCode::output);
    EXPECT_EQ(error_of([&] { read_image(folder / "none.exr"); }).code(), ErrorCode::not_found);
    EXPECT_EQ(error_of([&] { read_image(folder / "folder.exr"); }).code(), ErrorCode::not_found);
    EXPECT_EQ(error_of([&] { read_image(folder.write("empty.exr", "")); }).code(), ErrorCode::invalid_input);
    EXPECT_NO_THROW(write_file("/dev/null", bytes_of("abc")));
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/null")) << "a device is written to, not replaced";
}

TEST(ImageFile, LinksKeepLeading)
{
    const Folder folder;
    const std::string target = folder.write("target.exr", "old");
    std::filesystem::create_symlink(target, folder / "link.exr");
    write_image(folder / "link.exr", constant(1, 1, 1));
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.exr"));
    EXPECT_EQ(read_image(target).pixels[0], 1);
}
