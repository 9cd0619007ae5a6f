// Images from bytes, through OpenImageIO 2.4. What it promises little about is checked here: sizes before any sample is decoded, one named
// reader and no other, kinds of TIFF that its reader is known to trip over, and errors that come with a "true" (TIFF).
#include "io/openimageio/module.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

Error broken(std::string_view where, const std::string& what, std::string hint = {})
{
    return {ErrorCode::invalid_input, std::string(where) + " " + what, std::move(hint)};
}

// OpenImageIO's messages have several lines and name our stand-in for a file name.
std::string one_line(std::string text)
{
    while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
    std::ranges::replace_if(
        text, [](unsigned char c) { return c < 0x20 || c > 0x7e; }, ' ');
    return text.substr(0, 200);
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
                        std::string(where_) + " cannot be read: OpenImageIO lacks " + name + ": " + one_line(OIIO::geterror()));

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
        if (exr() && (s.x != s.full_x || s.y != s.full_y || s.width != s.full_width || s.height != s.full_height))
            throw broken(where_,
                         "has a data window of " + size_text() + " at " + std::to_string(s.x) + ", " + std::to_string(s.y) +
                             " in a display window of " + std::to_string(s.full_width) + " x " + std::to_string(s.full_height) + " at " +
                             std::to_string(s.full_x) + ", " + std::to_string(s.full_y),
                         "write it with both alike");
        if (const int turned = s.get_int_attribute("Orientation", 1); turned != 1)
            throw broken(where_, "is stored turned (orientation " + std::to_string(turned) + "), expected row 0 at the top",
                         "turn its pixels first");
        if (format_ == ImageFormat::tiff) check_tiff();
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
    void read(int part, int first, int end, OIIO::TypeDesc type, void* samples)
    {
        const bool done = input_->read_image(part, 0, first, end, type, samples);
        // A truncated TIFF reads "true" with zeros: the error alone tells.
        if (!done || input_->has_error()) throw broken(where_, "is truncated or broken: " + complaint());
    }

    std::string channel_list() const
    {
        std::string list;
        for (const std::string& channel : spec().channelnames) list += (list.empty() ? "" : ", ") + one_line(channel);
        return list;
    }

    std::string size_text() const { return std::to_string(spec().width) + " x " + std::to_string(spec().height); }

private:
    std::string complaint() const
    {
        const std::string text = one_line(input_->geterror());
        return text.empty() ? "the decoder gives no reason" : text;
    }

    // Grey or RGB of whole bytes; CMYK, palettes, YCbCr and packed bits go through code with known overflows and mean nothing as depth.
    void check_tiff() const
    {
        constexpr int black_is_zero = 1, rgb = 2;
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

// The depth channel by its name, in the order of the header's list.
std::optional<int> named_channel(const OIIO::ImageSpec& spec, std::string_view channel)
{
    const auto find = [&](const auto& fits) -> std::optional<int> {
        const auto found = std::ranges::find_if(spec.channelnames, fits);
        if (found == spec.channelnames.end()) return {};
        return static_cast<int>(found - spec.channelnames.begin());
    };
    if (!channel.empty()) return find([&](const std::string& name) { return name == channel; });
    if (const auto z = find([](const std::string& name) { return name == "Z"; })) return z;
    if (const auto z = find([](const std::string& name) { return name == "depth.Z"; })) return z;
    if (const auto z = find([](const std::string& name) { return name.ends_with(".Depth.Z"); })) return z;
    if (spec.z_channel >= 0 && spec.z_channel < spec.nchannels) return spec.z_channel;
    return {};
}

// The only channel that is not alpha.
std::optional<int> only_channel(const OIIO::ImageSpec& spec)
{
    std::optional<int> only;
    for (int c = 0; c < spec.nchannels; ++c) {
        if (c == spec.alpha_channel) continue;
        if (only) return {};
        only = c;
    }
    return only;
}

struct Pick {
    int part, channel;
};

Pick pick_depth(Source& source, std::string_view channel, std::string_view where)
{
    std::string list;
    std::optional<Pick> only;
    for (int part = 0; source.seek(part); ++part) {
        const OIIO::ImageSpec& spec = source.spec();
        if (spec.deep) continue;
        if (const auto named = named_channel(spec, channel)) return {part, *named};
        if (const auto single = only_channel(spec); single && !only) only = Pick{part, *single};
        list += (list.empty() ? "" : "; ") + source.channel_list();
        if (!source.exr()) break; // the pages of a TIFF are separate images; the first one counts
    }
    if (list.empty()) throw broken(where, "is a deep image", "flatten it first");
    if (!channel.empty()) throw broken(where, "has no channel \"" + std::string(channel) + "\"; it has " + list);
    if (only) return *only;
    throw broken(where, "has no channel that is depth for certain; it has " + list, "name one with encoding.channel");
}

template <class Sample> std::vector<float> as_floats(Source& source, const Pick& pick, std::size_t count, OIIO::TypeDesc type)
{
    std::vector<Sample> samples(count);
    source.read(pick.part, pick.channel, pick.channel + 1, type, samples.data());
    if constexpr (std::is_same_v<Sample, float>)
        return samples;
    else
        return {samples.begin(), samples.end()};
}

} // namespace

Image decode_by_openimageio(std::span<const std::byte> bytes, ImageFormat format, std::string_view where, std::uint64_t max_samples)
{
    Source source(bytes, format, where);
    if (source.spec().nchannels > 4)
        throw broken(where,
                     "has " + std::to_string(source.spec().nchannels) + " channels (" + source.channel_list() + "), expected at most 4");
    source.check(max_samples);
    for (int c = 0; c < source.spec().nchannels; ++c) source.type(c);

    Image image{source.spec().width, source.spec().height, source.spec().nchannels, {}};
    image.pixels.resize(image.pixel_count() * static_cast<std::size_t>(image.channels));
    source.read(0, 0, image.channels, OIIO::TypeFloat, image.pixels.data());
    return image;
}

RawDepth decode_depth_by_openimageio(std::span<const std::byte> bytes, ImageFormat format, std::string_view channel, std::string_view where,
                                     std::uint64_t max_samples)
{
    Source source(bytes, format, where);
    const Pick pick = pick_depth(source, channel, where);
    if (!source.seek(pick.part)) throw broken(where, "is truncated or broken");
    source.check(max_samples);

    RawDepth raw{source.spec().width, source.spec().height, source.type(pick.channel), {}};
    const std::size_t count = static_cast<std::size_t>(raw.width) * static_cast<std::size_t>(raw.height);
    switch (raw.type) {
    case SampleType::uint8:
        raw.samples = as_floats<std::uint8_t>(source, pick, count, OIIO::TypeUInt8);
        break;
    case SampleType::uint16:
        raw.samples = as_floats<std::uint16_t>(source, pick, count, OIIO::TypeUInt16);
        break;
    case SampleType::uint32:
        raw.samples = as_floats<std::uint32_t>(source, pick, count, OIIO::TypeUInt32);
        break;
    default:
        raw.samples = as_floats<float>(source, pick, count, OIIO::TypeFloat);
        break;
    }
    return raw;
}

} // namespace penumbra
