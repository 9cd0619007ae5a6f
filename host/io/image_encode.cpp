// Images to bytes and files. Values stay linear: nothing here knows a transfer curve.
#include "io/image_io.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <penumbra/error.hpp>

#include "io/exr_write.hpp"
#include "io/image_format.hpp"
#include "io/openimageio/openimageio.hpp"
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
Image radiance_image(const Image& image)
{
    std::vector<float> rgb(image.pixel_count() * 3);
    const std::size_t channels = static_cast<std::size_t>(image.channels);
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) rgb[3 * i + c] = image.pixels[i * channels + std::min(c, channels - 1)];
        round_to_shared_exponent(&rgb[3 * i]);
    }
    return {image.width, image.height, 3, std::move(rgb)};
}

Image clamped(Image image)
{
    for (float& value : image.pixels) value = std::clamp(value, 0.0f, 1.0f);
    return image;
}

} // namespace

std::vector<std::byte> encode_image(const Image& image, const OutputFormat& requested)
{
    const OutputFormat format = checked(requested, {});
    check_shape(image, format);
    const std::string title = format.format + " with " + std::to_string(format.bits) + " bits";
    if (holds_integers(format)) {
        check_values(image, title, "0 to 1", [](float v) { return v >= -rounding_noise && v <= 1 + rounding_noise; });
        if (format.format == "png") return encode_png(image, format.bits, format.srgb);
        return openimageio().encode(clamped(image), ImageFormat::tiff, format.bits);
    }
    if (format.format == "pfm") return encode_pfm(image);
    if (format.format == "hdr") {
        check_values(image, title, "finite values from 0 on", [](float v) { return v >= 0 && v <= 1e38f; });
        return openimageio().encode(radiance_image(image), ImageFormat::hdr, format.bits);
    }
    if (format.format == "tif") return openimageio().encode(image, ImageFormat::tiff, format.bits);
    // Infinity and NaN are kept as such; what is finite must stay so.
    if (format.bits == 16)
        check_values(image, title, "values up to 65504", [](float v) { return !std::isfinite(v) || std::abs(v) <= largest_half; });
    static constexpr const char *grey[] = {"Y", "A"}, *colours[] = {"R", "G", "B", "A"};
    if (format.channels.size() == static_cast<std::size_t>(image.channels)) {
        std::vector<const char*> names;
        names.reserve(format.channels.size());
        for (const std::string& name : format.channels) names.push_back(name.c_str());
        return encode_exr(image, format.bits, names);
    }
    return encode_exr(image, format.bits, {image.channels < 3 ? grey : colours, static_cast<std::size_t>(image.channels)});
}

std::vector<std::byte> encode_depth(const DepthMap& depth)
{
    const Image image{depth.width, depth.height, 1, depth.depth};
    check_shape(image, {"exr", 32});
    return encode_exr(image, 32, std::array{"Z"});
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
