#include "refine/occluder_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "scene/fine_depth.hpp"
#include "scene/parallel.hpp"

namespace penumbra {
namespace {

constexpr int finest = 128;       // cells a side: larger maps are joined
constexpr int most_cells = 2048;  // that a patch asks about: one that has to ask more counts as not resolved
constexpr float nothing_low = std::numeric_limits<float>::max(), nothing_high = -nothing_low;

} // namespace

// A patch as cells are asked about it. Its plane is level + slope_xi xi + slope_eta eta, in heights.
struct OccluderField::Query {
    double xi_low, xi_high, eta_low, eta_high; // of the patch
    double low, high;                          // its heights
    double level, slope_xi, slope_eta, margin;
    double reach_x, reach_y; // how far a penumbra goes in xi and eta for each height above the receiver
    double rise;             // that heights above the receiver's must have
    int left = most_cells;
    bool casts = false;      // something may
    double plane(double xi, double eta) const { return level + slope_xi * xi + slope_eta * eta; }
};

OccluderField::OccluderField(const LightFrame& light, const Camera& view, std::span<const DepthMap* const> maps, double spare) : light_(light), view_(view), spare_(spare)
{
    const int width = maps.front()->width, height = maps.front()->height;
    const int joined = (std::max(width, height) + finest - 1) / finest;
    Level level{.width = (width + joined - 1) / joined, .height = (height + joined - 1) / joined, .low = {}, .high = {}};
    level.low.assign(static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height), nothing_low);
    level.high.assign(level.low.size(), nothing_high);
    for (const DepthMap* map : maps) precision_ = std::max(precision_, map->precision);
    constexpr int rows_together = 32;
    parallel_for((level.height + rows_together - 1) / rows_together, [&](int group) {
        std::vector<float> near(static_cast<std::size_t>(width)), far(near.size());
        for (int row = group * rows_together; row < std::min(level.height, (group + 1) * rows_together); ++row) add_row(maps, row, joined, near, far, level);
    });
    levels_.push_back(std::move(level));
    while (levels_.back().width > 1 || levels_.back().height > 1) add_level();
}

namespace {

// What the samples of a row's texels show beside their depth; `begin`: the row's first texel.
void add_samples(const FineDepth& fine, std::size_t begin, std::vector<float>& near, std::vector<float>& far)
{
    for (std::size_t x = 0; x < near.size(); ++x) {
        const std::int32_t block = (*fine.blocks)[begin + x];
        if (block < 0) continue;
        for (const float z : std::span(fine.depth).subspan(static_cast<std::size_t>(block) * fine.block_size(), fine.block_size())) {
            if (!(z > 0 && z <= std::numeric_limits<float>::max())) continue;
            near[x] = std::min(near[x], z);
            far[x] = std::max(far[x], z);
        }
    }
}

} // namespace

// A row of cells: first down the columns of every map, then across.
void OccluderField::add_row(std::span<const DepthMap* const> maps, int row, int joined, std::vector<float>& near, std::vector<float>& far, Level& level) const
{
    constexpr float most = std::numeric_limits<float>::max();
    const auto width = static_cast<std::size_t>(maps.front()->width);
    const int height = maps.front()->height;
    std::fill(near.begin(), near.end(), most);
    std::fill(far.begin(), far.end(), 0.f);
    for (const DepthMap* map : maps)
        for (int y = row * joined; y < std::min(height, (row + 1) * joined); ++y) {
            const float* z = map->depth.data() + static_cast<std::size_t>(y) * width;
            for (std::size_t x = 0; x < near.size(); ++x) {
                const bool there = z[x] > 0 && z[x] <= most;
                const float low = there ? z[x] : most, high = there ? z[x] : 0.f;
                near[x] = low < near[x] ? low : near[x];
                far[x] = high > far[x] ? high : far[x];
            }
            if (map->fine) add_samples(*map->fine, static_cast<std::size_t>(y) * width, near, far);
        }
    const std::size_t begin = static_cast<std::size_t>(row) * static_cast<std::size_t>(level.width);
    for (int cell = 0; cell < level.width; ++cell) {
        const std::size_t first = static_cast<std::size_t>(cell) * static_cast<std::size_t>(joined), last = std::min(first + static_cast<std::size_t>(joined), near.size());
        float least = most, greatest = 0;
        for (std::size_t x = first; x < last; ++x) {
            least = near[x] < least ? near[x] : least;
            greatest = far[x] > greatest ? far[x] : greatest;
        }
        if (greatest == 0) continue;
        level.low[begin + static_cast<std::size_t>(cell)] = static_cast<float>(height_of(greatest));
        level.high[begin + static_cast<std::size_t>(cell)] = static_cast<float>(height_of(least));
    }
}

