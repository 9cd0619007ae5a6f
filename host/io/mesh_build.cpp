#include "io/mesh_build.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "io/polygon.hpp"
#include "scene/cracks.hpp"
#include "scene/weld.hpp"

namespace penumbra {

namespace {

using Triangle = std::array<std::uint32_t, 3>;

// Cracks up to this share of a mesh's diagonal are told of: 128 roundings of a float32 coordinate, while the details of a mesh are larger.
constexpr double crack_share = 0x1p-17;

// Steps of positions beyond this share of a mesh's diagonal are told of: a shadow's edge begins to show them.
constexpr double coarse_share = 0x1p-12;

bool is_finite(const Vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

std::string short_number(double number)
{
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), number, std::chars_format::general, 2).ptr};
}

void place(PolygonSoup& soup, const ObjectPlacement& placement, std::string_view where)
{
    constexpr double largest = std::numeric_limits<float>::max();
    for (Vec3& p : soup.positions) {
        if (!is_finite(p)) throw broken_mesh(where, "has a vertex that is not finite");
        p = placement.placed(p);
        for (int axis = 0; axis < 3; ++axis)
            if (!(std::abs(p[axis]) <= largest))
                throw Error(ErrorCode::invalid_input, std::string(where) + " has positions beyond float32",
                            "the file's own, or scale and translate, are too large");
    }
}

class Builder {
public:
    Builder(const PolygonSoup& soup, std::string_view where) : soup_(soup), where_(where) {}

    TriangleMesh build(double weld)
    {
        join(weld);
        std::size_t first = 0;
        for (std::size_t polygon = 0; polygon < soup_.sizes.size(); ++polygon) {
            add(polygon, first);
            first += soup_.sizes[polygon];
        }
        drop_unused();
        if (!soup_.cut.empty()) {
            cuts_.images = soup_.cuts;
            mesh_.cut_outs = std::make_shared<const CutOuts>(std::move(cuts_));
        }
        return std::move(mesh_);
    }
    std::size_t lines() const { return soup_.lines + lines_; }
    std::size_t joined() const { return joined_; }

private:
    void join(double weld)
    {
        Welder welder(mesh_.positions, soup_.positions.size());
        vertex_.reserve(soup_.positions.size());
        for (const Vec3& p : soup_.positions) vertex_.push_back(welder(Imath::V3f(p)));
        if (!(weld > 0)) return;
        const std::vector<std::uint32_t> kept = joined_within(mesh_.positions, weld);
        for (std::uint32_t i = 0; i < kept.size(); ++i) joined_ += kept[i] != i;
        for (std::uint32_t& vertex : vertex_) vertex = kept[vertex];
    }

    // One polygon, whose corners begin at `first`.
    void add(std::size_t polygon, std::size_t first)
    {
        const std::size_t size = soup_.sizes[polygon];
        if (size < 3) {
            ++lines_;
            return;
        }
        points_.clear();
        for (std::size_t k = 0; k < size; ++k) points_.push_back(soup_.positions[soup_.corners[first + k]]);
        triangles_.clear();
        triangulate(points_, triangles_);
        for (const Triangle& corners : triangles_) add(corners, polygon, first);
        if (mesh_.triangles.size() > max_triangles)
            throw Error(ErrorCode::too_large, std::string(where_) + " has over " + std::to_string(max_triangles) + " triangles");
    }
    void add(const Triangle& corners, std::size_t polygon, std::size_t first)
    {
        Triangle triangle;
        for (std::size_t k = 0; k < 3; ++k) triangle[k] = vertex_[soup_.corners[first + corners[k]]];
        if (is_collapsed(triangle, corners, first)) return;
        mesh_.triangles.push_back(triangle);
        if (soup_.cut.empty()) return;
        cuts_.image.push_back(soup_.cut[polygon]);
        cuts_.texture.push_back({soup_.texture[first + corners[0]], soup_.texture[first + corners[1]], soup_.texture[first + corners[2]]});
    }

    // Whether two corners are one in the file, or were joined. What only float32 makes one stays, for the techniques to warn of.
    bool is_collapsed(const Triangle& triangle, const Triangle& corners, std::size_t first) const
    {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t next = (k + 1) % 3;
            if (triangle[k] != triangle[next]) continue;
            const auto at = [&](std::size_t corner) { return soup_.positions[soup_.corners[first + corners[corner]]]; };
            if (joined_ > 0 || at(k) == at(next)) return true;
        }
        return false;
    }

    // Vertices that no triangle uses (points, lines, collapsed triangles) would count in bounds.
    void drop_unused()
    {
        constexpr std::uint32_t unused = ~0u;
        std::vector<std::uint32_t> renamed(mesh_.positions.size(), unused);
        std::vector<Imath::V3f> positions;
        positions.reserve(mesh_.positions.size());
        for (Triangle& triangle : mesh_.triangles)
            for (std::uint32_t& index : triangle) {
                if (renamed[index] == unused) {
                    renamed[index] = static_cast<std::uint32_t>(positions.size());
                    positions.push_back(mesh_.positions[index]);
                }
                index = renamed[index];
            }
        mesh_.positions = std::move(positions);
    }

    const PolygonSoup& soup_;
    std::string_view where_;
    TriangleMesh mesh_;
    CutOuts cuts_;
    std::vector<std::uint32_t> vertex_; // of each position of the soup
    std::vector<Vec3> points_;
    std::vector<Triangle> triangles_;
    std::size_t lines_ = 0, joined_ = 0;
};

// Positions are float32 from here on: far from the origin their steps become coarse.
void warn_of_steps(const Imath::Box3d& box, const MeshSource& source)
{
    double furthest = 0;
    for (int axis = 0; axis < 3; ++axis) furthest = std::max({furthest, std::abs(box.min[axis]), std::abs(box.max[axis])});
    const double step = std::ldexp(1.0, std::ilogb(furthest) - 23);
    if (step > coarse_share * box.size().length())
        source.warn("lies far from the origin for its size: float32 has steps of " + short_number(step) +
                    " there; translate brings it near");
}

void warn_of_cracks(const TriangleMesh& mesh, const Imath::Box3d& box, const MeshSource& source)
{
    const Cracks cracks = find_cracks(mesh, crack_share * box.size().length());
    if (cracks.vertices == 0) return;
    source.warn("has cracks: " + std::to_string(cracks.vertices) + " vertices of open edges lie within " + short_number(cracks.widest) +
                " of another; \"weld\": " + short_number(1.1 * cracks.widest) + " joins them");
}

} // namespace

TriangleMesh build_mesh(PolygonSoup soup, const ObjectPlacement& placement, double weld, const MeshSource& source)
{
    place(soup, placement, source.where);
    Builder builder(soup, source.where);
    TriangleMesh mesh = builder.build(weld);
    if (mesh.triangles.empty()) throw broken_mesh(source.where, "has no triangles");
    if (builder.lines() > 0) source.warn("has " + std::to_string(builder.lines()) + " points and lines: they cast nothing");
    if (builder.joined() > 0)
        source.warn("has " + std::to_string(builder.joined()) + " vertices that were joined with others within " + short_number(weld) +
                    " (weld)");
    Imath::Box3d box;
    for (const Imath::V3f& p : mesh.positions) box.extendBy(Vec3(p));
    warn_of_steps(box, source);
    warn_of_cracks(mesh, box, source);
    return mesh;
}

} // namespace penumbra
