// Images from bytes, through OpenImageIO 2.4. What it promises little about is checked here: sizes before any sample is decoded, one named
// reader and no other, kinds of TIFF that its reader is known to trip over, and errors that come with a "true" (TIFF).
#include "io/openimageio/module.hpp"
#include "scene/memory.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <string>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

Error broken(std::string_view where, const std::string& what, std::string hint = {})
{
    return {ErrorCode::invalid_input, std::string(where) + " " + what, std::move(hint)};
}

// An opened image. Closes before the bytes go.
class Source {
public:
    Source(std::span<const std::byte> bytes, ImageFormat format, std::string_view where)
        : where_(where), memory_(bytes.data(), bytes.size()), format_(format)
    {
        configure_openimageio();
        const std::string name = plugin(format);
        input_ = OIIO::ImageInput::create(name);
        if (!input_)
            throw Error(ErrorCode::internal,
                        std::string(where_) + " cannot be read: OpenImageIO lacks " + name + ": " + plain_line(OIIO::geterror()));

        // Samples as they stand: no alpha multiplied in, no colour model turned into another.
        OIIO::ImageSpec wanted, found;
        wanted.attribute("oiio:UnassociatedAlpha", 1);
        wanted.attribute("oiio:RawColor", 1);
        input_->set_ioproxy(&memory_);
        if (!input_->open("image." + name, found, wanted)) throw broken(where_, "cannot be read: " + complaint());
    }

    // Moves to a part (0 is there at once); false when there is none.
    bool seek(int part) { return input_->seek_subimage(part, 0); }

    const OIIO::ImageSpec& spec() const { return input_->spec(); }
    bool exr() const { return format_ == ImageFormat::exr; }

    // Throws for what is not read, in order of cost.
    void check(std::uint64_t max_samples) const
    {
        const OIIO::ImageSpec& s = spec();
        if (s.deep) throw broken(where_, "is a deep image", "flatten it first");
        if (s.width < 1 || s.height < 1 || s.nchannels < 1) throw broken(where_, "has no pixels");
        if (s.depth > 1) throw broken(where_, "is a volume of " + std::to_string(s.depth) + " slices, expected one image");
        const std::uint64_t pixels = static_cast<std::uint64_t>(s.width) * static_cast<std::uint64_t>(s.height);
        const std::uint64_t tile =
            s.tile_width > 0 ? static_cast<std::uint64_t>(s.tile_width) * static_cast<std::uint64_t>(std::max(s.tile_height, 1)) : 0;
        if (std::max(pixels, tile) > max_samples / static_cast<std::uint64_t>(s.nchannels))
            throw Error(ErrorCode::too_large, std::string(where_) + " is " + size_text() + " x " + std::to_string(s.nchannels) +
                                                  " samples; the limit is " + std::to_string(max_samples));
        // OpenImageIO's copy of all channels, the picked ones as float and as they are stored.
        require_memory(static_cast<double>(std::max(pixels, tile)) * s.nchannels * 12, where_);
        if (const int turned = s.get_int_attribute("Orientation", 1); turned != 1)
            throw broken(where_, "is stored turned (orientation " + std::to_string(turned) + "), expected row 0 at the top",
                         "turn its pixels first");
        if (format_ == ImageFormat::tiff) check_tiff();
    }

    // Throws for an EXR that is cropped, or has pixels beyond its display window.
    void check_whole() const
    {
        const OIIO::ImageSpec& s = spec();
        if (exr() && (s.x != s.full_x || s.y != s.full_y || s.width != s.full_width || s.height != s.full_height))
            throw broken(where_,
                         "has a data window of " + size_text() + " at " + std::to_string(s.x) + ", " + std::to_string(s.y) +
                             " in a display window of " + std::to_string(s.full_width) + " x " + std::to_string(s.full_height) + " at " +
                             std::to_string(s.full_x) + ", " + std::to_string(s.full_y),
                         "write it with both alike");
    }