void OccluderField::add_level()
{
    const Level& below = levels_.back();
    Level level{.width = (below.width + 1) / 2, .height = (below.height + 1) / 2, .low = {}, .high = {}};
    level.low.assign(static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height), nothing_low);
    level.high.assign(level.low.size(), nothing_high);
    for (int y = 0; y < below.height; ++y)
        for (int x = 0; x < below.width; ++x) {
            const std::size_t from = static_cast<std::size_t>(y) * static_cast<std::size_t>(below.width) + static_cast<std::size_t>(x);
            const std::size_t to = static_cast<std::size_t>(y / 2) * static_cast<std::size_t>(level.width) + static_cast<std::size_t>(x / 2);
            level.low[to] = std::min(level.low[to], below.low[from]);
            level.high[to] = std::max(level.high[to], below.high[from]);
        }
    levels_.push_back(std::move(level));
}

LightPoint OccluderField::point(const Vec3& world) const
{
    const Vec3 to = world - view_.frame.origin;
    const double x = to.dot(view_.frame.x), y = to.dot(view_.frame.y), z = -to.dot(view_.frame.z);
    const double spread = view_.orthographic ? 1 : z;
    return {x, y, z, x / (spread * view_.half_extent.x), y / (spread * view_.half_extent.y)};
}

Passing OccluderField::passing(const ReceiverPatch& patch, double share) const
{
    const auto& c = patch.corners;
    Query query{};
    query.xi_low = query.eta_low = query.low = std::numeric_limits<double>::max();
    query.xi_high = query.eta_high = query.high = -query.xi_low;
    double z_low = query.xi_low, up[4];
    for (int i = 0; i < 4; ++i) {
        if (!(c[i].z > 0)) return Passing::much;
        up[i] = height_of(c[i].z);
        query.xi_low = std::min(query.xi_low, c[i].xi);
        query.xi_high = std::max(query.xi_high, c[i].xi);
        query.eta_low = std::min(query.eta_low, c[i].eta);
        query.eta_high = std::max(query.eta_high, c[i].eta);
        query.low = std::min(query.low, up[i]);
        query.high = std::max(query.high, up[i]);
        z_low = std::min(z_low, c[i].z);
    }

    const double ax = c[1].xi - c[0].xi, ay = c[1].eta - c[0].eta, bx = c[2].xi - c[0].xi, by = c[2].eta - c[0].eta;
    const double area = ax * by - ay * bx;
    if (!(std::abs(area) > 1e-6 * (ax * ax + ay * ay + bx * bx + by * by))) return Passing::much; // edge-on to the light
    query.slope_xi = ((up[1] - up[0]) * by - (up[2] - up[0]) * ay) / area;
    query.slope_eta = ((up[2] - up[0]) * ax - (up[1] - up[0]) * bx) / area;
    query.level = up[0] - query.slope_xi * c[0].xi - query.slope_eta * c[0].eta;
    const double off = view_.orthographic ? patch.off : patch.off / (z_low * z_low);
    const double size = std::max(std::abs(query.low), std::abs(query.high));
    query.margin = off + std::abs(query.plane(c[3].xi, c[3].eta) - up[3]) + (4 * precision_ + 1e-6) * size;

    // Back-projections move by (step + tangent x step_z) z_o / (z_p - z_o) on the light.
    double lateral_x = 0, lateral_y = 0;
    for (const LightPoint& p : c) {
        lateral_x = std::max(lateral_x, view_.orthographic ? 0 : std::abs(p.xi) * view_.half_extent.x);
        lateral_y = std::max(lateral_y, view_.orthographic ? 0 : std::abs(p.eta) * view_.half_extent.y);
    }
    const double tangent_u = view_.orthographic ? light_.half_u : light_.half_u / z_low, tangent_v = view_.orthographic ? light_.half_v : light_.half_v / z_low;
    const double moved_x = patch.step_x + (lateral_x + tangent_u) * patch.step_z, moved_y = patch.step_y + (lateral_y + tangent_v) * patch.step_z;
    const double per = view_.orthographic ? 1 : query.high;
    query.rise = std::max(moved_x / light_.half_u, moved_y / light_.half_v) * per / (2 * share);
    query.reach_x = light_.half_u / view_.half_extent.x;
    query.reach_y = light_.half_v / view_.half_extent.y;
    if (!cell_resolved(query, levels_.size() - 1, 0, 0)) return Passing::much;
    return query.casts || !shows_all(query) ? Passing::little : Passing::nothing;
}

