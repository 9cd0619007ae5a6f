// libpng prints what it thinks of a broken file, and OpenImageIO gives us no way to have it told otherwise. So all that it could complain
// about is looked at here (PNG, third edition, 5 to 11; libpng 1.6's png_handle_*), and what it gets is sound.
#include <algorithm>
#include <array>
#include <string>

#include <libdeflate.h>

#include <penumbra/error.hpp>

#include "io/png.hpp"
#include "io/png_chunks.hpp"

namespace penumbra {

namespace {

// libpng reads no more, and says so on standard error.
constexpr std::uint32_t largest_side = 1000000;

// No deflate stream becomes more than this many times longer (zlib's documentation).
constexpr std::uint64_t most_inflated = 1032;

enum Colour { grey = 0, rgb = 2, palette = 3, grey_alpha = 4, rgb_alpha = 6 };

struct Header {
    std::uint32_t width, height;
    std::uint32_t bits, channels;
    int colour;
    bool interlaced;
};

class Reader {
public:
    Reader(std::span<const std::byte> png, std::string_view where, std::uint64_t max_samples)
        : rest_(png.subspan(png_signature.size())), where_(where), max_samples_(max_samples)
    {
    }

    std::vector<std::byte> unpack()
    {
        read_chunks();
        check_palette();
        check_transparency();
        const Buffer rows = inflate();
        check_filters(rows);

        std::vector<std::byte> png(png_signature.begin(), png_signature.end());
        append_chunk(png, "IHDR", header_bytes_);
        if (header_.colour == palette) append_chunk(png, "PLTE", palette_);
        if (!transparency_.empty()) append_chunk(png, "tRNS", transparency_);
        append_rows(png, rows, 0);
        append_chunk(png, "IEND", {});
        return png;
    }

private:
    Error broken(const std::string& what) const
    {
        return {ErrorCode::invalid_input, std::string(where_) + " is truncated or broken: " + what};
    }

    void read_chunks()
    {
        while (rest_.size() >= png_frame_size) {
            const std::size_t length = from_big_endian(rest_);
            if (length > rest_.size() - png_frame_size) break;
            const std::span<const std::byte> chunk = rest_.first(length + png_frame_size);
            const std::string_view type(reinterpret_cast<const char*>(chunk.data()) + 4, 4);
            if (png_checksum(chunk.subspan(4, length + 4)) != from_big_endian(chunk.last(4)))
                throw broken("a PNG chunk has a wrong checksum");
            if ((type == "IHDR") != header_bytes_.empty()) throw broken("expected one IHDR, the PNG's first chunk");
            if (type == "IEND") return;
            read_chunk(type, chunk.subspan(8, length));
            rest_ = rest_.subspan(chunk.size());
        }
        throw broken("the PNG has no end");
    }

    void read_chunk(std::string_view type, std::span<const std::byte> data)
    {
        if (type == "IHDR") read_header(data);
        if (type == "IDAT") append_bytes(packed_, data);
        if (type == "PLTE") keep_one(palette_, type, data);
        if (type == "tRNS") keep_one(transparency_, type, data);
    }

    // Both stand before the pixels, once.
    void keep_one(std::vector<std::byte>& place, std::string_view type, std::span<const std::byte> data) const
    {
        if (!packed_.empty() || !place.empty() || data.empty())
            throw broken("its " + std::string(type) + " chunk is empty, doubled or late");
        place.assign(data.begin(), data.end());
    }

    void read_header(std::span<const std::byte> data)
    {
        if (data.size() != 13) throw broken("its IHDR chunk has " + std::to_string(data.size()) + " bytes, expected 13");
        header_bytes_ = data;
        const auto at = [&](std::size_t i) { return std::to_integer<std::uint32_t>(data[i]); };
        header_ = {from_big_endian(data), from_big_endian(data.subspan(4)), at(8), 1, static_cast<int>(at(9)), at(12) == 1};
        if (header_.width == 0 || header_.height == 0) throw broken("it has no pixels");
        const bool whole_bytes = header_.bits == 8 || header_.bits == 16,
                   parts = header_.bits == 1 || header_.bits == 2 || header_.bits == 4;
        const bool known = header_.colour == grey ? whole_bytes || parts
                           : header_.colour == palette
                               ? header_.bits == 8 || parts
                               : whole_bytes && (header_.colour == rgb || header_.colour == grey_alpha || header_.colour == rgb_alpha);
        if (!known || at(10) != 0 || at(11) != 0 || at(12) > 1)
            throw broken("its IHDR chunk has " + std::to_string(header_.bits) + " bits of colour type " + std::to_string(header_.colour) +
                         ", methods " + std::to_string(at(10)) + ", " + std::to_string(at(11)) + ", " + std::to_string(at(12)) +
                         ", which PNG does not have");
        if (header_.colour == rgb) header_.channels = 3;
        if (header_.colour == grey_alpha) header_.channels = 2;
        if (header_.colour == rgb_alpha) header_.channels = 4;
        check_size();
    }