    // The display window of an EXR in its samples' pixels.
    ImageFrame frame(std::uint64_t max_samples) const
    {
        if (!exr()) return {};
        const OIIO::ImageSpec& s = spec();
        const std::int64_t x = std::int64_t{s.full_x} - s.x, y = std::int64_t{s.full_y} - s.y;
        constexpr std::int64_t furthest = std::numeric_limits<int>::max();
        const ImageFrame frame{static_cast<int>(std::clamp(x, -furthest, furthest)), static_cast<int>(std::clamp(y, -furthest, furthest)), s.full_width,
                               s.full_height};
        check_frame(frame, where_, max_samples);
        return frame;
    }

    double pixel_aspect() const { return sound_aspect(static_cast<double>(spec().get_float_attribute("PixelAspectRatio", 1))); }

    // The part that stands open.
    ImagePart part() const
    {
        ImagePart part{.name = spec().get_string_attribute("oiio:subimagename"), .channels = spec().channelnames, .deep = spec().deep};
        if (spec().alpha_channel >= 0 && spec().alpha_channel < spec().nchannels && spec().nchannels == 2 && !exr())
            part.channels[static_cast<std::size_t>(spec().alpha_channel)] = "A";
        return part;
    }

    // The sample type of a channel; throws for those that we do not take.
    SampleType type(int channel) const
    {
        switch (spec().channelformat(channel).basetype) {
        case OIIO::TypeDesc::UINT8:
            return SampleType::uint8;
        case OIIO::TypeDesc::UINT16:
            return SampleType::uint16;
        case OIIO::TypeDesc::UINT32:
            return SampleType::uint32;
        case OIIO::TypeDesc::HALF:
            return SampleType::float16;
        case OIIO::TypeDesc::FLOAT:
            return SampleType::float32;
        default:
            throw broken(where_, std::string("has samples of type ") + spec().channelformat(channel).c_str(),
                         "8, 16 or 32-bit unsigned integers, or 16 or 32-bit floats");
        }
    }

    // Channels [first, end) as `type`.
    void read(int part, int first, int end, const OIIO::TypeDesc& type, void* samples)
    {
        const bool done = input_->read_image(part, 0, first, end, type, samples);
        // A truncated TIFF reads "true" with zeros: the error alone tells.
        if (!done || input_->has_error()) throw broken(where_, "is truncated or broken: " + complaint());
    }

    std::string size_text() const { return std::to_string(spec().width) + " x " + std::to_string(spec().height); }

private:
    std::string complaint() const
    {
        const std::string text = plain_line(input_->geterror());
        return text.empty() ? "the decoder gives no reason" : text;
    }

    // Grey or RGB of whole bytes; CMYK, palettes, YCbCr and packed bits go through code with known overflows and mean nothing as depth.
    void check_tiff() const
    {
        constexpr int black_is_zero = 1, rgb = 2;
        // Its reader adds this to a row, as int: near 2^31 it never comes to the end. (2^32 - 1, -1 here, means all.)
        constexpr int most_rows = 1 << 24;
        if (const int rows = spec().get_int_attribute("tiff:RowsPerStrip", -1); rows > most_rows)
            throw broken(where_, "is a TIFF with strips of " + std::to_string(rows) + " rows", "the image has " + std::to_string(spec().height));
        const int photometric = spec().get_int_attribute("tiff:PhotometricInterpretation", -1);
        if (photometric != black_is_zero && photometric != rgb)
            throw broken(where_, "is a TIFF with photometric interpretation " + std::to_string(photometric),
                         "grey (1) and RGB (2) are read");
        const int bits = spec().get_int_attribute("oiio:BitsPerSample", static_cast<int>(spec().format.size() * 8));
        if (bits != 8 && bits != 16 && bits != 32)
            throw broken(where_, "is a TIFF with " + std::to_string(bits) + "-bit samples", "8, 16 and 32 bits are read");
    }

    std::string_view where_;
    OIIO::Filesystem::IOMemReader memory_;
    ImageFormat format_;
    std::unique_ptr<OIIO::ImageInput> input_;
};

// More parts are not looked at: a file can claim any number of them.
constexpr int most_parts = 1024;

