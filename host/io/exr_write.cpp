#include "io/exr_write.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include <openexr.h>

#include <penumbra/error.hpp>

#include "io/exr_zip.hpp"

namespace penumbra {

namespace {

std::int64_t append(exr_const_context_t, void* file, const void* bytes, std::uint64_t size, std::uint64_t offset,
                    exr_stream_error_func_ptr_t)
{
    auto& all = *static_cast<std::vector<std::byte>*>(file);
    all.resize(std::max<std::size_t>(all.size(), offset + size));
    std::memcpy(all.data() + offset, bytes, size);
    return static_cast<std::int64_t>(size);
}

void check(exr_result_t result)
{
    if (result == EXR_ERR_SUCCESS) return;
    throw Error(ErrorCode::output, std::string("the image cannot be written as exr: ") + exr_get_default_error_message(result));
}

// A file that is being written to memory, and the state of a chunk's way into it.
struct Writer {
    explicit Writer(std::vector<std::byte>& file)
    {
        exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
        settings.error_handler_fn = [](exr_const_context_t, exr_result_t, const char*) {}; // by default it prints
        settings.user_data = &file;
        settings.write_fn = append;
        check(exr_start_write(&context, "mask.exr", EXR_WRITE_FILE_DIRECTLY, &settings));
    }
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;
    ~Writer()
    {
        if (chunk.context) exr_encoding_destroy(context, &chunk);
        exr_finish(&context);
    }

    exr_context_t context = nullptr;
    exr_encode_pipeline_t chunk = EXR_ENCODE_PIPELINE_INITIALIZER;
    ExrDeflater deflater;
    std::vector<unsigned char> packed;
};

exr_result_t deflate(exr_encode_pipeline_t* chunk)
{
    // As OpenEXRCore stores bytes as they are: what is to be written is what was packed. Its buffer for the other case is ours.
    const std::size_t size = chunk->packed_bytes;
    auto& writer = *static_cast<Writer*>(chunk->encoding_user_data);
    writer.packed.resize(size);
    const std::size_t packed = writer.deflater.deflate({static_cast<const unsigned char*>(chunk->packed_buffer), size}, writer.packed);
    chunk->compressed_buffer = packed > 0 ? writer.packed.data() : chunk->packed_buffer;
    chunk->compressed_bytes = packed > 0 ? packed : size;
    chunk->compressed_alloc_size = 0;
    return EXR_ERR_SUCCESS;
}

void write_header(exr_context_t context, const Image& image, int bits, std::span<const char* const> names)
{
    int part = 0;
    check(exr_add_part(context, "", EXR_STORAGE_SCANLINE, &part));
    check(exr_initialize_required_attr_simple(context, part, image.width, image.height, EXR_COMPRESSION_ZIP));
    const exr_pixel_type_t type = bits == 16 ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
    for (const char* name : names) check(exr_add_channel(context, part, name, type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1));
    check(exr_write_header(context));
}

// The rows from y on, as many as a chunk has.
void write_chunk(Writer& writer, const Image& image, std::span<const char* const> names, int y)
{
    exr_chunk_info_t info = {};
    check(exr_write_scanline_chunk_info(writer.context, 0, y, &info));
    const bool first = !writer.chunk.context;
    check(first ? exr_encoding_initialize(writer.context, 0, &info, &writer.chunk)
                : exr_encoding_update(writer.context, 0, &info, &writer.chunk));

    // The file has its channels in the order of their names, the image in that of `names`.
    for (exr_coding_channel_info_t& channel : std::span(writer.chunk.channels, names.size())) {
        const auto c = std::ranges::find_if(names, [&](const char* name) { return std::strcmp(name, channel.channel_name) == 0; });
        channel.user_data_type = EXR_PIXEL_FLOAT;
        channel.user_bytes_per_element = sizeof(float);
        channel.user_pixel_stride = static_cast<std::int32_t>(names.size() * sizeof(float));
        channel.user_line_stride = channel.user_pixel_stride * image.width;
        const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) * names.size();
        channel.encode_from_ptr = reinterpret_cast<const std::uint8_t*>(&image.pixels[at + static_cast<std::size_t>(c - names.begin())]);
    }
    if (first) {
        check(exr_encoding_choose_default_routines(writer.context, 0, &writer.chunk));
        writer.chunk.encoding_user_data = &writer;
        writer.chunk.compress_fn = deflate;
    }
    check(exr_encoding_run(writer.context, 0, &writer.chunk));
}

} // namespace

std::vector<std::byte> encode_exr(const Image& image, int bits, std::span<const char* const> names)
{
    std::vector<std::byte> file;
    Writer writer(file);
    write_header(writer.context, image, bits, names);
    std::int32_t rows = 0;
    check(exr_get_scanlines_per_chunk(writer.context, 0, &rows));
    for (int y = 0; y < image.height; y += rows) write_chunk(writer, image, names, y);
    return file;
}

} // namespace penumbra
