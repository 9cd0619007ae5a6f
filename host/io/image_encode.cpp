// Images to bytes and files. Values stay linear: nothing here knows a transfer curve.
#include "io/image_io.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <penumbra/error.hpp>

#include "io/image_format.hpp"
#include "io/pfm.hpp"
#include "io/png.hpp"

namespace penumbra {

namespace {

constexpr float largest_half = 65504;

// How far a visibility may lie outside [0, 1] and still be rounding: sums of a thousand or so float32 terms around 1 (2^-24 each, growing
// with the square root of their number) stay inside. A sixteenth of a 16-bit step.
constexpr float rounding_noise = 1e-6f;

[[noreturn]] void fail_value(const Image& image, std::size_t sample, const std::string& format, const char* expected)
{
    const std::size_t pixel = sample / static_cast<std::size_t>(image.channels);
    const std::size_t width = static_cast<std::size_t>(image.width);
    throw Error(ErrorCode::invalid_input,
                "the value " + std::to_string(image.pixels[sample]) + " at pixel (" + std::to_string(pixel % width) + ", " +
                    std::to_string(pixel / width) + ") does not fit into " + format + ", which holds " + expected,
                "write exr with 32 bits");
}

template <class Fits> void check_values(const Image& image, const std::string& format, const char* expected, const Fits& fits)
{
    const auto bad = std::ranges::find_if_not(image.pixels, fits);
    if (bad != image.pixels.end()) fail_value(image, static_cast<std::size_t>(bad - image.pixels.begin()), format, expected);
}

void check_shape(const Image& image, const OutputFormat& format)
{
    if (image.width < 1 || image.height < 1 || image.channels < 1 || image.channels > 4 ||
        image.pixels.size() != image.pixel_count() * static_cast<std::size_t>(image.channels))
        throw Error(ErrorCode::invalid_input,
                    "an image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + " x " +
                        std::to_string(image.channels) + " with " + std::to_string(image.pixels.size()) + " samples cannot be written",
                    "at least 1 x 1 pixels and 1 to 4 channels");
    if ((format.format == "pfm" || format.format == "hdr") && image.channels != 1 && image.channels != 3)
        throw Error(ErrorCode::usage, format.format + " holds 1 or 3 channels, not " + std::to_string(image.channels),
                    "formats: exr, tif, png");
}

// 16 bits in a TIFF are integers: hardly anything else reads its half-floats.
bool holds_integers(const OutputFormat& format) { return format.format == "png" || (format.format == "tif" && format.bits < 32); }

// Radiance pixels share an exponent, and OpenImageIO cuts the mantissas off. Rounding to their 8 bits first halves the error and takes out
// the bias.
void round_to_shared_exponent(float* rgb)
{
    const float largest = std::max({rgb[0], rgb[1], rgb[2]});
    int exponent = 0;
    std::frexp(largest, &exponent);
    float step = std::ldexp(1.0f, exponent - 8);
    if (std::nearbyint(largest / step) >= 256) step *= 2;
    if (step == 0) return;
    for (int c = 0; c < 3; ++c) rgb[c] = std::nearbyint(rgb[c] / step) * step;
}

// Three equal channels where there is one: Radiance knows no other.
std::vector<float> radiance_pixels(const Image& image)
{
    std::vector<float> rgb(image.pixel_count() * 3);
    const std::size_t channels = static_cast<std::size_t>(image.channels);
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) rgb[3 * i + c] = image.pixels[i * channels + std::min(c, channels - 1)];
        round_to_shared_exponent(&rgb[3 * i]);
    }
    return rgb;
}

std::vector<float> clamped(const std::vector<float>& values)
{
    std::vector<float> result(values);
    for (float& value : result) value = std::clamp(value, 0.0f, 1.0f);
    return result;
}

OIIO::TypeDesc stored_type(const OutputFormat& format)
{
    if (holds_integers(format)) return format.bits == 8 ? OIIO::TypeUInt8 : OIIO::TypeUInt16;
    return format.bits == 16 ? OIIO::TypeHalf : OIIO::TypeFloat;
}

// ZIP at zlib's fastest level (docs/bench.md has times and sizes). No date: the same pixels make the same bytes.
OIIO::ImageSpec spec_for(const Image& image, const OutputFormat& format)
{
    OIIO::ImageSpec spec(image.width, image.height, format.format == "hdr" ? 3 : image.channels, stored_type(format));
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("oiio:UnassociatedAlpha", 1); // samples as they stand
    if (format.format == "exr") spec.attribute("compression", "zip:1");
    if (format.format == "tif") spec.attribute("tiff:zipquality", 1);
    // Left out, OpenImageIO writes the time of day. These blanks are Exif's way to say that it is not known.
    spec.attribute("DateTime", "    :  :     :  :  ");
    return spec;
}

std::vector<std::byte> encode(const OIIO::ImageSpec& spec, const std::vector<float>& pixels, const OutputFormat& format)
{
    configure_openimageio();
    const std::string name = plugin(format_of(format));
    std::vector<unsigned char> buffer;
    OIIO::Filesystem::IOVecOutput memory(buffer);
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(name);
    if (!output || !output->set_ioproxy(&memory) || !output->open("image." + name, spec) ||
        !output->write_image(OIIO::TypeFloat, pixels.data()) || !output->close())
        throw Error(ErrorCode::output,
                    "the image cannot be written as " + format.format + ": " + (output ? output->geterror() : OIIO::geterror()));
    std::vector<std::byte> bytes(buffer.size());
    std::memcpy(bytes.data(), buffer.data(), buffer.size());
    return bytes;
}

} // namespace

std::vector<std::byte> encode_image(const Image& image, const OutputFormat& requested)
{
    const OutputFormat format = checked(requested, {});
    check_shape(image, format);
    const std::string title = format.format + " with " + std::to_string(format.bits) + " bits";
    if (holds_integers(format)) {
        check_values(image, title, "0 to 1", [](float v) { return v >= -rounding_noise && v <= 1 + rounding_noise; });
        if (format.format == "png") return encode_png(image, format.bits);
        return encode(spec_for(image, format), clamped(image.pixels), format);
    }
    if (format.format == "pfm") return encode_pfm(image);
    if (format.format == "hdr") {
        check_values(image, title, "finite values from 0 on", [](float v) { return v >= 0 && v <= 1e38f; });
        return encode(spec_for(image, format), radiance_pixels(image), format);
    }
    // Infinity and NaN are kept as such; what is finite must stay so.
    if (format.bits == 16)
        check_values(image, title, "values up to 65504", [](float v) { return !std::isfinite(v) || std::abs(v) <= largest_half; });
    return encode(spec_for(image, format), image.pixels, format);
}

std::vector<std::byte> encode_depth(const DepthMap& depth)
{
    const Image image{depth.width, depth.height, 1, depth.depth};
    const OutputFormat format{"exr", 32};
    check_shape(image, format);
    OIIO::ImageSpec spec = spec_for(image, format);
    spec.channelnames = {"Z"};
    spec.z_channel = 0;
    return encode(spec, image.pixels, format);
}

void write_image(const std::string& path, const Image& image, const OutputFormat& format)
{
    const OutputFormat complete = checked(by_extension(format, path), path);
    std::vector<std::byte> bytes;
    try {
        bytes = encode_image(image, complete);
    } catch (const Error& error) {
        throw error.within(path);
    }
    write_file(path, bytes);
}

} // namespace penumbra
