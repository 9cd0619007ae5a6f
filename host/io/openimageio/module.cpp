#include "io/openimageio/module.hpp"

#include <mutex>

#include <OpenImageIO/imageio.h>

namespace penumbra {

std::string plugin(ImageFormat format)
{
    switch (format) {
    case ImageFormat::exr:
        return "openexr";
    case ImageFormat::tiff:
        return "tiff";
    case ImageFormat::hdr:
        return "hdr";
    case ImageFormat::jpeg:
        return "jpeg";
    default:
        return {};
    }
}

void configure_openimageio()
{
    static std::once_flag once;
    std::call_once(once, [] {
        OIIO::attribute("threads", 1);
        OIIO::attribute("exr_threads", 1);
        OIIO::attribute("try_all_readers", 0);
    });
}

} // namespace penumbra

extern "C" PENUMBRA_API const penumbra::OpenImageIO* penumbra_openimageio()
{
    using namespace penumbra;
    static constexpr OpenImageIO functions{PENUMBRA_VERSION, decode_by_openimageio, decode_planes_by_openimageio, encode_by_openimageio};
    return &functions;
}
