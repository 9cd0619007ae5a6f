#include "preview.hpp"

#include <algorithm>
#include <cmath>

#include <penumbra/error.hpp>

namespace penumbra::cli {
namespace {

// IEC 61966-2-1.
float linear(float encoded) { return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f); }
float encoded(float linear) { return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f; }

std::string size_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

} // namespace

void require_size(const Image& picture, int width, int height, const std::string& name)
{
    if (picture.width != width || picture.height != height)
        throw Error(ErrorCode::usage, "--over " + name + ": is " + size_text(picture.width, picture.height),
                    "expected " + size_text(width, height) + ", the mask's size");
}

Image under_light(const Image& picture, const Image& mask, const std::string& name)
{
    require_size(picture, mask.width, mask.height, name);
    Image result{.width = picture.width, .height = picture.height, .channels = 3, .pixels = {}};
    result.pixels.reserve(result.pixel_count() * 3);
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x)
            for (int c = 0; c < 3; ++c) {
                const float colour = std::clamp(picture.at(x, y, picture.channels >= 3 ? c : 0), 0.f, 1.f);
                result.pixels.push_back(encoded(linear(colour) * mask.at(x, y, mask.channels >= 3 ? c : 0)));
            }
    return result;
}

} // namespace penumbra::cli
