// What casts, as far as interpolating between receivers must know it: where in the light's view something lies, and between which depths.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <penumbra/scene.hpp>

#include "scene/light_space.hpp"

namespace penumbra {

// A receiver in light space, scene units, and where the light's view shows it, -1 to 1.
struct LightPoint {
    double x = 0, y = 0, z = 0;
    double xi = 0, eta = 0;
};

// Receivers close together on one surface.
struct ReceiverPatch {
    std::array<LightPoint, 4> corners{};       // two of one row, then two of another
    double off = 0;                            // how far the surface may lie from the plane through them, scene units
    double step_x = 0, step_y = 0, step_z = 0; // from one shaded receiver to the next along light space's axes, at the most, scene units
};

// What passes between a patch's shaded receivers.
enum class Passing : std::uint8_t {
    nothing, // casts on the patch at all
    little,  // what casts moves little from one shaded receiver to the next
    much,
};

class OccluderField {
public:
    // maps: planar depth in `view`, the light's own, all of one size. A texel is full from its least depth to its greatest.
    // spare: how many cells what casts may reach beyond those that show it: 1 where the maps are samples of it, 0 where their texels are what casts.
    OccluderField(const LightFrame& light, const Camera& view, std::span<const DepthMap* const> maps, double spare = 0);

    // `little`: the penumbra of everything that casts on the patch is at least 1 / `share` steps wide: from one shaded receiver to the next the
    // back-projection of what casts moves by at most that share of the light, so that nothing passes unseen between the two.
    // `nothing`: nothing that the maps show stands between the patch and any part of the light, with a cell to spare, and the maps show all that might.
    Passing passing(const ReceiverPatch& patch, double share) const;

    // Whether all of the light lies above the plane of a surface there, and above those whose normals, of unit length, turn from this one by up to `turned`.
    bool all_above(const Vec3& world, const Vec3& normal, double turned) const;

    LightPoint point(const Vec3& world) const;

private:
    // Heights grow towards the light and are linear over a plane's image: 1 / z, orthographic -z.
    struct Level {
        int width = 0, height = 0;
        std::vector<float> low, high; // least and greatest in a cell; none: low > high
    };
    struct Query;
    double height_of(double z) const { return view_.orthographic ? -z : 1 / z; }
    bool cell_resolved(Query& query, std::size_t level, int x, int y) const;
    bool shows_all(const Query& query) const;
    void add_row(std::span<const DepthMap* const> maps, int row, int joined, std::vector<float>& near, std::vector<float>& far, Level& level) const;
    void add_level();

    LightFrame light_;
    Camera view_;
    double spare_ = 0, precision_ = 0;
    std::vector<Level> levels_; // the finest first, the last of one cell
};

} // namespace penumbra
