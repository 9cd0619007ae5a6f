#include "io/exr_read.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>
#include <limits>

#include <openexr.h>

#include "io/exr_zip.hpp"
#include "io/image_format.hpp"
#include "scene/parallel.hpp"

namespace penumbra {

namespace {

// Below this a second thread takes longer to start than it helps (some 0.05 ms).
constexpr std::size_t bytes_worth_a_thread = 128 << 10;

std::int64_t copy(exr_const_context_t, void* file, void* bytes, std::uint64_t size, std::uint64_t offset, exr_stream_error_func_ptr_t)
{
    const std::span<const std::byte> all = *static_cast<const std::span<const std::byte>*>(file);
    const std::size_t there = offset < all.size() ? std::min<std::size_t>(size, all.size() - offset) : 0;
    if (there > 0) std::memcpy(bytes, all.data() + offset, there);
    return static_cast<std::int64_t>(there);
}

std::int64_t size_of(exr_const_context_t, void* file)
{
    return static_cast<std::int64_t>(static_cast<const std::span<const std::byte>*>(file)->size());
}

// Unpacks one chunk after another. One a thread.
class Unpacker {
public:
    Unpacker(exr_const_context_t context, std::span<const std::size_t> picked, const PlainExr& exr, float* samples)
        : context_(context), picked_(picked), exr_(exr), samples_(samples)
    {
    }
    Unpacker(const Unpacker&) = delete;
    Unpacker& operator=(const Unpacker&) = delete;
    ~Unpacker()
    {
        if (chunk_.context) exr_decoding_destroy(context_, &chunk_);
    }

    // `row` and `y`: of the chunk's first row, in the file's numbers and from the top.
    bool unpack(int row, int y)
    {
        exr_chunk_info_t info = {};
        if (exr_read_scanline_chunk_info(context_, 0, row, &info) != EXR_ERR_SUCCESS || info.packed_size > info.unpacked_size ||
            info.packed_size < info.unpacked_size / most_inflated ||
            (info.compression == EXR_COMPRESSION_NONE && info.packed_size != info.unpacked_size))
            return false;
        const bool first = !chunk_.context;
        if ((first ? exr_decoding_initialize(context_, 0, &info, &chunk_) : exr_decoding_update(context_, 0, &info, &chunk_)) !=
            EXR_ERR_SUCCESS)
            return false;
        for (std::size_t i = 0; i < picked_.size(); ++i) {
            exr_coding_channel_info_t& channel = chunk_.channels[picked_[i]];
            if (channel.data_type != EXR_PIXEL_UINT) {
                channel.user_data_type = EXR_PIXEL_FLOAT;
                channel.user_bytes_per_element = sizeof(float);
            }
            channel.user_pixel_stride = static_cast<std::int32_t>(picked_.size() * sizeof(float));
            channel.user_line_stride = channel.user_pixel_stride * exr_.width();
            const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(exr_.width()) * picked_.size() + i;
            channel.decode_to_ptr = reinterpret_cast<std::uint8_t*>(samples_ + at);
        }
        if (first) {
            if (exr_decoding_choose_default_routines(context_, 0, &chunk_) != EXR_ERR_SUCCESS) return false;
            chunk_.decoding_user_data = this;
            if (chunk_.decompress_fn) chunk_.decompress_fn = inflate;
        }
        return exr_decoding_run(context_, 0, &chunk_) == EXR_ERR_SUCCESS;
    }

private:
    static exr_result_t inflate(exr_decode_pipeline_t* chunk)
    {
        const std::size_t packed = chunk->chunk.packed_size, bytes = chunk->chunk.unpacked_size;
        if (packed == bytes) return EXR_ERR_SUCCESS; // stored as it is
        const bool sound = static_cast<Unpacker*>(chunk->decoding_user_data)
                               ->inflater_.inflate({static_cast<const unsigned char*>(chunk->packed_buffer), packed},
                                                   {static_cast<unsigned char*>(chunk->unpacked_buffer), bytes});
        return sound ? EXR_ERR_SUCCESS : EXR_ERR_CORRUPT_CHUNK;
    }

