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
#include "scene/memory.hpp"

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
    if (file) require_memory(8. * file->width() * file->height() * static_cast<double>(file->channels().size()), where);
    if (file &&
        static_cast<std::uint64_t>(file->width()) * static_cast<std::uint64_t>(file->height()) > max_samples / file->channels().size())
        return {};
    return file;
}

// The one part of a plain EXR.
ImagePart part_of(const PlainExr& file)
{
    ImagePart part;
    for (const ExrChannel& channel : file.channels()) part.channels.push_back(channel.name);
    return part;
}

// Names of parts stand where OpenImageIO alone looks.
bool may_be_plain(const PartChoice& choice) { return !std::holds_alternative<std::string>(choice); }

std::optional<RawPlanes> plain_planes(std::span<const std::byte> exr, const PlaneRequest& request, std::string_view where, std::uint64_t max_samples)
{
    const std::optional<PlainExr> file = plain_exr(exr, where, max_samples);
    if (!file || !may_be_plain(request.part)) return {};
    PlanePick pick;
    try {
        pick = pick_planes(std::array{part_of(*file)}, request, where);
    } catch (const Error&) {
        return {}; // OpenImageIO lists channels as people do, R before G
    }
    check_frame(file->frame(), where, max_samples);
    const std::vector<std::size_t> picked(pick.channels.begin(), pick.channels.end());
    std::optional<std::vector<float>> samples = file->read(picked);
    if (!samples) return {};
    return RawPlanes{.width = file->width(),
                     .height = file->height(),
                     .channels = static_cast<int>(picked.size()),
                     .type = file->channels()[picked.front()].type,
                     .samples = std::move(*samples),
                     .frame = file->frame(),
                     .pixel_aspect = sound_aspect(file->pixel_aspect())};
}

std::optional<Image> plain_image(std::span<const std::byte> exr, std::string_view where, std::uint64_t max_samples)
{
    const std::optional<PlainExr> file = plain_exr(exr, where, max_samples);
    const std::vector<std::size_t> picked = file && file->whole() ? plain_image_channels(file->channels()) : std::vector<std::size_t>();
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

// Some channels of interleaved ones.
std::vector<float> picked_from(std::vector<float> samples, int channels, std::span<const int> picked)
{
    if (channels == 1) return samples;
    const std::size_t count = samples.size() / static_cast<std::size_t>(channels);
    std::vector<float> result;
    result.reserve(count * picked.size());
    for (std::size_t i = 0; i < count; ++i)
        for (const int channel : picked) result.push_back(samples[i * static_cast<std::size_t>(channels) + static_cast<std::size_t>(channel)]);
    return result;
}

// What a file of one part has: grey or RGB, and alpha behind it.
ImagePart colours(int channels)
{
    static const std::array<std::vector<std::string>, 4> names{{{"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}}};
    return {.name = {}, .channels = names[static_cast<std::size_t>(channels - 1)]};
}

RawPlanes png_planes(PngImage&& png, const PlaneRequest& request, std::string_view where)
{
    const PlanePick pick = pick_planes(std::array{colours(png.channels)}, request, where);
    return {.width = png.width,
            .height = png.height,
            .channels = static_cast<int>(pick.channels.size()),
            .type = png.bits == 16 ? SampleType::uint16 : SampleType::uint8,
            .samples = picked_from(std::move(png.samples), png.channels, pick.channels),
            .frame = {},
            .pixel_aspect = sound_aspect(png.pixel_aspect)};
}

RawPlanes pfm_planes(Image&& image, const PlaneRequest& request, std::string_view where)
{
    const PlanePick pick = pick_planes(std::array{colours(image.channels)}, request, where);
    return {.width = image.width,
            .height = image.height,
            .channels = static_cast<int>(pick.channels.size()),
            .type = SampleType::float32,
            .samples = picked_from(std::move(image.pixels), image.channels, pick.channels)};
}

RawPlanes decode_planes(std::span<const std::byte> bytes, const PlaneRequest& request, std::string_view where, std::uint64_t max_samples)
{
    const ImageFormat format = format_from(bytes, where);
    if (format == ImageFormat::pfm) return pfm_planes(decode_pfm(bytes, where, max_samples), request, where);
    if (format == ImageFormat::png) return png_planes(decode_png(bytes, where, max_samples), request, where);
    if (format == ImageFormat::exr)
        if (std::optional<RawPlanes> planes = plain_planes(bytes, request, where, max_samples)) return *std::move(planes);
    return openimageio().decode_planes(bytes, format, request, where, max_samples);
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

RawDepth decode_raw_depth(std::span<const std::byte> bytes, std::string_view channel, std::string_view where, std::uint64_t max_samples,
                          const PartChoice& part)
{
    RawPlanes planes = decode_planes(bytes, {.planes = Planes::depth, .channel = std::string(channel), .part = part}, where, max_samples);
    return {.width = planes.width,
            .height = planes.height,
            .type = planes.type,
            .samples = std::move(planes.samples),
            .frame = planes.frame,
            .pixel_aspect = planes.pixel_aspect};
}

RawPlanes decode_positions(std::span<const std::byte> bytes, std::string_view channel, std::string_view where, std::uint64_t max_samples,
                           const PartChoice& part)
{
    return decode_planes(bytes, {.planes = Planes::position, .channel = std::string(channel), .part = part}, where, max_samples);
}

Image read_image(const std::string& path) { return decode_image(read_file(path, path), path); }

Image decode_picture(std::span<const std::byte> bytes, std::string_view where, std::uint64_t max_samples)
{
    if (sniff(bytes) != ImageFormat::jpeg) return decode_image(bytes, where, max_samples);
    return openimageio().decode_image(bytes, ImageFormat::jpeg, where, max_samples);
}

Image read_picture(const std::string& path) { return decode_picture(read_file(path, path), path); }

} // namespace penumbra
