// Small sound images for scenes to name.
#pragma once

#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "io/image_io.hpp"

namespace penumbra::fuzz {

// depth.exr 4 x 3 of 2, with nothing at one pixel; short.png and byte.png 4 x 3 grey of 0.5; light.exr 2 x 2 RGB;
// channels.exr 4 x 3 with two depths, near.Z and far.Z, 1 to 24; broken.exr no image.
inline const std::map<std::string, std::vector<std::byte>>& sample_images()
{
    static const auto images = [] {
        Image depth{4, 3, 1, std::vector<float>(12, 2.0f)};
        depth.pixels[5] = INFINITY;
        const Image grey{4, 3, 1, std::vector<float>(12, 0.5f)}, light{2, 2, 3, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}};
        Image channels{4, 3, 2, std::vector<float>(24)};
        std::iota(channels.pixels.begin(), channels.pixels.end(), 1.0f);
        return std::map<std::string, std::vector<std::byte>>{
            {"depth.exr", encode_image(depth, {"exr", 32})},
            {"short.png", encode_image(grey, {"png", 16})},
            {"byte.png", encode_image(grey, {"png", 8})},
            {"light.exr", encode_image(light, {"exr", 32})},
            {"channels.exr", encode_image(channels, {.format = "exr", .bits = 32, .channels = {"near.Z", "far.Z"}})},
            {"broken.exr", std::vector<std::byte>(64)}};
    }();
    return images;
}

} // namespace penumbra::fuzz
