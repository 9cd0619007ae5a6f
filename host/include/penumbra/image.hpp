// Images in memory, and to and from files.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/export.hpp>

namespace penumbra {

// Pixels as float32, row 0 at the top, channels interleaved: pixels[(y * width + x) * channels + c].
struct Image {
    int width = 0;
    int height = 0;
    int channels = 1;
    std::vector<float> pixels;

    std::size_t pixel_count() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
    float& at(int x, int y, int c = 0) { return pixels[index(x, y, c)]; }
    float at(int x, int y, int c = 0) const { return pixels[index(x, y, c)]; }

private:
    std::size_t index(int x, int y, int c) const
    {
        return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * static_cast<std::size_t>(channels)
            + static_cast<std::size_t>(c);
    }
};

// How the numbers stood in the file.
enum class SampleType { uint8, uint16, uint32, float16, float32 };

// How a mask is written.
struct OutputFormat {
    std::string format; // "exr", "tif", "png", "pfm", "hdr"; empty: by the file name's extension
    int bits = 0;       // 8 or 16 (png, tif: integers), 16 or 32 (exr, tif: floats); 0: png 16, tif 32, exr 32, pfm 32, hdr 32
    std::vector<std::string> channels = {}; // names of an EXR's; without them Y, A or R, G, B, A
    bool srgb = false;                      // a PNG's samples, written as they stand, are sRGB, and it says so; else linear
};

// What an image file is by its first bytes: "exr", "tif", "png", "pfm", "hdr"; empty: none of them.
PENUMBRA_API std::string_view image_format_of(std::span<const std::byte> bytes);

// Reads EXR, TIFF, PNG, PFM or HDR, decided by the file's first bytes. Integer samples come as 0 to 1, linear as they stand.
// Throws not_found, invalid_input (truncated, no such format, deep, more than 4 channels), too_large.
PENUMBRA_API Image read_image(const std::string& path);

// The same, and JPEG: a picture that masks are laid over.
PENUMBRA_API Image read_picture(const std::string& path);

// Writes to a temporary file beside `path` and renames it into place when whole. Throws usage for a format or bits that do not exist,
// output when it cannot be written.
PENUMBRA_API void write_image(const std::string& path, const Image& image, const OutputFormat& format = {});

// The same, to memory (`format.format` must be given).
PENUMBRA_API std::vector<std::byte> encode_image(const Image& image, const OutputFormat& format);

} // namespace penumbra
