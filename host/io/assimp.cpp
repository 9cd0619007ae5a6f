#include "io/assimp.hpp"

#include <algorithm>

#include <assimp/BaseImporter.h>
#include <assimp/Importer.hpp>
#include <assimp/importerdesc.h>
#include <assimp/scene.h>

#include "io/words.hpp"

namespace penumbra {

namespace {

// Deeper node trees are broken files (or loops).
constexpr int max_nodes_deep = 1000;

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

void append(const aiMesh& source, const aiMatrix4x4& world_from_mesh, std::string_view where, PolygonSoup& soup)
{
    const bool mirrored = world_from_mesh.Determinant() < 0;
    const auto first = static_cast<std::uint32_t>(soup.positions.size());
    require_room(soup, source.mNumVertices, source.mNumFaces, 1, where);
    for (unsigned i = 0; i < source.mNumVertices; ++i) {
        const aiVector3D p = world_from_mesh * source.mVertices[i];
        soup.positions.emplace_back(p.x, p.y, p.z);
    }
    std::vector<std::uint32_t> corners;
    for (unsigned f = 0; f < source.mNumFaces; ++f) {
        const aiFace& face = source.mFaces[f];
        corners.clear();
        for (unsigned k = 0; k < face.mNumIndices; ++k) {
            if (face.mIndices[k] >= source.mNumVertices)
                throw broken_mesh(where, "has a face with vertex " + std::to_string(face.mIndices[k]) + " of " +
                                             std::to_string(source.mNumVertices));
            corners.push_back(first + face.mIndices[k]);
        }
        if (mirrored) std::ranges::reverse(corners);
        soup.add(corners);
    }
}

void append_tree(const aiScene& scene, const aiNode& node, const aiMatrix4x4& world_from_parent, int depth, std::string_view where,
                 PolygonSoup& soup)
{
    if (depth > max_nodes_deep) throw broken_mesh(where, "has nodes nested deeper than " + std::to_string(max_nodes_deep));
    const aiMatrix4x4 world_from_node = world_from_parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
        if (node.mMeshes[i] >= scene.mNumMeshes) throw broken_mesh(where, "has a node with a mesh that is not there");
        append(*scene.mMeshes[node.mMeshes[i]], world_from_node, where, soup);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) append_tree(scene, *node.mChildren[i], world_from_node, depth + 1, where, soup);
}

} // namespace

// No post-processing: its triangulation aborts the process on broken polygons.
PolygonSoup read_3ds(const std::string& path, std::string_view where)
{
    Assimp::Importer importer;
    keep_only(importer, "Discreet 3DS Importer");
    const aiScene* scene = importer.ReadFile(path, 0);
    if (!scene) throw broken_mesh(where, "cannot be read as a mesh: " + one_line(importer.GetErrorString()));
    if (!scene->mRootNode) throw broken_mesh(where, "has no triangles");
    PolygonSoup soup;
    append_tree(*scene, *scene->mRootNode, aiMatrix4x4(), 0, where, soup);
    return soup;
}

} // namespace penumbra
