#include "io/cut_image.hpp"

#include <algorithm>

#include "io/image_io.hpp"

namespace penumbra {

namespace {

bool has_alpha(const Image& image) { return image.channels == 2 || image.channels == 4; }

bool alpha_varies(const Image& image)
{
    if (!has_alpha(image)) return false;
    const int last = image.channels - 1;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            if (image.at(x, y, last) != image.at(0, 0, last)) return true;
    return false;
}

} // namespace

std::optional<Image> cut_image(std::span<const std::byte> bytes, std::string_view where, AlphaOf from, std::uint64_t max_samples)
{
    const Image image = decode_picture(bytes, where, max_samples);
    const bool alpha = from == AlphaOf::alpha || (from == AlphaOf::either && alpha_varies(image));
    if (alpha && !has_alpha(image)) return std::nullopt;
    Image one{.width = image.width, .height = image.height, .channels = 1, .pixels = {}};
    one.pixels.reserve(image.pixel_count());
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const bool grey = image.channels < 3;
            const float colour = grey ? image.at(x, y) : (image.at(x, y, 0) + image.at(x, y, 1) + image.at(x, y, 2)) / 3;
            one.pixels.push_back(alpha ? image.at(x, y, image.channels - 1) : colour);
        }
    return one;
}

bool cuts_nothing(const CutOut& cut)
{
    return std::ranges::all_of(cut.alpha.pixels, [&](float alpha) { return alpha >= cut.cutoff; });
}

} // namespace penumbra
