// The layout is that of OpenEXR's "OpenEXR File Layout": a table of 64-bit offsets, one a chunk; each chunk is its first row's number, its
// packed size, and the rows, within which the channels lie one after another. ZIP: bytes at even places, then those at odd places; each
// replaced by its difference to the one before (plus 128); deflated. A chunk that would not become smaller is stored as it is.
#include "io/exr_scanlines.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <memory>

#include <Imath/half.h>
#include <libdeflate.h>

#include "scene/parallel.hpp"

namespace penumbra {

namespace {

constexpr int uncompressed = 0, zip_rows = 2, zip_16_rows = 3;
constexpr std::size_t offset_size = 8, chunk_header_size = 8;

// No deflate stream becomes more than this many times longer (zlib's documentation).
constexpr std::size_t most_inflated = 1032;

// Below this a second thread takes longer to start than it helps (some 0.05 ms).
constexpr std::size_t bytes_worth_a_thread = 128 << 10;

std::size_t size_of(SampleType type) { return type == SampleType::float16 ? 2 : 4; }

template <class Unsigned> Unsigned little_endian(const std::byte* bytes)
{
    static_assert(std::endian::native == std::endian::little, "EXR is little-endian, and this reads it as it lies");
    Unsigned value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

float as_float(std::uint32_t bits, SampleType type)
{
    if (type == SampleType::float32) return std::bit_cast<float>(bits);
    if (type == SampleType::float16) return imath_half_to_float(static_cast<std::uint16_t>(bits));
    return static_cast<float>(bits);
}

struct Layout {
    std::size_t row_bytes = 0, channel_at = 0, rows_per_chunk = 1, chunks = 0;

    Layout(const ExrHeader& header, std::size_t channel)
    {
        const std::size_t width = static_cast<std::size_t>(header.width), height = static_cast<std::size_t>(header.height);
        for (std::size_t c = 0; c < header.channels.size(); ++c) {
            if (c == channel) channel_at = row_bytes;
            row_bytes += width * size_of(header.channels[c].type);
        }
        if (header.compression == zip_16_rows) rows_per_chunk = 16;
        chunks = (height + rows_per_chunk - 1) / rows_per_chunk;
    }
};

struct Chunk {
    std::span<const std::byte> packed;
    std::size_t first_row, rows; // counted from the top
};

// Every chunk of the file, in the order of rows; nothing when one is not where, or not what, it must be.
std::optional<std::vector<Chunk>> find_chunks(std::span<const std::byte> exr, const ExrHeader& header, const Layout& layout)
{
    if (layout.chunks > (exr.size() - header.end) / offset_size) return {};
    const std::size_t after_table = header.end + layout.chunks * offset_size;
    std::vector<Chunk> chunks;
    chunks.reserve(layout.chunks);
    for (std::size_t i = 0; i < layout.chunks; ++i) {
        const std::uint64_t at = little_endian<std::uint64_t>(exr.data() + header.end + i * offset_size);
        if (at < after_table || at > exr.size() || exr.size() - at < chunk_header_size) return {};
        const std::size_t first = i * layout.rows_per_chunk;
        const std::size_t rows = std::min(layout.rows_per_chunk, static_cast<std::size_t>(header.height) - first);
        const std::size_t bytes = rows * layout.row_bytes;
        const std::int64_t row = static_cast<std::int32_t>(little_endian<std::uint32_t>(exr.data() + at));
        const std::size_t size = little_endian<std::uint32_t>(exr.data() + at + 4);
        if (row != static_cast<std::int64_t>(first) + header.first_row || size > exr.size() - at - chunk_header_size) return {};
        if (size > bytes || (size < bytes && (header.compression == uncompressed || size < bytes / most_inflated))) return {};
        chunks.push_back({exr.subspan(at + chunk_header_size, size), first, rows});
    }
    return chunks;
}

// Takes a chunk apart. One a thread.
class Unpacker {
public:
    Unpacker(const ExrHeader& header, const Layout& layout, std::size_t channel, float* samples)
        : layout_(layout), width_(static_cast<std::size_t>(header.width)), type_(header.channels[channel].type), samples_(samples)
    {
    }

    bool unpack(const Chunk& chunk)
    {
        const std::size_t bytes = chunk.rows * layout_.row_bytes;
        if (chunk.packed.size() < bytes && !inflate(chunk.packed, bytes)) return false;
        for (std::size_t y = 0; y < chunk.rows; ++y) {
            const std::size_t at = y * layout_.row_bytes + layout_.channel_at;
            float* const row = samples_ + (chunk.first_row + y) * width_;
            if (chunk.packed.size() == bytes)
                copy_row(chunk.packed.data() + at, row);
            else
                join_row(inflated_.data() + at / 2, inflated_.data() + (bytes + 1) / 2 + at / 2, row);
        }
        return true;
    }

private:
    // Inflates, and sums the differences up; the bytes stay apart in their two halves.
    bool inflate(std::span<const std::byte> packed, std::size_t bytes)
    {
        inflated_.resize(bytes);
        if (!decompressor_ || libdeflate_zlib_decompress(decompressor_.get(), packed.data(), packed.size(), inflated_.data(), bytes,
                                                         nullptr) != LIBDEFLATE_SUCCESS)
            return false;
        unsigned sum = inflated_[0];
        for (std::size_t i = 1; i < bytes; ++i) {
            sum += inflated_[i] ^ 128u; // - 128, in bytes
            inflated_[i] = static_cast<unsigned char>(sum);
        }
        return true;
    }

    void copy_row(const std::byte* bytes, float* row) const
    {
        if (type_ == SampleType::float32)
            std::memcpy(row, bytes, width_ * sizeof(float));
        else if (type_ == SampleType::float16)
            for (std::size_t x = 0; x < width_; ++x) row[x] = as_float(little_endian<std::uint16_t>(bytes + 2 * x), type_);
        else
            for (std::size_t x = 0; x < width_; ++x) row[x] = as_float(little_endian<std::uint32_t>(bytes + 4 * x), type_);
    }

    // A sample's bytes lie by turns in `even` and `odd`: rows, channels and samples all begin at even places.
    void join_row(const unsigned char* even, const unsigned char* odd, float* row) const
    {
        const auto pair = [&](std::size_t i) { return static_cast<std::uint32_t>(even[i] | odd[i] << 8); };
        if (type_ == SampleType::float16)
            for (std::size_t x = 0; x < width_; ++x) row[x] = as_float(pair(x), SampleType::float16);
        else if (type_ == SampleType::float32)
            for (std::size_t x = 0; x < width_; ++x) row[x] = as_float(pair(2 * x) | pair(2 * x + 1) << 16, SampleType::float32);
        else
            for (std::size_t x = 0; x < width_; ++x) row[x] = as_float(pair(2 * x) | pair(2 * x + 1) << 16, SampleType::uint32);
    }

    struct Free {
        void operator()(libdeflate_decompressor* decompressor) const { libdeflate_free_decompressor(decompressor); }
    };
    const Layout& layout_;
    std::size_t width_;
    SampleType type_;
    float* samples_;
    std::unique_ptr<libdeflate_decompressor, Free> decompressor_{libdeflate_alloc_decompressor()};
    std::vector<unsigned char> inflated_;
};

} // namespace

bool has_plain_scanlines(const ExrHeader& header)
{
    return header.plain && (header.compression == uncompressed || header.compression == zip_rows || header.compression == zip_16_rows);
}

std::optional<std::vector<float>> read_exr_channel(std::span<const std::byte> exr, const ExrHeader& header, std::size_t channel)
{
    const Layout layout(header, channel);
    const auto chunks = find_chunks(exr, header, layout);
    if (!chunks) return {};

    std::vector<float> samples(static_cast<std::size_t>(header.width) * static_cast<std::size_t>(header.height));
    // Runs of chunks: a few for each thread, in case one of them is slower.
    constexpr std::size_t runs_a_thread = 4;
    const std::size_t whole = layout.row_bytes * static_cast<std::size_t>(header.height);
    const std::size_t most = std::min({chunks->size(), whole / bytes_worth_a_thread + 1, runs_a_thread * thread_count()});
    std::atomic<bool> sound{true};
    parallel_for(static_cast<int>(most), [&](int run) {
        Unpacker unpacker(header, layout, channel, samples.data());
        const std::size_t first = chunks->size() * static_cast<std::size_t>(run) / most;
        const std::size_t end = chunks->size() * (static_cast<std::size_t>(run) + 1) / most;
        for (std::size_t i = first; i < end && sound; ++i)
            if (!unpacker.unpack((*chunks)[i])) sound = false;
    });
    if (!sound) return {};
    return samples;
}

} // namespace penumbra