    exr_const_context_t context_;
    std::span<const std::size_t> picked_;
    const PlainExr& exr_;
    float* samples_;
    exr_decode_pipeline_t chunk_ = EXR_DECODE_PIPELINE_INITIALIZER;
    ExrInflater inflater_;
};

// What the header says, if it is of the kind that is read here.
bool is_plain(exr_const_context_t context, const exr_attr_box2i_t& data, const exr_attr_box2i_t& display, const exr_attr_chlist_t& channels)
{
    int parts = 0;
    exr_storage_t storage = EXR_STORAGE_LAST_TYPE;
    exr_compression_t compression = EXR_COMPRESSION_LAST_TYPE;
    if (exr_get_count(context, &parts) != EXR_ERR_SUCCESS || parts != 1 || exr_get_storage(context, 0, &storage) != EXR_ERR_SUCCESS ||
        exr_get_compression(context, 0, &compression) != EXR_ERR_SUCCESS)
        return false;
    const bool zip = compression == EXR_COMPRESSION_ZIP || compression == EXR_COMPRESSION_ZIPS;
    if (storage != EXR_STORAGE_SCANLINE || (!zip && compression != EXR_COMPRESSION_NONE)) return false;
    if (channels.num_channels < 1) return false;
    for (const char* turned : {"Orientation", "orientation"})
        if (const exr_attribute_t* found = nullptr; exr_get_attribute_by_name(context, 0, turned, &found) == EXR_ERR_SUCCESS) return false;

    // OpenEXR itself goes no further; and lengths in bytes must fit OpenEXRCore's 32 bits.
    constexpr std::int64_t furthest = INT32_MAX / 2, most_bytes = INT32_MAX;
    for (const std::int64_t corner : {data.min.x, data.min.y, data.max.x, data.max.y, display.min.x, display.min.y, display.max.x, display.max.y})
        if (corner < -furthest || corner > furthest) return false;
    const std::int64_t columns = std::int64_t{data.max.x} - data.min.x + 1;
    if (columns > most_bytes / 4 / channels.num_channels) return false;
    return std::ranges::all_of(std::span(channels.entries, static_cast<std::size_t>(channels.num_channels)),
                               [](const auto& channel) { return channel.x_sampling == 1 && channel.y_sampling == 1; });
}

} // namespace

struct PlainExr::Source {
    std::span<const std::byte> bytes;
};

void PlainExr::Finish::operator()(_priv_exr_context_t* context) const { exr_finish(&context); }

std::optional<PlainExr> PlainExr::open(std::span<const std::byte> exr)
{
    PlainExr file;
    file.source_ = std::make_shared<Source>(Source{exr});
    exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
    settings.error_handler_fn = [](exr_const_context_t, exr_result_t, const char*) {}; // by default it prints
    settings.user_data = &file.source_->bytes;
    settings.read_fn = copy;
    settings.size_fn = size_of;
    settings.flags = EXR_CONTEXT_FLAG_STRICT_HEADER | EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    exr_context_t context = nullptr;
    if (exr_start_read(&context, "image.exr", &settings) != EXR_ERR_SUCCESS) return {};
    file.context_.reset(context);

    exr_attr_box2i_t data = {}, display = {};
    const exr_attr_chlist_t* channels = nullptr;
    if (exr_get_data_window(context, 0, &data) != EXR_ERR_SUCCESS || exr_get_channels(context, 0, &channels) != EXR_ERR_SUCCESS ||
        exr_get_display_window(context, 0, &display) != EXR_ERR_SUCCESS || !is_plain(context, data, display, *channels))
        return {};
    constexpr std::array types{SampleType::uint32, SampleType::float16, SampleType::float32};
    for (const auto& channel : std::span(channels->entries, static_cast<std::size_t>(channels->num_channels)))
        file.channels_.push_back({channel.name.str, types.at(channel.pixel_type)});
    file.width_ = data.max.x - data.min.x + 1;
    file.height_ = data.max.y - data.min.y + 1;
    file.first_row_ = data.min.y;
    file.frame_ = {display.min.x - data.min.x, display.min.y - data.min.y, display.max.x - display.min.x + 1, display.max.y - display.min.y + 1};
    float aspect = 1;
    if (exr_get_pixel_aspect_ratio(context, 0, &aspect) == EXR_ERR_SUCCESS) file.pixel_aspect_ = static_cast<double>(aspect);
    return file;
}

bool PlainExr::whole() const { return frame_.x == 0 && frame_.y == 0 && frame_.width == width_ && frame_.height == height_; }

std::optional<std::vector<float>> PlainExr::read(std::span<const std::size_t> picked) const
{
    std::int32_t rows = 1;
    if (exr_get_scanlines_per_chunk(context_.get(), 0, &rows) != EXR_ERR_SUCCESS || rows < 1) return {};
    std::vector<float> samples(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * picked.size());

    // Runs of chunks: a few for each thread, in case one of them is slower.
    constexpr std::size_t runs_a_thread = 4;
    const std::size_t chunks = (static_cast<std::size_t>(height_) + static_cast<std::size_t>(rows) - 1) / static_cast<std::size_t>(rows);
    const std::size_t bytes = samples.size() / picked.size() * channels_.size() * sizeof(float);
    const std::size_t most = std::min({chunks, bytes / bytes_worth_a_thread + 1, runs_a_thread * thread_count()});
    std::atomic<bool> sound{true};
    parallel_for(static_cast<int>(most), [&](int run) {
        Unpacker unpacker(context_.get(), picked, *this, samples.data());
        const std::size_t first = chunks * static_cast<std::size_t>(run) / most, end = chunks * (static_cast<std::size_t>(run) + 1) / most;
        for (std::size_t i = first; i < end && sound; ++i)
            if (const int y = static_cast<int>(i) * rows; !unpacker.unpack(first_row_ + y, y)) sound = false;
    });
    if (!sound) return {};
    for (std::size_t i = 0; i < picked.size(); ++i)
        if (channels_[picked[i]].type == SampleType::uint32)
            for (std::size_t at = i; at < samples.size(); at += picked.size())
                samples[at] = static_cast<float>(std::bit_cast<std::uint32_t>(samples[at]));
    return samples;
}

} // namespace penumbra