    void check_size() const
    {
        const std::string size = std::to_string(header_.width) + " x " + std::to_string(header_.height);
        if (header_.width > largest_side || header_.height > largest_side)
            throw Error(ErrorCode::too_large, std::string(where_) + " is " + size + " pixels; the limit of PNG files is " +
                                                  std::to_string(largest_side) + " a side");
        if (std::uint64_t{header_.width} * header_.height > max_samples_ / header_.channels)
            throw Error(ErrorCode::too_large, std::string(where_) + " is " + size + " x " + std::to_string(header_.channels) +
                                                  " samples; the limit is " + std::to_string(max_samples_));
    }

    // In images of other colours a palette is advice.
    void check_palette()
    {
        if (header_.colour != palette) return;
        const std::size_t most = std::size_t{3} << header_.bits;
        if (palette_.empty() || palette_.size() % 3 != 0 || palette_.size() > most)
            throw broken("its palette has " + std::to_string(palette_.size()) + " bytes, expected a multiple of 3 up to " +
                         std::to_string(most));
        // Pixels beyond its end are black to libpng, with a complaint.
        palette_.resize(most);
    }

    void check_transparency()
    {
        if (transparency_.empty()) return;
        const std::size_t colours = palette_.size() / 3;
        const bool fits = header_.colour == palette
                              ? transparency_.size() <= colours
                              : (header_.colour == grey || header_.colour == rgb) && transparency_.size() == 2 * header_.channels;
        if (!fits) throw broken("its tRNS chunk has " + std::to_string(transparency_.size()) + " bytes, which do not fit its colours");
        if (header_.colour == palette) return;
        // One sample of 16 bits a channel, of which only the low ones count.
        const unsigned mask = (1u << header_.bits) - 1;
        for (std::size_t i = 0; i < transparency_.size(); i += 2) {
            transparency_[i] &= std::byte(mask >> 8);
            transparency_[i + 1] &= std::byte(mask);
        }
    }

    // Calls act(bytes of a row, rows) for the image, or for each pass of an interlaced one that has pixels.
    template <class Act> void for_passes(const Act& act) const
    {
        struct Pass {
            std::uint32_t x, y, dx, dy;
        };
        constexpr std::array<Pass, 7> adam7{
            {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4}, {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}}};
        constexpr std::array<Pass, 1> whole{{{0, 0, 1, 1}}};
        for (const Pass& pass : header_.interlaced ? std::span<const Pass>(adam7) : std::span<const Pass>(whole)) {
            if (header_.width <= pass.x || header_.height <= pass.y) continue;
            const std::uint64_t columns = (header_.width - pass.x + pass.dx - 1) / pass.dx,
                                rows = (header_.height - pass.y + pass.dy - 1) / pass.dy;
            act(1 + (columns * header_.channels * header_.bits + 7) / 8, rows); // a filter's number, then samples
        }
    }

    Buffer inflate() const
    {
        std::uint64_t size = 0;
        for_passes([&](std::uint64_t row, std::uint64_t rows) { size += row * rows; });
        if (size / most_inflated > packed_.size())
            throw broken(std::to_string(packed_.size()) + " bytes cannot hold " + std::to_string(header_.width) + " x " +
                         std::to_string(header_.height) + " pixels");
        struct Free {
            void operator()(libdeflate_decompressor* decompressor) const { libdeflate_free_decompressor(decompressor); }
        };
        const std::unique_ptr<libdeflate_decompressor, Free> decompressor(libdeflate_alloc_decompressor());
        if (!decompressor) throw Error(ErrorCode::internal, "no memory to read a PNG");
        Buffer rows(static_cast<std::size_t>(size));
        if (libdeflate_zlib_decompress(decompressor.get(), packed_.data(), packed_.size(), rows.bytes.get(), rows.size, nullptr) !=
            LIBDEFLATE_SUCCESS)
            throw broken("the pixels of the PNG cannot be unpacked");
        return rows;
    }

    void check_filters(const Buffer& buffer) const
    {
        constexpr int last_filter = 4;
        const std::byte* at = buffer.bytes.get();
        for_passes([&](std::uint64_t row, std::uint64_t rows) {
            for (std::uint64_t y = 0; y < rows; ++y, at += row)
                if (std::to_integer<int>(*at) > last_filter) throw broken("the PNG has a row with a filter that PNG does not have");
        });
    }

    std::span<const std::byte> rest_;
    std::string_view where_;
    std::uint64_t max_samples_;
    std::span<const std::byte> header_bytes_;
    Header header_{};
    std::vector<std::byte> palette_, transparency_, packed_;
};

} // namespace

std::vector<std::byte> unpacked_png(std::span<const std::byte> png, std::string_view where, std::uint64_t max_samples)
{
    return Reader(png, where, max_samples).unpack();
}

} // namespace penumbra
