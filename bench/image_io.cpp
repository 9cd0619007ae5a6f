// Images from bytes and to bytes, beside OpenImageIO as it does them by itself: the same files, in the same run.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "cases.hpp"
#include "io/image_format.hpp"
#include "io/image_io.hpp"
#include "rows.hpp"
#include "scenes.hpp"

namespace penumbra::bench {
namespace {

using Bytes = std::vector<unsigned char>;

Timing time_of(const std::function<void()>& act)
{
    act();
    std::vector<double> samples;
    for (int run = 0; run < 31; ++run) {
        const auto begun = std::chrono::steady_clock::now();
        act();
        samples.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count());
    }
    return timing_of(samples);
}

// What OpenImageIO makes of an image when it is asked for nothing but the format and, for EXR, a compression.
Bytes plain_encode(const Image& image, const std::string& plugin, OIIO::TypeDesc type, const std::string& compression)
{
    OIIO::ImageSpec spec(image.width, image.height, image.channels, type);
    spec.attribute("oiio:ColorSpace", "Linear");
    if (!compression.empty()) spec.attribute("compression", compression);
    Bytes bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const auto output = OIIO::ImageOutput::create(plugin);
    if (!output || !output->set_ioproxy(&memory) || !output->open("image." + plugin, spec) ||
        !output->write_image(OIIO::TypeFloat, image.pixels.data()) || !output->close())
        throw Error(ErrorCode::output, "bench image_io: OpenImageIO does not write " + plugin);
    return bytes;
}

std::vector<float> plain_decode(const Bytes& bytes, const std::string& plugin)
{
    OIIO::Filesystem::IOMemReader memory(bytes.data(), bytes.size());
    const auto input = OIIO::ImageInput::create(plugin);
    OIIO::ImageSpec spec;
    if (!input || !input->set_ioproxy(&memory) || !input->open("image." + plugin, spec))
        throw Error(ErrorCode::invalid_input, "bench image_io: OpenImageIO does not read " + plugin);
    std::vector<float> samples(spec.image_pixels());
    if (!input->read_image(0, 0, 0, 1, OIIO::TypeFloat, samples.data()))
        throw Error(ErrorCode::invalid_input, "bench image_io: OpenImageIO does not read " + plugin);
    return samples;
}

void row(const std::string& what, std::size_t plain_size, const std::optional<Timing>& plain, std::size_t size, const Timing& ours)
{
    char before[96] = "| |";
    if (plain) std::snprintf(before, sizeof before, "| %zu | %.2f / %.2f / %.2f", plain_size, plain->min, plain->median, plain->max);
    std::printf("# | %s %s | %zu | %.2f / %.2f / %.2f |\n", what.c_str(), before, size, ours.min, ours.median, ours.max);
    std::fflush(stdout);
}

void decode_rows(const char* name, const DepthMap& depth)
{
    const Image image{depth.width, depth.height, 1, depth.depth};
    for (const auto& [type, bits] : {std::pair{OIIO::TypeFloat, "float32"}, {OIIO::TypeHalf, "half"}})
        for (const char* compression : {"zip", "zips", "none", "piz"}) {
            const Bytes bytes = plain_encode(image, "openexr", type, compression);
            const Timing plain = time_of([&] { plain_decode(bytes, "openexr"); });
            RawDepth raw;
            const Timing ours = time_of([&] { raw = decode_raw_depth(std::as_bytes(std::span(bytes)), "", "bench"); });
            if (raw.samples != plain_decode(bytes, "openexr")) throw Error(ErrorCode::internal, "bench image_io: samples differ");
            row(std::string("read ") + name + ", EXR " + bits + " " + compression, bytes.size(), plain, bytes.size(), ours);
        }
    const std::vector<std::byte> pfm = encode_image(image, {"pfm", 32});
    row(std::string("read ") + name + ", PFM", 0, {}, pfm.size(), time_of([&] { decode_raw_depth(pfm, "", "bench"); }));
}

void encode_rows(const char* name, const Image& mask)
{
    struct Case {
        OutputFormat format;
        const char* plugin; // none for PFM
        OIIO::TypeDesc type;
    };
    for (const Case& c : {Case{{"png", 16}, "png", OIIO::TypeUInt16}, Case{{"png", 8}, "png", OIIO::TypeUInt8},
                          Case{{"exr", 32}, "openexr", OIIO::TypeFloat}, Case{{"exr", 16}, "openexr", OIIO::TypeHalf},
                          Case{{"tif", 32}, "tiff", OIIO::TypeFloat}, Case{{"tif", 16}, "tiff", OIIO::TypeUInt16},
                          Case{{"pfm", 32}, nullptr, OIIO::TypeFloat}}) {
        std::optional<Timing> plain;
        std::size_t plain_size = 0;
        if (c.plugin) plain = time_of([&] { plain_size = plain_encode(mask, c.plugin, c.type, "").size(); });
        std::size_t size = 0;
        const Timing ours = time_of([&] { size = encode_image(mask, c.format).size(); });
        row(std::string("write ") + name + ", " + c.format.format + " " + std::to_string(c.format.bits), plain_size, plain, size, ours);
    }
}

} // namespace

void image_io(const Engine& engine)
{
    // One thread, as for all that goes through it in penumbra.
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", 1);
    std::puts("# | 512 x 512, one channel | OpenImageIO: bytes | ms min / median / max | penumbra: bytes | ms min / median / max |");
    std::puts("# | --- | --- | --- | --- | --- |");
    const SceneOptions options{.light_side = 1, .occluder_resolution = 512};
    const Scene scene = with_depth(paper_scene(Occluder::bunny, options), SoftShadowMap{});
    decode_rows("bunny's front", *scene.occluders.front);
    decode_rows("floor", *scene.receivers.depth);
    encode_rows("hard mask", engine.mask(scene, ShadowMap{}).visibility);
    encode_rows("soft mask", engine.mask(scene, SoftShadowMap{}).visibility);
    const Scene wide = with_depth(paper_scene(Occluder::bunny, {.light_side = 3, .occluder_resolution = 512}), SoftShadowMap{});
    encode_rows("wide mask", engine.mask(wide, SoftShadowMap{}).visibility);
    encode_rows("64-ray mask", engine.mask(scene, RayTraced{.samples = 64, .adaptive = false, .first_samples = 16, .seed = 1}).visibility);
}

} // namespace penumbra::bench
