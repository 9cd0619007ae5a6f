#include "io/gltf_primitive.hpp"

#include <algorithm>
#include <numeric>

#include "io/gltf_accessor.hpp"

namespace penumbra {

namespace {

int attribute(const std::map<std::string, int>& attributes, const char* name)
{
    const auto found = attributes.find(name);
    return found == attributes.end() ? -1 : found->second;
}

std::vector<Vec3> read_points(const GltfFile& file, int accessor)
{
    const std::vector<double> numbers = read_numbers(file, accessor, 3);
    std::vector<Vec3> points(numbers.size() / 3);
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
    return points;
}

void add_targets(const GltfFile& file, const tinygltf::Primitive& primitive, const std::vector<double>& weights,
                 std::vector<Vec3>& positions)
{
    for (std::size_t t = 0; t < std::min(primitive.targets.size(), weights.size()); ++t) {
        const int accessor = attribute(primitive.targets[t], "POSITION");
        if (accessor < 0 || weights[t] == 0) continue;
        const std::vector<Vec3> moves = read_points(file, accessor);
        if (moves.size() != positions.size())
            throw file.broken("has a morph target of " + std::to_string(moves.size()) + " vertices for " +
                              std::to_string(positions.size()));
        for (std::size_t i = 0; i < moves.size(); ++i) positions[i] += moves[i] * weights[t];
    }
}

} // namespace

std::vector<std::array<std::uint32_t, 3>> triangles_of(const std::vector<std::uint32_t>& indices, int mode)
{
    std::vector<std::array<std::uint32_t, 3>> triangles;
    const std::size_t count = indices.size();
    if (mode == TINYGLTF_MODE_TRIANGLES)
        for (std::size_t i = 0; i + 2 < count; i += 3) triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    // Every other triangle of a strip turns the other way.
    if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
        for (std::size_t i = 0; i + 2 < count; ++i) triangles.push_back({indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]});
    if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
        for (std::size_t i = 1; i + 1 < count; ++i) triangles.push_back({indices[i], indices[i + 1], indices[0]});
    return triangles;
}

GltfPrimitive read_primitive(const GltfFile& file, const tinygltf::Primitive& primitive, const std::vector<double>& weights)
{
    GltfPrimitive part;
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    if (mode > TINYGLTF_MODE_TRIANGLE_FAN) throw file.broken("has a primitive of the unknown mode " + std::to_string(mode));
    if (mode < TINYGLTF_MODE_TRIANGLES) {
        part.lines = 1;
        return part;
    }
    // A primitive without positions says nothing of where it is: extensions may.
    const int accessor = attribute(primitive.attributes, "POSITION");
    if (accessor < 0) throw file.broken("has a primitive without POSITION");
    part.positions = read_points(file, accessor);
    add_targets(file, primitive, weights, part.positions);

    std::vector<std::uint32_t> indices;
    if (primitive.indices >= 0) {
        indices = read_indices(file, primitive.indices);
    } else {
        indices.resize(part.positions.size());
        std::iota(indices.begin(), indices.end(), 0u);
    }
    for (const std::uint32_t index : indices)
        if (index >= part.positions.size())
            throw file.broken("has a face with vertex " + std::to_string(index) + " of " + std::to_string(part.positions.size()));
    part.triangles = triangles_of(indices, mode);
    return part;
}

} // namespace penumbra
