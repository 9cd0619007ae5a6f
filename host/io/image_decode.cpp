// Images from bytes. PFM, PNG and the plain kind of EXR are read here; TIFF, Radiance, and an EXR that is not plain, or not sound, go to
// OpenImageIO, which is loaded for them.
#include "io/image_io.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include <penumbra/error.hpp>

#include "io/exr_header.hpp"
#include "io/exr_read.hpp"
#include "io/image_format.hpp"
#include "io/openimageio/openimageio.hpp"
#include "io/pfm.hpp"
#include "io/png.hpp"

namespace penumbra {

namespace {

Error broken(std::string_view where, const std::string& what, std::string hint = {})
{
    return {ErrorCode::invalid_input, std::string(where) + " " + what, std::move(hint)};
}

ImageFormat format_from(std::span<const std::byte> bytes, std::string_view where)
{
    const ImageFormat format = sniff(bytes);
    if (format == ImageFormat::jpeg)
        throw broken(where, "is a JPEG, which changes every number that it stores", "EXR, TIFF, PNG, PFM and Radiance HDR are read");
    if (format == ImageFormat::unknown)
        throw broken(where, bytes.empty() ? "is empty" : "is not an image of a known format",
                     "EXR, TIFF, PNG, PFM and Radiance HDR are read");
    return format;
}

// The depth channel, where the names alone say so; of the rest OpenImageIO's order decides.
std::optional<std::size_t> plain_depth_channel(const std::vector<ExrChannel>& channels, std::string_view asked)
{
    const auto find = [&](const auto& fits) -> std::optional<std::size_t> {
        const auto found = std::ranges::find_if(channels, fits, &ExrChannel::name);
        if (found == channels.end()) return {};
        return static_cast<std::size_t>(found - channels.begin());
    };
    if (!asked.empty()) return find([&](const std::string& name) { return name == asked; });
    if (const auto z = find([](const std::string& name) { return name == "Z"; })) return z;
    if (const auto z = find([](const std::string& name) { return name == "depth.Z"; })) return z;
    const auto is_layer = [](const std::string& name) { return name.ends_with(".Depth.Z"); };
    if (std::ranges::count_if(channels, is_layer, &ExrChannel::name) == 1) return find(is_layer);
    // The only channel must not be alpha.
    const std::string& first = channels.front().name;
    const char initial = first[first.rfind('.') + 1]; // of the name behind the layer; 0 when there is none
    if (channels.size() == 1 && initial != 'A' && initial != 'a') return 0;
    return {};
}

// The channels of an image in the order of its pixels, where the names alone say so: one, RGB, or RGB and alpha. EXR sorts them by name.
std::vector<std::size_t> plain_image_channels(const std::vector<ExrChannel>& channels)
{
    std::string names;
    for (const ExrChannel& channel : channels) {
        if (channel.type == SampleType::uint32) return {};
        names += channel.name + ' ';
    }
    if (channels.size() == 1) return {0};
    if (names == "B G R ") return {2, 1, 0};
    if (names == "A B G R ") return {3, 2, 1, 0};
    return {};
}

// A plain EXR within the limit; everything else is nothing, and OpenImageIO's to read or to refuse.
std::optional<PlainExr> plain_exr(std::span<const std::byte> exr, std::string_view where, std::uint64_t max_samples)
{
    check_exr_header(exr, where, max_samples);
    std::optional<PlainExr> file = PlainExr::open(exr);
    if (file &&
        static_cast<std::uint64_t>(file->width()) * static_cast<std::uint64_t>(file->height()) > max_samples / file->channels().size())
        return {};
    return file;
}

std::optional<RawDepth> plain_depth(std::span<const std::byte> exr, std::string_view channel, std::string_view where,
                                    std::uint64_t max_samples)
{
    const std::optional<PlainExr> file = plain_exr(exr, where, max_samples);
    const std::optional<std::size_t> picked = file ? plain_depth_channel(file->channels(), channel) : std::nullopt;
    if (!picked) return {};
    std::optional<std::vector<float>> samples = file->read(std::array{*picked});
    if (!samples) return {};
    return RawDepth{file->width(), file->height(), file->channels()[*picked].type, std::move(*samples)};
}

std::optional<Image> plain_image(std::span<const std::byte> exr, std::string_view where, std::uint64_t max_samples)
{
    const std::optional<PlainExr> file = plain_exr(exr, where, max_samples);
    const std::vector<std::size_t> picked = file ? plain_image_channels(file->channels()) : std::vector<std::size_t>();
    if (picked.empty()) return {};
    std::optional<std::vector<float>> samples = file->read(picked);
    if (!samples) return {};
    return Image{file->width(), file->height(), static_cast<int>(picked.size()), std::move(*samples)};
}

Image png_image(PngImage&& png)
{
    const float scale = 1.0f / (png.bits == 16 ? 65535 : 255);
    for (float& sample : png.samples) sample *= scale;
    return {png.width, png.height, png.channels, std::move(png.samples)};
}

// Grey is depth for certain; of colours, the one that is asked for.
RawDepth png_depth(PngImage&& png, std::string_view channel, std::string_view where)
{
    constexpr std::array<std::string_view, 4> names{"Y", "Y, A", "R, G, B", "R, G, B, A"};
    const std::string_view list = names[static_cast<std::size_t>(png.channels - 1)];
    const std::size_t channels = static_cast<std::size_t>(png.channels);
    if (channel.empty() && channels > 2)
        throw broken(where, "has no channel that is depth for certain; it has " + std::string(list), "name one with encoding.channel");
    const std::size_t at = channel.empty() ? 0 : channel.size() == 1 ? list.find(channel) : std::string_view::npos;
    if (at == std::string_view::npos) throw broken(where, "has no channel \"" + std::string(channel) + "\"; it has " + std::string(list));
    RawDepth raw{png.width, png.height, png.bits == 16 ? SampleType::uint16 : SampleType::uint8, std::move(png.samples)};
    if (channels == 1) return raw;
    const std::size_t first = at / 3; // of "R, G, B, A"
    const std::size_t count = raw.samples.size() / channels;
    for (std::size_t i = 0; i < count; ++i) raw.samples[i] = raw.samples[channels * i + first];
    raw.samples.resize(count);
    return raw;
}

} // namespace

Image decode_image(std::span<const std::byte> bytes, std::string_view where, std::uint64_t max_samples)
{
    const ImageFormat format = format_from(bytes, where);
    if (format == ImageFormat::pfm) return decode_pfm(bytes, where, max_samples);
    if (format == ImageFormat::png) return png_image(decode_png(bytes, where, max_samples));
    if (format == ImageFormat::exr)
        if (std::optional<Image> image = plain_image(bytes, where, max_samples)) return *std::move(image);
    return openimageio().decode_image(bytes, format, where, max_samples);
}

RawDepth decode_raw_depth(std::span<const std::byte> bytes, std::string_view channel, std::string_view where, std::uint64_t max_samples)
{
    const ImageFormat format = format_from(bytes, where);
    if (format == ImageFormat::pfm) {
        Image image = decode_pfm(bytes, where, max_samples);
        if (image.channels != 1 || (!channel.empty() && channel != "Y"))
            throw broken(where, image.channels == 1 ? "has no channel \"" + std::string(channel) + "\"; it has Y"
                                                    : "is a colour PFM; depth needs one channel");
        return {image.width, image.height, SampleType::float32, std::move(image.pixels)};
    }
    if (format == ImageFormat::png) return png_depth(decode_png(bytes, where, max_samples), channel, where);
    if (format == ImageFormat::exr)
        if (std::optional<RawDepth> raw = plain_depth(bytes, channel, where, max_samples)) return *std::move(raw);
    return openimageio().decode_raw_depth(bytes, format, channel, where, max_samples);
}

Image read_image(const std::string& path) { return decode_image(read_file(path, path), path); }

Image decode_picture(std::span<const std::byte> bytes, std::string_view where, std::uint64_t max_samples)
{
    if (sniff(bytes) != ImageFormat::jpeg) return decode_image(bytes, where, max_samples);
    return openimageio().decode_image(bytes, ImageFormat::jpeg, where, max_samples);
}

Image read_picture(const std::string& path) { return decode_picture(read_file(path, path), path); }

} // namespace penumbra
