#include "masks/mask_format.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>

#include "process/problem.hpp"

namespace penumbra::server {
namespace {

constexpr std::array formats{MaskFormat{"image/png", "png"}, MaskFormat{"image/x-exr", "exr"}, MaskFormat{"image/tiff", "tif"},
                             MaskFormat{"image/x-portable-floatmap", "pfm"}};

std::string_view trimmed(std::string_view text)
{
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
    return text;
}

bool same(std::string_view a, std::string_view b)
{
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    return std::ranges::equal(a, b, [&](char x, char y) { return lower(x) == lower(y); });
}

// The part of `text` before `separator`, which is taken off.
std::string_view take(std::string_view& text, char separator)
{
    const std::size_t end = std::min(text.find(separator), text.size());
    const std::string_view piece = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    return piece;
}

// Weight of a media range, from its parameters; what is no number weighs nothing.
double weight_of(std::string_view parameters)
{
    while (!parameters.empty()) {
        const std::string_view piece = take(parameters, ';');
        if (piece.size() < 2 || !same(piece.substr(0, 2), "q=")) continue;
        double q = 0;
        const auto [end, error] = std::from_chars(piece.data() + 2, piece.data() + piece.size(), q);
        return error == std::errc{} && end == piece.data() + piece.size() && q >= 0 && q <= 1 ? q : 0;
    }
    return 1;
}

// How closely a media range names a type: 0 not at all, 1 */*, 2 image/*, 3 itself.
int closeness(std::string_view range, std::string_view type)
{
    if (same(range, type)) return 3;
    if (same(range, "image/*")) return 2;
    return range == "*/*" ? 1 : 0;
}

// The closest range decides the weight of a type.
double weight_for(std::string_view accept, std::string_view type)
{
    int closest = 0;
    double weight = 0;
    while (!accept.empty()) {
        std::string_view parameters = take(accept, ',');
        const std::string_view range = take(parameters, ';');
        const int close = closeness(range, type);
        if (close <= closest) continue;
        closest = close;
        weight = weight_of(parameters);
    }
    return weight;
}

} // namespace

std::span<const MaskFormat> mask_formats() { return formats; }

std::span<const MaskFormat> formats_of(MaskImage image)
{
    if (image == MaskImage::mask) return formats;
    return {std::ranges::find(formats, "exr", &MaskFormat::format), 1};
}

const MaskFormat& negotiate(std::string_view accept, MaskImage image)
{
    const std::span<const MaskFormat> offered = formats_of(image);
    if (trimmed(accept).empty()) return offered.front();
    const MaskFormat* best = nullptr;
    double best_weight = 0;
    for (const MaskFormat& format : offered) {
        const double weight = weight_for(accept, format.media_type);
        if (weight <= best_weight) continue;
        best = &format;
        best_weight = weight;
    }
    if (best) return *best;
    std::string list;
    for (const MaskFormat& format : offered) list += (list.empty() ? "" : ", ") + std::string(format.media_type);
    if (image == MaskImage::bound)
        throw Problem(406, "not_acceptable", "Accept: does not take EXR, and image=bound has two channels, low and high; expected " + list);
    throw Problem(406, "not_acceptable", "Accept: names no format of a mask; expected one of " + list);
}

} // namespace penumbra::server
