#include "io/mesh_io.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <exception>
#include <filesystem>

#include <penumbra/error.hpp>

#include "io/assimp.hpp"
#include "io/gltf.hpp"
#include "io/image_io.hpp"
#include "io/mesh_build.hpp"
#include "io/obj.hpp"
#include "io/ply.hpp"
#include "io/stl.hpp"
#include "io/words.hpp"

namespace penumbra {

namespace {

using Read = PolygonSoup (*)(const std::string& path, const MeshSource& source);

struct Format {
    std::string_view extension;
    Read read;
};

// Nothing but the extension decides: no content can reach another reader.
constexpr std::array<Format, 6> formats{{
    {".obj", [](const std::string& path, const MeshSource& source) { return decode_obj(read_file(path, source.where), source); }},
    {".ply", [](const std::string& path, const MeshSource& source) { return decode_ply(read_file(path, source.where), source.where); }},
    {".stl", [](const std::string& path, const MeshSource& source) { return decode_stl(read_file(path, source.where), source.where); }},
    {".3ds", [](const std::string& path, const MeshSource& source) { return read_3ds(path, source.where); }},
    {".gltf", [](const std::string& path, const MeshSource& source) { return decode_gltf(read_file(path, source.where), source); }},
    {".glb", [](const std::string& path, const MeshSource& source) { return decode_gltf(read_file(path, source.where), source); }},
}};

const Format& format_of(const std::string& path, std::string_view where)
{
    std::string extension = std::filesystem::path(path).extension().string();
    std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const auto found = std::ranges::find(formats, std::string_view(extension), &Format::extension);
    if (found == formats.end())
        throw Error(ErrorCode::unsupported, std::string(where) + " has a format that is not read",
                    "meshes: .obj, .ply, .stl, .3ds, .gltf (version 2), .glb");
    return *found;
}

// Files that the mesh names, beside it.
Bytes beside(const std::string& path, const std::string& name)
{
    const std::string other = (std::filesystem::path(path).parent_path() / name).string();
    return Bytes(read_file(other, other));
}

} // namespace

TriangleMesh read_mesh(const std::string& path, std::string_view where, const MeshOptions& options)
{
    const Format& format = format_of(path, where);
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        throw Error(ErrorCode::not_found, std::string(where) + ": no such file", "looked for " + path);
    if (!std::filesystem::is_regular_file(path, error)) throw broken_mesh(where, "is not a file");

    MeshSource source{.where = where, .companion = options.companion, .max_samples = options.max_samples, .warnings = options.warnings};
    if (!source.companion) source.companion = [&](const std::string& name) { return beside(path, name); };
    try {
        return build_mesh(format.read(path, source), options.placement, options.weld, source);
    } catch (const Error&) {
        throw;
    } catch (const std::exception& failure) {
        throw broken_mesh(where, "cannot be read as a mesh: " + one_line(failure.what()));
    }
}

} // namespace penumbra
