#include "io/gltf_skin.hpp"

#include <algorithm>

#include "io/gltf_accessor.hpp"

namespace penumbra {

namespace {

using Imath::M44d;

// From where a mesh was bound to where the joints are.
std::vector<M44d> joint_places(const GltfFile& file, const tinygltf::Skin& skin, const GltfNodes& nodes)
{
    std::vector<double> bind;
    if (skin.inverseBindMatrices >= 0) bind = read_numbers(file, skin.inverseBindMatrices, 16);
    if (!bind.empty() && bind.size() < 16 * skin.joints.size())
        throw file.broken("has a skin of " + std::to_string(skin.joints.size()) + " joints with " + std::to_string(bind.size() / 16) +
                          " matrices");
    std::vector<M44d> places;
    for (std::size_t i = 0; i < skin.joints.size(); ++i) {
        M44d place;
        if (!bind.empty()) std::copy_n(bind.begin() + static_cast<std::ptrdiff_t>(16 * i), 16, place.getValue());
        places.push_back(place * file.entry(nodes.world, skin.joints[i], "nodes"));
    }
    return places;
}

int set_of(const tinygltf::Primitive& primitive, const char* name, int set)
{
    const auto found = primitive.attributes.find(name + std::to_string(set));
    return found == primitive.attributes.end() ? -1 : found->second;
}

} // namespace

std::vector<M44d> skin_places(const GltfFile& file, const tinygltf::Primitive& primitive, int skin, const GltfNodes& nodes,
                              std::size_t vertices)
{
    const std::vector<M44d> joints = joint_places(file, file.entry(file.model.skins, skin, "skins"), nodes);
    std::vector<M44d> places(vertices, M44d(0.0)); // all sixteen numbers
    std::vector<double> sums(vertices);
    for (int set = 0; set_of(primitive, "JOINTS_", set) >= 0; ++set) {
        const std::vector<double> joint = read_numbers(file, set_of(primitive, "JOINTS_", set), 4);
        const std::vector<double> weight = read_numbers(file, set_of(primitive, "WEIGHTS_", set), 4);
        if (joint.size() != 4 * vertices || weight.size() != joint.size())
            throw file.broken("has a skin for " + std::to_string(joint.size() / 4) + " of " + std::to_string(vertices) + " vertices");
        for (std::size_t i = 0; i < joint.size(); ++i) {
            if (weight[i] == 0) continue;
            places[i / 4] += file.entry(joints, static_cast<std::int64_t>(joint[i]), "joints") * weight[i];
            sums[i / 4] += weight[i];
        }
    }
    // Weights are rounded: they count by their share.
    for (std::size_t i = 0; i < vertices; ++i) {
        if (!(sums[i] > 0)) throw file.broken("has a vertex of a skin without weights");
        places[i] *= 1 / sums[i];
    }
    return places;
}

} // namespace penumbra
