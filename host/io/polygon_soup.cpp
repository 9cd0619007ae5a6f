#include "io/polygon_soup.hpp"

#include <algorithm>

namespace penumbra {

void PolygonSoup::add(std::span<const std::uint32_t> polygon)
{
    corners.insert(corners.end(), polygon.begin(), polygon.end());
    sizes.push_back(static_cast<std::uint32_t>(polygon.size()));
    if (cut.empty()) return;
    cut.push_back(not_cut);
    texture.resize(corners.size());
}

void PolygonSoup::add(std::span<const std::uint32_t> polygon, std::uint32_t cut_of, std::span<const Imath::V2f> texture_of)
{
    add(polygon);
    if (cut_of == not_cut) return;
    // The first that is cut: those before are not.
    if (cut.empty()) {
        cut.assign(sizes.size(), not_cut);
        texture.resize(corners.size());
    }
    cut.back() = cut_of;
    std::ranges::copy(texture_of, texture.end() - static_cast<std::ptrdiff_t>(polygon.size()));
}

void MeshSource::warn(const std::string& what) const
{
    if (warnings) warnings->push_back(std::string(where) + " " + what);
}

Bytes MeshSource::open(const std::string& name) const
{
    if (!companion) throw Error(ErrorCode::not_found, std::string(where) + " names another file, " + in_quotes(name) + ", and has none");
    try {
        return companion(name);
    } catch (const Error& error) {
        if (error.code() != ErrorCode::not_found) throw;
        throw Error(ErrorCode::not_found, std::string(where) + " names " + in_quotes(name) + ": " + error.message(), error.hint());
    }
}

Error broken_mesh(std::string_view where, const std::string& what) { return {ErrorCode::invalid_input, std::string(where) + " " + what}; }

void require_room(const PolygonSoup& soup, std::size_t vertices, std::size_t triangles, std::size_t times, std::string_view where)
{
    const auto fits = [&](std::size_t there, std::size_t more) {
        return there <= max_triangles && (more == 0 || times <= (max_triangles - there) / more);
    };
    if (fits(soup.positions.size(), vertices) && fits(soup.corners.size() / 3, triangles)) return;
    throw Error(ErrorCode::too_large, std::string(where) + " has over " + std::to_string(max_triangles) + " triangles or vertices");
}

} // namespace penumbra
