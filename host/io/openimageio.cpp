#include "io/openimageio/openimageio.hpp"

#include <string>

#include <dlfcn.h>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

const OpenImageIO& load()
{
    const auto fail = [](const std::string& what) {
        return Error(ErrorCode::internal, "TIFF, Radiance HDR and unusual EXR files need " PENUMBRA_OPENIMAGEIO ": " + what,
                     "install penumbra as a whole");
    };
    // By its name alone: the run path of whoever holds this code says where it lies. Never closed, as OpenImageIO keeps threads. dlmopen,
    // as the sanitizers put their own dlopen before the system's, and their own run path with it.
    void* const module = ::dlmopen(LM_ID_BASE, PENUMBRA_OPENIMAGEIO, RTLD_LAZY | RTLD_LOCAL);
    if (!module) throw fail(::dlerror());
    const auto get = reinterpret_cast<const OpenImageIO* (*)()>(::dlsym(module, openimageio_symbol));
    if (!get) throw fail(::dlerror());
    const OpenImageIO& functions = *get();
    if (std::string_view(functions.version) != PENUMBRA_VERSION)
        throw fail(std::string("it is of version ") + functions.version + ", expected " PENUMBRA_VERSION);
    return functions;
}

} // namespace

const OpenImageIO& openimageio()
{
    static const OpenImageIO& functions = load();
    return functions;
}

} // namespace penumbra
