#include "io/gltf_nodes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Imath/ImathQuat.h>

#include "io/gltf_accessor.hpp"

namespace penumbra {

namespace {

using Imath::M44d;

// What is empty is the default.
M44d from_trs(std::span<const double> translation, std::span<const double> rotation, std::span<const double> scale)
{
    M44d place;
    if (!scale.empty()) place.setScale(Vec3(scale[0], scale[1], scale[2]));
    if (!rotation.empty()) place *= Imath::Quatd(rotation[3], rotation[0], rotation[1], rotation[2]).normalized().toMatrix44();
    if (!translation.empty()) place *= M44d().setTranslation(Vec3(translation[0], translation[1], translation[2]));
    return place;
}

void require_size(const GltfFile& file, const std::vector<double>& numbers, std::size_t size, int node, const char* key)
{
    if (numbers.empty() || numbers.size() == size) return;
    throw file.broken("has nodes[" + std::to_string(node) + "]." + key + " of " + std::to_string(numbers.size()) + " numbers, expected " +
                      std::to_string(size));
}

// Columns of column vectors are rows of row vectors: the sixteen numbers stay in order.
M44d local_place(const GltfFile& file, int index)
{
    const tinygltf::Node& node = file.model.nodes[static_cast<std::size_t>(index)];
    require_size(file, node.matrix, 16, index, "matrix");
    require_size(file, node.translation, 3, index, "translation");
    require_size(file, node.rotation, 4, index, "rotation");
    require_size(file, node.scale, 3, index, "scale");
    if (node.matrix.empty()) return from_trs(node.translation, node.rotation, node.scale);
    M44d place;
    std::copy_n(node.matrix.begin(), 16, place.getValue());
    return place;
}

bool is_visible(const tinygltf::Node& node)
{
    const auto found = node.extensions.find("KHR_node_visibility");
    if (found == node.extensions.end() || !found->second.IsObject() || !found->second.Has("visible")) return true;
    const tinygltf::Value& visible = found->second.Get("visible");
    return !visible.IsBool() || visible.Get<bool>();
}

// Each node's parent, -1 without one.
std::vector<int> parents_of(const GltfFile& file)
{
    std::vector<int> parents(file.model.nodes.size(), -1);
    for (std::size_t i = 0; i < parents.size(); ++i)
        for (const int child : file.model.nodes[i].children) {
            int& parent = file.entry(parents, child, "nodes");
            if (parent >= 0) throw file.broken("has nodes[" + std::to_string(child) + "] under two parents");
            parent = static_cast<int>(i);
        }
    return parents;
}

// Parents before their children. What is left out hangs under itself.
std::vector<int> in_order(const GltfFile& file, std::vector<int> roots)
{
    for (std::size_t i = 0; i < roots.size(); ++i) {
        const std::vector<int>& children = file.model.nodes[static_cast<std::size_t>(roots[i])].children;
        roots.insert(roots.end(), children.begin(), children.end());
    }
    return roots;
}

// The nodes of the default scene: `scene`, else the first; without any scene all nodes.
std::vector<int> scene_roots(const GltfFile& file, const std::vector<int>& parents)
{
    const tinygltf::Model& model = file.model;
    if (model.scenes.empty() && model.defaultScene < 0) {
        std::vector<int> roots;
        for (std::size_t i = 0; i < parents.size(); ++i)
            if (parents[i] < 0) roots.push_back(static_cast<int>(i));
        return roots;
    }
    const std::vector<int>& listed = file.entry(model.scenes, std::max(model.defaultScene, 0), "scenes").nodes;
    std::vector<bool> seen(parents.size());
    for (const int root : listed) {
        if (file.entry(parents, root, "nodes") >= 0)
            throw file.broken("has a scene with nodes[" + std::to_string(root) + "], which has a parent");
        if (seen[static_cast<std::size_t>(root)]) throw file.broken("has a scene with nodes[" + std::to_string(root) + "] twice");
        seen[static_cast<std::size_t>(root)] = true;
    }
    return listed;
}

// An attribute of the instances: `width` numbers each, all of one count; empty without it.
std::vector<double> instance_numbers(const GltfFile& file, const tinygltf::Value& attributes, const char* name, int width,
                                     std::size_t& count)
{
    if (!attributes.Has(name)) return {};
    const tinygltf::Value& index = attributes.Get(name);
    if (!index.IsInt()) throw file.broken(std::string("has instances whose ") + name + " is no accessor");
    std::vector<double> numbers = read_numbers(file, index.Get<int>(), width);
    const std::size_t own = numbers.size() / static_cast<std::size_t>(width);
    if (count != 0 && count != own)
        throw file.broken("has instances of " + std::to_string(count) + " and " + std::to_string(own) + " places");
    count = own;
    return numbers;
}

} // namespace

GltfNodes read_nodes(const GltfFile& file)
{
    const std::vector<int> parents = parents_of(file);
    std::vector<int> roots;
    for (std::size_t i = 0; i < parents.size(); ++i)
        if (parents[i] < 0) roots.push_back(static_cast<int>(i));
    const std::vector<int> all = in_order(file, roots);
    if (all.size() != parents.size()) throw file.broken("has nodes that are their own ancestors");

    GltfNodes nodes;
    nodes.world.resize(parents.size());
    std::vector<bool> visible(parents.size());
    for (const int i : all) {
        const auto node = static_cast<std::size_t>(i);
        const int parent = parents[node];
        nodes.world[node] = local_place(file, i);
        visible[node] = is_visible(file.model.nodes[node]);
        if (parent < 0) continue;
        nodes.world[node] *= nodes.world[static_cast<std::size_t>(parent)];
        visible[node] = visible[node] && visible[static_cast<std::size_t>(parent)];
    }
    for (const int i : in_order(file, scene_roots(file, parents)))
        if (visible[static_cast<std::size_t>(i)]) nodes.shown.push_back(i);
    return nodes;
}

std::vector<M44d> places_of(const GltfFile& file, int index, const M44d& world)
{
    const tinygltf::Node& node = file.model.nodes[static_cast<std::size_t>(index)];
    const auto found = node.extensions.find("EXT_mesh_gpu_instancing");
    if (found == node.extensions.end()) return {world};
    const bool sound = found->second.IsObject() && found->second.Has("attributes") && found->second.Get("attributes").IsObject();
    if (!sound) throw file.broken("has EXT_mesh_gpu_instancing without attributes");
    const tinygltf::Value& attributes = found->second.Get("attributes");

    std::size_t count = 0;
    const std::vector<double> translation = instance_numbers(file, attributes, "TRANSLATION", 3, count);
    const std::vector<double> rotation = instance_numbers(file, attributes, "ROTATION", 4, count);
    const std::vector<double> scale = instance_numbers(file, attributes, "SCALE", 3, count);
    const auto part = [](const std::vector<double>& numbers, std::size_t i, std::size_t width) {
        return numbers.empty() ? std::span<const double>() : std::span(numbers).subspan(i * width, width);
    };
    std::vector<M44d> places;
    places.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
        places.push_back(from_trs(part(translation, i, 3), part(rotation, i, 4), part(scale, i, 3)) * world);
    return places;
}

} // namespace penumbra