// What is chosen among: the parts of an EXR; of another file the first page, or all up to the one that is asked for.
std::vector<ImagePart> parts_of(Source& source, const PartChoice& choice, std::string_view where)
{
    std::vector<ImagePart> parts{source.part()};
    const OIIO::ImageSpec first = source.spec();
    const bool said = !std::holds_alternative<std::monostate>(choice);
    // (Pages of a TIFF have no names to look for.)
    const int last = source.exr() ? most_parts - 1 : std::get_if<int>(&choice) ? std::get<int>(choice) : said ? 0 : 1;
    for (int number = 1; number <= last && number < most_parts && source.seek(number); ++number) parts.push_back(source.part());
    if (source.exr() || said || parts.size() == 1) return parts;
    // A second page of another size is a smaller copy of the first.
    if (source.spec().width == first.width && source.spec().height == first.height)
        throw broken(where, "has several pages of one size", "choose one with encoding.part, from 0");
    parts.resize(1);
    return parts;
}

// The same by a reader of its own: that of TIFF reads no page any more once it was asked for one that there is not.
std::vector<ImagePart> parts_of(std::span<const std::byte> bytes, ImageFormat format, const PartChoice& choice, std::string_view where)
{
    Source source(bytes, format, where);
    return parts_of(source, choice, where);
}

template <class Sample> void read_channel(Source& source, const PlanePick& pick, std::size_t at, const OIIO::TypeDesc& type, std::vector<float>& samples)
{
    const std::size_t channels = pick.channels.size();
    std::vector<Sample> plane(samples.size() / channels);
    source.read(pick.part, pick.channels[at], pick.channels[at] + 1, type, plane.data());
    for (std::size_t i = 0; i < plane.size(); ++i) samples[i * channels + at] = static_cast<float>(plane[i]);
}

} // namespace

Image decode_by_openimageio(std::span<const std::byte> bytes, ImageFormat format, std::string_view where, std::uint64_t max_samples)
{
    Source source(bytes, format, where);
    if (source.spec().nchannels > 4)
        throw broken(where,
                     "has " + std::to_string(source.spec().nchannels) + " channels (" + channel_list(std::array{source.part()}) + "), expected at most 4");
    source.check(max_samples);
    source.check_whole();
    for (int c = 0; c < source.spec().nchannels; ++c) source.type(c);

    Image image{source.spec().width, source.spec().height, source.spec().nchannels, {}};
    image.pixels.resize(image.pixel_count() * static_cast<std::size_t>(image.channels));
    source.read(0, 0, image.channels, OIIO::TypeFloat, image.pixels.data());
    return image;
}

RawPlanes decode_planes_by_openimageio(std::span<const std::byte> bytes, ImageFormat format, const PlaneRequest& request, std::string_view where,
                                       std::uint64_t max_samples)
{
    const PlanePick pick = pick_planes(parts_of(bytes, format, request.part, where), request, where);
    Source source(bytes, format, where);
    if (!source.seek(pick.part)) throw broken(where, "is truncated or broken");
    source.check(max_samples);

    RawPlanes raw{.width = source.spec().width,
                  .height = source.spec().height,
                  .channels = static_cast<int>(pick.channels.size()),
                  .type = source.type(pick.channels.front()),
                  .frame = source.frame(max_samples),
                  .pixel_aspect = source.pixel_aspect()};
    raw.samples.resize(static_cast<std::size_t>(raw.width) * static_cast<std::size_t>(raw.height) * pick.channels.size());
    for (std::size_t i = 0; i < pick.channels.size(); ++i) {
        switch (raw.type) {
        case SampleType::uint8:
            read_channel<std::uint8_t>(source, pick, i, OIIO::TypeUInt8, raw.samples);
            break;
        case SampleType::uint16:
            read_channel<std::uint16_t>(source, pick, i, OIIO::TypeUInt16, raw.samples);
            break;
        case SampleType::uint32:
            read_channel<std::uint32_t>(source, pick, i, OIIO::TypeUInt32, raw.samples);
            break;
        default:
            read_channel<float>(source, pick, i, OIIO::TypeFloat, raw.samples);
            break;
        }
    }
    return raw;
}

} // namespace penumbra
