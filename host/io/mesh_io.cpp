#include "io/mesh_io.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <exception>
#include <filesystem>

#include <assimp/BaseImporter.h>
#include <assimp/Importer.hpp>
#include <assimp/importerdesc.h>
#include <assimp/scene.h>

#include <penumbra/error.hpp>

#include "io/image_io.hpp"
#include "io/ply.hpp"
#include "io/polygon.hpp"
#include "scene/weld.hpp"

namespace penumbra {

namespace {

constexpr std::size_t max_triangles = std::size_t{64} << 20;

// Deeper node trees are broken files (or loops).
constexpr int max_nodes_deep = 1000;

struct Format {
    std::string_view extension, loader;
};

// Assimp's loaders by the names that they give themselves; PLY is ours (ply.hpp).
constexpr std::array<Format, 6> formats{{
    {".obj", "Wavefront Object Importer"},
    {".ply", ""},
    {".stl", "Stereolithography (STL) Importer"},
    {".3ds", "Discreet 3DS Importer"},
    {".gltf", "glTF2 Importer"},
    {".glb", "glTF2 Importer"},
}};

Error broken(std::string_view where, const std::string& what) { return {ErrorCode::invalid_input, std::string(where) + " " + what}; }

std::string one_line(std::string text)
{
    std::ranges::replace_if(
        text, [](unsigned char c) { return c < 0x20 || c > 0x7e; }, ' ');
    return text.substr(0, 200);
}

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

// Leaves one loader, so that no content can reach the dozens of others.
void keep_only(Assimp::Importer& importer, std::string_view name)
{
    for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
        if (importer.GetImporterInfo(i)->mName == name) continue;
        Assimp::BaseImporter* const other = importer.GetImporter(i);
        importer.UnregisterLoader(other);
        delete other;
    }
    if (importer.GetImporterCount() == 0) throw Error(ErrorCode::internal, "Assimp lacks its " + std::string(name));
}

// Appends polygons; those with fewer than three corners are points and lines and cast nothing. Triangles that collapse when vertices are
// joined have no area and go.
class Appender {
public:
    Appender(TriangleMesh& mesh, std::string_view where) : mesh_(mesh), where_(where), weld_(mesh.positions) {}

    void reserve(std::size_t vertices) { weld_.reserve(vertices); }

    // The mesh's index of a vertex.
    std::uint32_t vertex(const Imath::V3f& position)
    {
        if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z))
            throw broken(where_, "has a vertex that is not finite");
        return weld_(position);
    }

    void polygon(std::span<const std::uint32_t> corners, bool mirrored = false)
    {
        if (corners.size() < 3) return;
        triangles_.clear();
        triangulate(corners, mesh_.positions, triangles_);
        for (auto& triangle : triangles_) {
            if (mirrored) std::swap(triangle[1], triangle[2]);
            if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) continue;
            mesh_.triangles.push_back(triangle);
        }
        if (mesh_.triangles.size() > max_triangles)
            throw Error(ErrorCode::too_large, std::string(where_) + " has over " + std::to_string(max_triangles) + " triangles");
    }

private:
    TriangleMesh& mesh_;
    std::string_view where_;
    Welder weld_;
    std::vector<std::array<std::uint32_t, 3>> triangles_;
};

void append(const aiMesh& source, const aiMatrix4x4& world_from_mesh, std::string_view where, Appender& out)
{
    const bool mirrored = world_from_mesh.Determinant() < 0;
    std::vector<std::uint32_t> indices(source.mNumVertices), corners;
    for (unsigned i = 0; i < source.mNumVertices; ++i) {
        const aiVector3D p = world_from_mesh * source.mVertices[i];
        indices[i] = out.vertex({p.x, p.y, p.z});
    }
    for (unsigned f = 0; f < source.mNumFaces; ++f) {
        const aiFace& face = source.mFaces[f];
        corners.clear();
        for (unsigned k = 0; k < face.mNumIndices; ++k) {
            if (face.mIndices[k] >= source.mNumVertices)
                throw broken(where,
                             "has a face with vertex " + std::to_string(face.mIndices[k]) + " of " + std::to_string(source.mNumVertices));
            corners.push_back(indices[face.mIndices[k]]);
        }
        out.polygon(corners, mirrored);
    }
}

