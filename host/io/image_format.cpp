#include "io/image_format.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

struct WrittenFormat {
    std::string_view name;
    ImageFormat format;
    std::array<int, 3> bits; // the first is the default
    std::string_view bits_text;
};

constexpr std::array<WrittenFormat, 5> written_formats{{
    {"exr", ImageFormat::exr, {32, 16, 0}, "16 or 32"},
    {"tif", ImageFormat::tiff, {32, 16, 8}, "8, 16 or 32"},
    {"png", ImageFormat::png, {16, 8, 0}, "8 or 16"},
    {"pfm", ImageFormat::pfm, {32, 0, 0}, "32"},
    {"hdr", ImageFormat::hdr, {32, 0, 0}, "32"},
}};

constexpr std::string_view formats_hint = "formats: exr, tif, png, pfm, hdr";

std::string lower(std::string text)
{
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text == "tiff" ? "tif" : text;
}

const WrittenFormat* find(std::string_view name)
{
    const auto found = std::ranges::find(written_formats, name, &WrittenFormat::name);
    return found == written_formats.end() ? nullptr : &*found;
}

} // namespace

ImageFormat sniff(std::span<const std::byte> bytes)
{
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 16));
    using namespace std::string_view_literals;
    if (text.starts_with("\x76\x2f\x31\x01"sv)) return ImageFormat::exr;
    if (text.starts_with("II*\0"sv) || text.starts_with("MM\0*"sv) || text.starts_with("II+\0"sv) || text.starts_with("MM\0+"sv))
        return ImageFormat::tiff;
    if (text.starts_with("\x89PNG\r\n\x1a\n"sv)) return ImageFormat::png;
    if ((text.starts_with("PF"sv) || text.starts_with("Pf"sv)) && text.size() > 2 && std::isspace(static_cast<unsigned char>(text[2])))
        return ImageFormat::pfm;
    if (text.starts_with("\xff\xd8\xff"sv)) return ImageFormat::jpeg;
    if (text.starts_with("#?RADIANCE"sv) || text.starts_with("#?RGBE"sv)) return ImageFormat::hdr;
    return ImageFormat::unknown;
}

ImageFormat format_of(const OutputFormat& output)
{
    const WrittenFormat* found = find(output.format);
    return found ? found->format : ImageFormat::unknown;
}

OutputFormat checked(const OutputFormat& output, std::string_view where)
{
    const std::string prefix = where.empty() ? std::string() : std::string(where) + ": ";
    OutputFormat result = output;
    result.format = lower(output.format);
    const WrittenFormat* found = find(result.format);
    if (!found && result.format.empty()) throw Error(ErrorCode::usage, prefix + "no image format given", std::string(formats_hint));
    if (!found) throw Error(ErrorCode::usage, prefix + "unknown image format \"" + output.format + "\"", std::string(formats_hint));
    if (result.bits == 0) result.bits = found->bits[0];
    if (result.bits < 0 || std::ranges::find(found->bits, result.bits) == found->bits.end())
        throw Error(ErrorCode::usage, prefix + std::to_string(result.bits) + " bits do not exist for " + result.format,
                    std::string(found->name) + " has " + std::string(found->bits_text) + " bits");
    return result;
}

OutputFormat by_extension(OutputFormat output, const std::string& path)
{
    if (!output.format.empty()) return output;
    const std::string extension = std::filesystem::path(path).extension().string();
    if (extension.size() < 2)
        throw Error(ErrorCode::usage, path + ": has no extension that names an image format", std::string(formats_hint));
    output.format = lower(extension.substr(1));
    return output;
}

std::string_view image_format_of(std::span<const std::byte> bytes)
{
    switch (sniff(bytes)) {
    case ImageFormat::exr: return "exr";
    case ImageFormat::tiff: return "tif";
    case ImageFormat::png: return "png";
    case ImageFormat::pfm: return "pfm";
    case ImageFormat::hdr: return "hdr";
    case ImageFormat::jpeg:
    case ImageFormat::unknown: break;
    }
    return {};
}

} // namespace penumbra
