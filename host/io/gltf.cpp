#include "io/gltf.hpp"

#include <array>

#include "io/gltf_accessor.hpp"
#include "io/gltf_material.hpp"
#include "io/gltf_nodes.hpp"
#include "io/gltf_primitive.hpp"
#include "io/gltf_skin.hpp"

namespace penumbra {

namespace {

using Imath::M44d;

bool mirrors(const M44d& place)
{
    const Vec3 x(place[0][0], place[0][1], place[0][2]), y(place[1][0], place[1][1], place[1][2]), z(place[2][0], place[2][1], place[2][2]);
    return x.cross(y).dot(z) < 0;
}

// Without a division: the fourth column of a place is (0, 0, 0, 1).
Vec3 placed(const Vec3& p, const M44d& m)
{
    return {p.x * m[0][0] + p.y * m[1][0] + p.z * m[2][0] + m[3][0], p.x * m[0][1] + p.y * m[1][1] + p.z * m[2][1] + m[3][1],
            p.x * m[0][2] + p.y * m[1][2] + p.z * m[2][2] + m[3][2]};
}

class Reader {
public:
    explicit Reader(const GltfFile& file) : file_(file), nodes_(read_nodes(file)), materials_(file, soup_) {}

    PolygonSoup read()
    {
        for (const int node : nodes_.shown)
            if (file_.model.nodes[static_cast<std::size_t>(node)].mesh >= 0) read_node(node);
        if (materials_.blended() > 0)
            file_.source.warn("has " + std::to_string(materials_.blended()) +
                              " primitives that are blended (alphaMode BLEND): they cast as a whole");
        return std::move(soup_);
    }

private:
    void read_node(int index)
    {
        const tinygltf::Node& node = file_.model.nodes[static_cast<std::size_t>(index)];
        const tinygltf::Mesh& mesh = file_.entry(file_.model.meshes, node.mesh, "meshes");
        const std::vector<M44d> places = places_of(file_, index, nodes_.world[static_cast<std::size_t>(index)]);
        for (const tinygltf::Primitive& primitive : mesh.primitives) {
            GltfPrimitive part = read_primitive(file_, primitive, node.weights.empty() ? mesh.weights : node.weights);
            soup_.lines += part.lines;
            if (part.triangles.empty() || !materials_.cut(primitive, part)) continue;
            require_room(soup_, part.positions.size(), part.triangles.size(), places.size(), file_.source.where);
            // A skinned mesh stands where its joints are, wherever its node is.
            if (node.skin >= 0)
                add_skinned(part, skin_places(file_, primitive, node.skin, nodes_, part.positions.size()));
            else
                for (const M44d& place : places) add(part, place);
        }
    }

    void add(const GltfPrimitive& part, const M44d& place)
    {
        const auto first = static_cast<std::uint32_t>(soup_.positions.size());
        for (const Vec3& p : part.positions) soup_.positions.push_back(placed(p, place));
        const bool mirrored = mirrors(place);
        for (const auto& triangle : part.triangles) add(part, triangle, first, mirrored);
    }
    void add_skinned(const GltfPrimitive& part, const std::vector<M44d>& places)
    {
        const auto first = static_cast<std::uint32_t>(soup_.positions.size());
        for (std::size_t i = 0; i < places.size(); ++i) soup_.positions.push_back(placed(part.positions[i], places[i]));
        for (const auto& triangle : part.triangles) add(part, triangle, first, mirrors(places[triangle[0]]));
    }
    void add(const GltfPrimitive& part, std::array<std::uint32_t, 3> triangle, std::uint32_t first, bool mirrored)
    {
        if (mirrored) std::swap(triangle[1], triangle[2]);
        std::array<Imath::V2f, 3> texture{};
        for (std::size_t k = 0; k < 3; ++k) {
            if (part.cut != not_cut) texture[k] = part.texture[triangle[k]];
            triangle[k] += first;
        }
        soup_.add(triangle, part.cut, texture);
    }

    const GltfFile& file_;
    GltfNodes nodes_;
    PolygonSoup soup_;
    GltfMaterials materials_;
};

} // namespace

PolygonSoup decode_gltf(std::span<const std::byte> bytes, const MeshSource& source)
{
    const GltfFile file = open_gltf(bytes, source);
    return Reader(file).read();
}

} // namespace penumbra
