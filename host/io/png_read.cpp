// Through libspng: unlike libpng it prints nothing, and unlike OpenImageIO it need not be loaded first (openimageio/openimageio.hpp).
#include <memory>
#include <string>

#include <spng.h>

#include <penumbra/error.hpp>

#include "io/image_format.hpp"
#include "io/png.hpp"
#include "scene/memory.hpp"

namespace penumbra {

namespace {

struct Free {
    void operator()(spng_ctx* context) const { spng_ctx_free(context); }
};

class Reader {
public:
    Reader(std::span<const std::byte> png, std::string_view where) : png_(png), where_(where), context_(spng_ctx_new(0))
    {
        if (!context_) throw Error(ErrorCode::internal, "no memory to read a PNG");
        check(spng_set_crc_action(context_.get(), SPNG_CRC_ERROR, SPNG_CRC_ERROR));
        check(spng_set_png_buffer(context_.get(), png.data(), png.size()));
        check(spng_get_ihdr(context_.get(), &header_));
    }

    PngImage read(std::uint64_t max_samples)
    {
        // Palettes become colours, a transparent colour becomes alpha, and fewer bits than 8 become 8.
        spng_trns ignored;
        const int transparency = spng_get_trns(context_.get(), &ignored);
        const bool clear = transparency != SPNG_ECHUNKAVAIL;
        if (clear) check(transparency);
        const bool colour = header_.color_type & SPNG_COLOR_TYPE_TRUECOLOR, alpha = clear || header_.color_type & 4;
        const int channels = (colour ? 3 : 1) + (alpha ? 1 : 0);
        check_size(channels, max_samples);
        PngImage image{static_cast<int>(header_.width), static_cast<int>(header_.height), channels, header_.bit_depth == 16 ? 16 : 8, {}, pixel_aspect()};
        if (image.bits == 16)
            decode<std::uint16_t>(image, !clear ? SPNG_FMT_PNG : colour ? SPNG_FMT_RGBA16 : SPNG_FMT_GA16);
        else if (header_.color_type == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA)
            decode<std::uint8_t>(image, SPNG_FMT_PNG);
        else
            decode<std::uint8_t>(image, colour ? (alpha ? SPNG_FMT_RGBA8 : SPNG_FMT_RGB8) : alpha ? SPNG_FMT_GA8 : SPNG_FMT_G8);
        return image;
    }

private:
    void check(int result) const
    {
        if (result != 0)
            throw Error(ErrorCode::invalid_input, std::string(where_) + " is truncated or broken: PNG: " + spng_strerror(result));
    }

    // Pixels a unit each way; without them pixels are square.
    double pixel_aspect() const
    {
        spng_phys density{};
        if (spng_get_phys(context_.get(), &density) != 0 || density.ppu_x == 0 || density.ppu_y == 0) return 1;
        return static_cast<double>(density.ppu_y) / density.ppu_x;
    }

    void check_size(int channels, std::uint64_t max_samples) const
    {
        const std::string size = std::to_string(header_.width) + " x " + std::to_string(header_.height);
        const std::uint64_t pixels = std::uint64_t{header_.width} * header_.height;
        if (pixels > max_samples / static_cast<std::uint64_t>(channels))
            throw Error(ErrorCode::too_large, std::string(where_) + " is " + size + " x " + std::to_string(channels) +
                                                  " samples; the limit is " + std::to_string(max_samples));
        if (pixels / 8 / most_inflated > png_.size()) // one bit a pixel is the least
            throw Error(ErrorCode::invalid_input, std::string(where_) + " is truncated or broken: " + std::to_string(png_.size()) +
                                                      " bytes cannot hold " + size + " pixels");
        // Samples as they are stored, as float, and one of two copies of those where channels are picked.
        require_memory(static_cast<double>(pixels) * channels * 10, where_);
    }

    // What follows the pixels. Of the last chunk libspng reads no more than its name.
    void check_end() const
    {
        using namespace std::string_view_literals;
        check(spng_decode_chunks(context_.get()));
        const std::string_view text(reinterpret_cast<const char*>(png_.data()), png_.size());
        if (text.rfind("\0\0\0\0IEND\xae\x42\x60\x82"sv) == std::string_view::npos) check(SPNG_EOF);
    }

    template <class Sample> void decode(PngImage& image, int format)
    {
        std::size_t bytes = 0;
        check(spng_decoded_image_size(context_.get(), format, &bytes));
        const std::size_t count = bytes / sizeof(Sample);
        const auto samples = std::make_unique_for_overwrite<Sample[]>(count);
        check(spng_decode_image(context_.get(), samples.get(), bytes, format, SPNG_DECODE_TRNS));
        check_end();
        image.samples.assign(samples.get(), samples.get() + count);
    }

    std::span<const std::byte> png_;
    std::string_view where_;
    std::unique_ptr<spng_ctx, Free> context_;
    spng_ihdr header_{};
};

} // namespace

PngImage decode_png(std::span<const std::byte> png, std::string_view where, std::uint64_t max_samples)
{
    return Reader(png, where).read(max_samples);
}

} // namespace penumbra
