// penumbra mask --over PICTURE --preview OUT.png: the picture under this light alone, to look at.
#pragma once

#include <string>

#include <penumbra/image.hpp>

namespace penumbra::cli {

inline const OutputFormat preview_format{.format = "png", .bits = 8, .channels = {}, .srgb = true};

// Throws usage when the picture has another size than the mask that is to come.
void require_size(const Image& picture, int width, int height, const std::string& name);

// The picture times the mask, in linear light, as the picture is encoded (8-bit and 16-bit pictures as sRGB). Throws usage when their sizes
// differ.
Image under_light(const Image& picture, const Image& mask, const std::string& name);

} // namespace penumbra::cli