void append_tree(const aiScene& scene, const aiNode& node, const aiMatrix4x4& world_from_parent, int depth, std::string_view where,
                 Appender& out)
{
    if (depth > max_nodes_deep) throw broken(where, "has nodes nested deeper than " + std::to_string(max_nodes_deep));
    const aiMatrix4x4 world_from_node = world_from_parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
        if (node.mMeshes[i] >= scene.mNumMeshes) throw broken(where, "has a node with a mesh that is not there");
        append(*scene.mMeshes[node.mMeshes[i]], world_from_node, where, out);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) append_tree(scene, *node.mChildren[i], world_from_node, depth + 1, where, out);
}

// Vertices that no triangle uses (points, lines, collapsed triangles) would count in bounds.
void drop_unused(TriangleMesh& mesh)
{
    constexpr std::uint32_t unused = ~0u;
    std::vector<std::uint32_t> renamed(mesh.positions.size(), unused);
    std::vector<Imath::V3f> positions;
    positions.reserve(mesh.positions.size());
    for (auto& triangle : mesh.triangles)
        for (std::uint32_t& index : triangle) {
            if (renamed[index] == unused) {
                renamed[index] = static_cast<std::uint32_t>(positions.size());
                positions.push_back(mesh.positions[index]);
            }
            index = renamed[index];
        }
    mesh.positions = std::move(positions);
}

// No post-processing: its triangulation aborts the process on broken polygons.
void read_by_assimp(const std::string& path, const Format& format, std::string_view where, Appender& out)
{
    Assimp::Importer importer;
    keep_only(importer, format.loader);
    const aiScene* scene = importer.ReadFile(path, 0);
    if (!scene) throw broken(where, "cannot be read as a mesh: " + one_line(importer.GetErrorString()));
    if (!scene->mRootNode) throw broken(where, "has no triangles");
    std::size_t vertices = 0;
    for (unsigned i = 0; i < scene->mNumMeshes; ++i) vertices += scene->mMeshes[i]->mNumVertices;
    out.reserve(vertices);
    append_tree(*scene, *scene->mRootNode, aiMatrix4x4(), 0, where, out);
}

void read_ply(const std::string& path, std::string_view where, Appender& out)
{
    const PolygonSoup soup = decode_ply(read_file(path, where), where);
    out.reserve(soup.positions.size());
    std::vector<std::uint32_t> indices, corners;
    indices.reserve(soup.positions.size());
    for (const Imath::V3f& position : soup.positions) indices.push_back(out.vertex(position));
    std::size_t at = 0;
    for (const std::uint32_t size : soup.sizes) {
        corners.clear();
        for (std::size_t k = 0; k < size; ++k) corners.push_back(indices[soup.corners[at + k]]);
        at += size;
        out.polygon(corners);
    }
}

} // namespace

TriangleMesh read_mesh(const std::string& path, std::string_view where)
{
    const Format& format = format_of(path, where);
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        throw Error(ErrorCode::not_found, std::string(where) + ": no such file", "looked for " + path);
    if (!std::filesystem::is_regular_file(path, error)) throw broken(where, "is not a file");

    TriangleMesh mesh;
    Appender out(mesh, where);
    try {
        if (format.loader.empty())
            read_ply(path, where, out);
        else
            read_by_assimp(path, format, where, out);
    } catch (const Error&) {
        throw;
    } catch (const std::exception& failure) {
        throw broken(where, "cannot be read as a mesh: " + one_line(failure.what()));
    }
    drop_unused(mesh);
    if (mesh.triangles.empty()) throw broken(where, "has no triangles");
    return mesh;
}

} // namespace penumbra
