#include "masks/resources.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <system_error>

#include <stdlib.h>

#include <penumbra/error.hpp>

namespace penumbra::server {

RequestResources::~RequestResources()
{
    std::error_code ignored; // there is nobody to tell, and nothing that could be done
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

std::string_view RequestResources::use(const std::string& name) const
{
    deadline_.check("decoding " + in_quotes(name));
    const auto part = std::ranges::find(parts_, name, &Part::name);
    if (part == parts_.end() || name == "scene") {
        std::string list;
        for (const Part& other : parts_)
            if (other.name != "scene") list += (list.empty() ? "" : ", ") + other.name;
        throw Error(ErrorCode::not_found, "the request has no part named " + in_quotes(name),
                    list.empty() ? "there is no part beside scene" : "its parts: " + list);
    }
    if (++uses_ > options_.parts)
        throw Error(ErrorCode::too_large, "the scene names more than " + std::to_string(options_.parts) + " images and meshes",
                    "the limit of the service");
    return part->bytes;
}

Bytes RequestResources::bytes(const std::string& name) const
{
    const std::string_view text = use(name);
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    const std::string_view format = image_format_of(bytes);
    if (format.empty() || format == "hdr")
        throw Error(ErrorCode::unsupported, "part " + in_quotes(name) + " is of no format that is taken", "expected EXR, PNG, TIFF or PFM");
    return Bytes(bytes);
}

std::string RequestResources::path(const std::string& name) const
{
    if (!options_.allow_meshes)
        throw Error(ErrorCode::unsupported, "this service takes no meshes", "depth images and quads, or a service with --allow-meshes");
    const std::string_view text = use(name);
    if (folder_.empty()) {
        // mkdtemp makes it readable for this user alone.
        std::string pattern = (std::filesystem::temp_directory_path() / "penumbra-XXXXXX").string();
        if (!mkdtemp(pattern.data())) throw Error(ErrorCode::output, "no temporary folder: " + std::generic_category().message(errno));
        folder_ = pattern;
    }
    // The name is that of a part, which has no separators and no . at the start.
    const std::filesystem::path file = folder_ / name;
    std::ofstream out(file, std::ios::binary | std::ios::trunc);
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    if (!out.flush()) throw Error(ErrorCode::output, "a mesh cannot be written to the temporary folder");
    return file.string();
}

} // namespace penumbra::server
