// What the readers of mesh files have in common: their polygons as they stand in the file, in double precision.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/error.hpp>
#include <penumbra/scene.hpp>
#include <penumbra/scene_file.hpp>

namespace penumbra {

// Of a mesh file: 64 Mi triangles, and as many vertices.
constexpr std::size_t max_triangles = std::size_t{64} << 20;

constexpr std::uint32_t not_cut = std::numeric_limits<std::uint32_t>::max();

struct PolygonSoup {
    std::vector<Vec3> positions;
    std::vector<std::uint32_t> corners; // of all polygons, one after the other
    std::vector<std::uint32_t> sizes;   // corners of each polygon
    std::size_t lines = 0;              // points and lines that were left out

    // What is cut out; the first two are empty when nothing is.
    std::vector<std::uint32_t> cut;  // of each polygon: one of `cuts`, or not_cut
    std::vector<Imath::V2f> texture; // of each corner: (0, 0) is the image's top left corner, (1, 1) the bottom right one
    std::vector<CutOut> cuts;

    void add(std::span<const std::uint32_t> polygon);
    void add(std::span<const std::uint32_t> polygon, std::uint32_t cut_of, std::span<const Imath::V2f> texture_of);
};

// What a reader may ask for beside the file's own bytes.
struct MeshSource {
    std::string_view where; // starts every message
    // The bytes of another file that this one names, relative to it. Throws not_found.
    std::function<Bytes(const std::string& name)> companion;
    std::uint64_t max_samples = std::uint64_t{1} << 30; // of an image
    std::vector<std::string>* warnings = nullptr;

    void warn(const std::string& what) const;
    // The companion's bytes. Throws not_found naming both files.
    Bytes open(const std::string& name) const;
};

// The error that the file is broken: "box.ply has a face ...".
Error broken_mesh(std::string_view where, const std::string& what);

// Throws too_large unless so many more vertices and triangles, each so many times, leave no more than max_triangles of either.
void require_room(const PolygonSoup& soup, std::size_t vertices, std::size_t triangles, std::size_t times, std::string_view where);

} // namespace penumbra