// Whether the light's whole window, from any of the patch's receivers on what is nearest to the light, lies on the maps.
bool OccluderField::shows_all(const Query& query) const
{
    const double rise = levels_.back().high.front() - query.low;
    if (!(rise > 0)) return true;
    const double reach_x = rise * query.reach_x, reach_y = rise * query.reach_y;
    return query.xi_low - reach_x >= -1 && query.xi_high + reach_x <= 1 && query.eta_low - reach_y >= -1 && query.eta_high + reach_y <= 1;
}

bool OccluderField::all_above(const Vec3& world, const Vec3& normal, double turned) const
{
    // Towards a directional light's middle, to where its disc has the extents that it is given by: tangents.
    const Vec3 to = light_.directional ? -light_.direction : light_.origin - world;
    // Of a sphere what reaches towards the receivers as well.
    const double reach = light_.half_u * std::abs(normal.dot(light_.u)) + light_.half_v * std::abs(normal.dot(light_.v)) +
                         std::max(light_.half_u, light_.half_v) * std::abs(normal.dot(light_.direction));
    return normal.dot(to) > reach + turned * (to.length() + light_.half_u + light_.half_v);
}

bool OccluderField::cell_resolved(Query& query, std::size_t level, int x, int y) const
{
    const Level& cells = levels_[level];
    const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(cells.width) + static_cast<std::size_t>(x);
    const double low = cells.low[at], high = cells.high[at];
    if (query.left-- <= 0) return false;
    if (!(high > query.low)) return true; // nothing, or behind every receiver

    // In the light's view a cell of the finest level has this size; the last ones may be cut off, which is no matter.
    const double side_x = 2.0 / levels_.front().width, side_y = 2.0 / levels_.front().height, cell = std::ldexp(1.0, static_cast<int>(level));
    const double left = x * cell * side_x - 1, right = left + cell * side_x, top = 1 - y * cell * side_y, bottom = top - cell * side_y;
    const double reach_x = (high - query.low) * query.reach_x, reach_y = (high - query.low) * query.reach_y;
    const auto beside = [&](double x_spare, double y_spare) {
        return left - reach_x - x_spare > query.xi_high || right + reach_x + x_spare < query.xi_low || bottom - reach_y - y_spare > query.eta_high || top + reach_y + y_spare < query.eta_low;
    };
    if (beside((1 + spare_) * side_x, (1 + spare_) * side_y)) return true;

    const double middle = query.plane(0.5 * (left + right), 0.5 * (top + bottom));
    const double half = 0.5 * (std::abs(query.slope_xi) * (right - left) + std::abs(query.slope_eta) * (top - bottom));
    const double plane_high = middle + half + query.margin, plane_low = middle - half - query.margin;
    if (high <= (level == 0 ? plane_high : plane_low)) return true; // the patch's own surface, or below it
    if (level == 0) query.casts = true;
    if (low > plane_high && low >= query.high + query.rise) {
        query.casts = true;
        return true;
    }
    if (level == 0) return beside(spare_ * side_x, spare_ * side_y);
    const Level& below = levels_[level - 1];
    for (int j = 2 * y; j < std::min(2 * y + 2, below.height); ++j)
        for (int i = 2 * x; i < std::min(2 * x + 2, below.width); ++i)
            if (!cell_resolved(query, level - 1, i, j)) return false;
    return true;
}

} // namespace penumbra
