#include "io/mesh_io.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <exception>
#include <filesystem>
#include <unordered_map>

#include <assimp/BaseImporter.h>
#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

constexpr std::size_t max_triangles = std::size_t{64} << 20;

// Deeper node trees are broken files (or loops).
constexpr int max_nodes_deep = 1000;

struct Format {
    std::string_view extension, loader;
};

// Assimp's loaders by the names that they give themselves.
constexpr std::array<Format, 6> formats{{
    {".obj", "Wavefront Object Importer"},
    {".ply", "Stanford Polygon Library (PLY) Importer"},
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

// Joins vertices at equal positions, whatever their normals and texture coordinates: silhouettes need the surface, not its seams.
class Welder {
public:
    explicit Welder(TriangleMesh& mesh) : mesh_(mesh) {}

    std::uint32_t index(Imath::V3f position)
    {
        position += Imath::V3f(0.0f); // -0 becomes 0
        const auto [found, is_new] = known_.try_emplace(position, static_cast<std::uint32_t>(mesh_.positions.size()));
        if (is_new) mesh_.positions.push_back(position);
        return found->second;
    }

    void reserve(std::size_t count) { known_.reserve(count); }

private:
    struct Hash {
        std::size_t operator()(const Imath::V3f& p) const
        {
            std::uint64_t hash = 0;
            for (const float c : {p.x, p.y, p.z}) hash = (hash ^ std::bit_cast<std::uint32_t>(c)) * 0x9e3779b97f4a7c15u, hash ^= hash >> 29;
            return static_cast<std::size_t>(hash);
        }
    };
    TriangleMesh& mesh_;
    std::unordered_map<Imath::V3f, std::uint32_t, Hash> known_;
};

// Appends one mesh under a transform. Triangles that collapse to a line or point when vertices are joined have no area and go.
void append(const aiMesh& source, const aiMatrix4x4& world_from_mesh, std::string_view where, Welder& welder, TriangleMesh& mesh)
{
    const bool mirrored = world_from_mesh.Determinant() < 0;
    std::vector<std::uint32_t> indices(source.mNumVertices);
    for (unsigned i = 0; i < source.mNumVertices; ++i) {
        const aiVector3D p = world_from_mesh * source.mVertices[i];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) throw broken(where, "has a vertex that is not finite");
        indices[i] = welder.index({p.x, p.y, p.z});
    }
    for (unsigned f = 0; f < source.mNumFaces; ++f) {
        const aiFace& face = source.mFaces[f];
        if (face.mNumIndices != 3) continue; // points and lines of meshes that mix them with triangles
        for (unsigned k = 0; k < 3; ++k)
            if (face.mIndices[k] >= source.mNumVertices)
                throw broken(where, "has a triangle with vertex " + std::to_string(face.mIndices[k]) + " of " +
                                        std::to_string(source.mNumVertices));
        std::array<std::uint32_t, 3> triangle{indices[face.mIndices[0]], indices[face.mIndices[1]], indices[face.mIndices[2]]};
        if (mirrored) std::swap(triangle[1], triangle[2]);
        if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) continue;
        mesh.triangles.push_back(triangle);
        if (mesh.triangles.size() > max_triangles)
            throw Error(ErrorCode::too_large, std::string(where) + " has over " + std::to_string(max_triangles) + " triangles");
    }
}

void append_tree(const aiScene& scene, const aiNode& node, const aiMatrix4x4& world_from_parent, int depth, std::string_view where,
                 Welder& welder, TriangleMesh& mesh)
{
    if (depth > max_nodes_deep) throw broken(where, "has nodes nested deeper than " + std::to_string(max_nodes_deep));
    const aiMatrix4x4 world_from_node = world_from_parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
        if (node.mMeshes[i] >= scene.mNumMeshes) throw broken(where, "has a node with a mesh that is not there");
        append(*scene.mMeshes[node.mMeshes[i]], world_from_node, where, welder, mesh);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i)
        append_tree(scene, *node.mChildren[i], world_from_node, depth + 1, where, welder, mesh);
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

} // namespace

TriangleMesh read_mesh(const std::string& path, std::string_view where)
{
    const Format& format = format_of(path, where);
    std::error_code error;
    if (!std::filesystem::exists(path, error))
        throw Error(ErrorCode::not_found, std::string(where) + ": no such file", "looked for " + path);
    if (!std::filesystem::is_regular_file(path, error)) throw broken(where, "is not a file");

    TriangleMesh mesh;
    try {
        Assimp::Importer importer;
        keep_only(importer, format.loader);
        importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
        const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate | aiProcess_SortByPType);
        if (!scene || !scene->mRootNode || (scene->mFlags & AI_SCENE_FLAGS_INCOMPLETE && scene->mNumMeshes == 0))
            throw broken(where, "cannot be read as a mesh: " + one_line(importer.GetErrorString()));

        Welder welder(mesh);
        std::size_t vertices = 0;
        for (unsigned i = 0; i < scene->mNumMeshes; ++i) vertices += scene->mMeshes[i]->mNumVertices;
        welder.reserve(vertices);
        append_tree(*scene, *scene->mRootNode, aiMatrix4x4(), 0, where, welder, mesh);
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
