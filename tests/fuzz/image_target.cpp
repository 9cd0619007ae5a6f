// An image of any format, as a picture and as depth.
#include <algorithm>
#include <cstring>
#include <optional>

#include <libdeflate.h>

#include "fuzz/target.hpp"
#include "io/image_format.hpp"
#include "io/image_io.hpp"

using namespace penumbra;
using fuzz::expect;

namespace {

bool same_bits(const std::vector<float>& a, const std::vector<float>& b)
{
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// Written in a format that holds these values exactly, and read again, an image is the same.
void expect_kept(const Image& image, const OutputFormat& format)
{
    const Image again = decode_image(encode_image(image, format), "again", fuzz::max_samples);
    expect(again.width == image.width && again.height == image.height && again.channels == image.channels &&
               same_bits(again.pixels, image.pixels),
           "an image differs once it was written as " + format.format + std::to_string(format.bits) + " and read");
}

void check_image(const Image& image, ImageFormat format)
{
    expect(image.width > 0 && image.height > 0 && image.channels >= 1 && image.channels <= 4, "an image of no size");
    expect(image.pixels.size() == image.pixel_count() * static_cast<std::size_t>(image.channels),
           "an image of another size than it claims");
    expect(image.pixels.size() <= fuzz::max_samples, "an image over the limit");
    expect_kept(image, {"exr", 32});
    if (image.channels == 1 || image.channels == 3) expect_kept(image, {"pfm", 32});
    // Whole steps of 1/255 or 1/65535, which 16 bits hold; read again they are the nearest float32 of those.
    if (format == ImageFormat::png) {
        const Image steps = decode_image(encode_image(image, {"png", 16}), "again", fuzz::max_samples);
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            expect(std::abs(steps.pixels[i] - image.pixels[i]) <= 0x1p-23f, "a PNG's sample is no step of 1/65535");
        expect_kept(steps, {"png", 16});
    }
}

void check_depth(const RawDepth& raw, const std::optional<Image>& image, ImageFormat format)
{
    expect(raw.width > 0 && raw.height > 0, "depth of no size");
    expect(raw.samples.size() == static_cast<std::size_t>(raw.width) * static_cast<std::size_t>(raw.height),
           "depth of another size than it claims");
    expect(raw.samples.size() <= fuzz::max_samples, "depth over the limit");
    // Depth may be in another part of an EXR than the picture.
    if (image && format != ImageFormat::exr)
        expect(image->width == raw.width && image->height == raw.height, "depth of another size than the picture");
}

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const auto bytes = fuzz::bytes_of(data, size);
    const ImageFormat format = sniff(bytes);
    std::optional<Image> image;
    fuzz::accepted([&] { image = decode_image(bytes, "image", fuzz::max_samples); });
    if (image) check_image(*image, format);
    for (const char* channel : {"", "Z"})
        fuzz::accepted([&] { check_depth(decode_raw_depth(bytes, channel, "depth", fuzz::max_samples), image, format); });
    return 0;
}

namespace {

std::uint32_t big_endian(const std::uint8_t* bytes)
{
    return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 | bytes[3];
}

// Sets the checksums of a PNG's chunks right, or else nearly every change would end there.
void repair_png(std::uint8_t* data, std::size_t size)
{
    for (std::size_t at = 8; size - at >= 12;) {
        const std::size_t length = big_endian(data + at);
        if (length > size - at - 12) return;
        const std::uint32_t sum = libdeflate_crc32(0, data + at + 4, length + 4);
        for (std::size_t i = 0; i < 4; ++i) data[at + 8 + length + i] = static_cast<std::uint8_t>(sum >> (24 - 8 * i));
        at += length + 12;
    }
}

} // namespace

// One in eight keeps its wrong checksums.
std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed)
{
    size = LLVMFuzzerMutate(data, size, max_size);
    if (seed % 8 != 0 && size >= 8 && sniff(fuzz::bytes_of(data, size)) == ImageFormat::png) repair_png(data, size);
    return size;
}
