// TIFF and Radiance to bytes, through OpenImageIO 2.4.
#include <cstring>
#include <memory>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <penumbra/error.hpp>

#include "io/openimageio/module.hpp"

namespace penumbra {

namespace {

OIIO::TypeDesc stored_type(int bits) { return bits == 8 ? OIIO::TypeUInt8 : bits == 16 ? OIIO::TypeUInt16 : OIIO::TypeFloat; }

// ZIP at zlib's fastest level (docs/bench.md has times and sizes). No date: the same pixels make the same bytes.
OIIO::ImageSpec spec_for(const Image& image, ImageFormat format, int bits)
{
    OIIO::ImageSpec spec(image.width, image.height, image.channels, stored_type(bits));
    spec.attribute("oiio:ColorSpace", "Linear");
    spec.attribute("oiio:UnassociatedAlpha", 1); // samples as they stand
    if (format == ImageFormat::tiff) spec.attribute("tiff:zipquality", 1);
    // Left out, OpenImageIO writes the time of day. These blanks are Exif's way to say that it is not known.
    spec.attribute("DateTime", "    :  :     :  :  ");
    return spec;
}

} // namespace

std::vector<std::byte> encode_by_openimageio(const Image& image, ImageFormat format, int bits)
{
    configure_openimageio();
    const std::string name = plugin(format);
    std::vector<unsigned char> buffer;
    OIIO::Filesystem::IOVecOutput memory(buffer);
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(name);
    if (!output || !output->set_ioproxy(&memory) || !output->open("image." + name, spec_for(image, format, bits)) ||
        !output->write_image(OIIO::TypeFloat, image.pixels.data()) || !output->close())
        throw Error(ErrorCode::output, "the image cannot be written as " + name + ": " + (output ? output->geterror() : OIIO::geterror()));
    std::vector<std::byte> bytes(buffer.size());
    std::memcpy(bytes.data(), buffer.data(), buffer.size());
    return bytes;
}

} // namespace penumbra
