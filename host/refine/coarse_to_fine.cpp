#include "refine/coarse_to_fine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "depth_image/depth_image.hpp"
#include "scene/camera.hpp"
#include "scene/parallel.hpp"

namespace penumbra {
namespace {

constexpr int coarsest = 32;         // pixels along a block's side
constexpr double flat = 0.25;        // pixels that a block's surface may leave its corners' bilinear
constexpr float turned = 0.15f;      // how far its normals may turn, in radians
// What is allowed so that no pixel is off by more than the tolerance: of the tolerance, between a middle and what the corners say; of the light, for so much
// tolerance, what casts may pass from one shaded receiver to the next. Visibility bends where a silhouette enters the light or leaves it, and where a corner
// does, anywhere between two shaded receivers; what lies between them is then off by up to a fifth of what passes. Thin things are seen as long as their
// penumbrae are four steps wide. Both shares are measured (docs/tolerance.md).
constexpr float middle_per_tolerance = 1.f / 6;
constexpr double passed_per_tolerance = 10. / 3, most_passed = 0.25;
constexpr std::size_t many_blocks = 8, many_kept = 128; // that a thread takes at once
constexpr std::size_t few_groups = 4; // threads take longer to start than these

// A block of receivers, its last column and row included: neighbours share theirs.
struct Block {
    std::int32_t x0, y0, x1, y1;
    std::int32_t middle_x() const { return (x0 + x1) / 2; }
    std::int32_t middle_y() const { return (y0 + y1) / 2; }
    bool whole() const { return x1 - x0 <= 2 && y1 - y0 <= 2; } // the nine are all its pixels
};

// What a block is before anything of it is shaded.
enum class BlockKind : std::uint8_t { lit, divided, asked }; // lit, or empty

class Shading {
public:
    Shading(const ReceiverImage& receivers, int channels, const Coarse& coarse, const OccluderField& field, const ShadePixels& shade)
        : receivers_(receivers), channels_(static_cast<std::size_t>(channels)), middle_off_(middle_per_tolerance * static_cast<float>(coarse.tolerance)), passed_(std::min(passed_per_tolerance * coarse.tolerance, most_passed)),
          proves_lit_(coarse.proves_lit && !receivers.normals.empty()),
          field_(field), shade_(shade)
    {
        const std::size_t count = static_cast<std::size_t>(receivers.width) * static_cast<std::size_t>(receivers.height);
        result_.visibility.assign(count * channels_, 1.f);
        known_.assign(count, 0);
        if (!receivers.points.empty()) {
            lifted_.resize(count);
            for (std::size_t i = 0; i < count; ++i) lifted_[i] = receivers.points[i].z;
        }
        depth_ = receivers.points.empty() ? receivers.depth : std::span<const float>(lifted_);
        pixel_ = 2 * std::max(receivers.camera.half_extent.x / receivers.width, receivers.camera.half_extent.y / receivers.height);
    }

    CoarseToFine run()
    {
        std::vector<Block> blocks = roots(), kept;
        while (!blocks.empty()) {
            const std::vector<Block> asked = asked_of(blocks);
            ask(asked);
            blocks.clear();
            for (const Block& block : asked) {
                if (block.whole()) continue;
                if (told(block)) {
                    kept.push_back(block);
                } else {
                    const Parts parts = parts_of(block);
                    blocks.insert(blocks.end(), parts.blocks.begin(), parts.blocks.begin() + parts.count);
                }
            }
        }
        parallel_for(static_cast<int>((kept.size() + many_kept - 1) / many_kept), [&](int group) {
            const std::size_t begin = static_cast<std::size_t>(group) * many_kept;
            for (std::size_t i = begin; i < std::min(kept.size(), begin + many_kept); ++i) interpolate(kept[i]);
        });
        std::uint32_t count = 0;
        for (const float z : depth_) count += there(z);
        result_.receivers = count;
        return std::move(result_);
    }

private:
    std::size_t at(int x, int y) const { return static_cast<std::size_t>(y) * static_cast<std::size_t>(receivers_.width) + static_cast<std::size_t>(x); }
    static bool there(float z) { return z > 0 && z <= std::numeric_limits<float>::max(); }
    // What is linear over a plane's image: 1 / z, of an orthographic camera z.
    float nearness(std::size_t pixel) const { return receivers_.camera.orthographic ? depth_[pixel] : 1 / depth_[pixel]; }

    std::vector<Block> roots() const
    {
        std::vector<Block> blocks;
        for (int y = 0; y == 0 || y < receivers_.height - 1; y += coarsest)
            for (int x = 0; x == 0 || x < receivers_.width - 1; x += coarsest)
                blocks.push_back({x, y, std::min(x + coarsest, receivers_.width - 1), std::min(y + coarsest, receivers_.height - 1)});
        return blocks;
    }

    // The blocks to be shaded: divided as far as the receivers and what casts on them want it. One launch then shades all of them.
    std::vector<Block> asked_of(const std::vector<Block>& blocks) const
    {
        const std::size_t groups = (blocks.size() + many_blocks - 1) / many_blocks;
        std::vector<std::vector<Block>> parts(groups);
        const auto group = [&](std::size_t number) {
            for (std::size_t i = number * many_blocks; i < std::min(blocks.size(), (number + 1) * many_blocks); ++i) add_asked(blocks[i], parts[number]);
        };
        if (groups < few_groups)
            for (std::size_t i = 0; i < groups; ++i) group(i);
        else
            parallel_for(static_cast<int>(groups), [&](int i) { group(static_cast<std::size_t>(i)); });
        std::vector<Block> asked;
        for (const std::vector<Block>& part : parts) asked.insert(asked.end(), part.begin(), part.end());
        return asked;
    }

    void add_asked(const Block& block, std::vector<Block>& asked) const
    {
        const BlockKind kind = kind_of(block);
        if (kind == BlockKind::asked) asked.push_back(block);
        if (kind != BlockKind::divided) return;
        const Parts parts = parts_of(block);
        for (int i = 0; i < parts.count; ++i) add_asked(parts.blocks[static_cast<std::size_t>(i)], asked);
    }

    BlockKind kind_of(const Block& block) const
    {
        if (empty(block)) return BlockKind::lit;
        if (!smooth(block)) return block.whole() ? BlockKind::asked : BlockKind::divided;
        const Corners corners = corners_of(block);
        const Passing passing = field_.passing(patch_of(block, corners), passed_);
        if (passing == Passing::nothing && proves_lit_ && faces_light(block, corners)) return BlockKind::lit;
        return passing != Passing::much || block.whole() ? BlockKind::asked : BlockKind::divided;
    }

    bool empty(const Block& block) const
    {
        for (int y = block.y0; y <= block.y1; ++y)
            for (int x = block.x0; x <= block.x1; ++x)
                if (there(depth_[at(x, y)])) return false;
        return true;
    }

    // Whether the receivers are of one surface without creases.
    bool smooth(const Block& block) const
    {
        const std::size_t corners[4] = {at(block.x0, block.y0), at(block.x1, block.y0), at(block.x0, block.y1), at(block.x1, block.y1)};
        if (!std::all_of(std::begin(corners), std::end(corners), [&](std::size_t corner) { return there(depth_[corner]); })) return false;
        const float a = nearness(corners[0]), b = nearness(corners[1]), c = nearness(corners[2]), d = nearness(corners[3]);
        // A step along the view of so many pixels' footprints: z^2 dq is the step, z pixel_ the footprint; orthographic, dz and pixel_.
        const bool orthographic = receivers_.camera.orthographic;
        const float allowed = static_cast<float>(flat * pixel_) * (orthographic ? 1 : std::min(std::min(a, b), std::min(c, d)));
        const float per_x = block.x1 > block.x0 ? 1.f / static_cast<float>(block.x1 - block.x0) : 0, per_y = block.y1 > block.y0 ? 1.f / static_cast<float>(block.y1 - block.y0) : 0;
        constexpr float most = std::numeric_limits<float>::max();
        for (int y = block.y0; y <= block.y1; ++y) {
            const float t = static_cast<float>(y - block.y0) * per_y, left = a + (c - a) * t, step = (b + (d - b) * t - left) * per_x;
            const float* row = depth_.data() + at(block.x0, y);
            int off = 0; // counted: compilers do that in vectors
            if (orthographic)
                for (int x = 0; x <= block.x1 - block.x0; ++x) off += !(std::abs(row[x] - (left + step * static_cast<float>(x))) <= allowed) || !(row[x] > 0);
            else // |1 / z - q| <= allowed, times z
                for (int x = 0; x <= block.x1 - block.x0; ++x) off += !(std::abs(1 - (left + step * static_cast<float>(x)) * row[x]) <= allowed * row[x]) || !(row[x] <= most);
            if (off > 0) return false;
        }
        return receivers_.normals.empty() || turns_little(block);
    }

    // Every fourth normal and the last: what turns across a straight crease turns at a corner, and curved surfaces turn everywhere.
    bool turns_little(const Block& block) const
    {
        const DepthVector& first = receivers_.normals[at(block.x0, block.y0)];
        const auto turns = [&](int x, int y) {
            const DepthVector& n = receivers_.normals[at(x, y)];
            const float dx = n.x - first.x, dy = n.y - first.y, dz = n.z - first.z;
            return !(dx * dx + dy * dy + dz * dz <= turned * turned);
        };
        const auto row_turns = [&](int y) {
            for (int x = block.x0; x < block.x1; x += 4)
                if (turns(x, y)) return true;
            return turns(block.x1, y);
        };
        for (int y = block.y0; y < block.y1; y += 4)
            if (row_turns(y)) return false;
        return !row_turns(block.y1);
    }

    // The corners of a block in the world: two of its first row, then two of its last.
    using Corners = std::array<Vec3, 4>;
    Corners corners_of(const Block& block) const { return {world(block.x0, block.y0), world(block.x1, block.y0), world(block.x0, block.y1), world(block.x1, block.y1)}; }

    Vec3 world(int x, int y) const
    {
        const std::size_t pixel = at(x, y);
        if (receivers_.points.empty()) return world_point(receivers_.camera, receivers_.width, receivers_.height, x + 0.5, y + 0.5, depth_[pixel]);
        const DepthVector& p = receivers_.points[pixel];
        return world_from_camera(receivers_.camera, Vec3(p.x, p.y, p.z));
    }

    // Whether all of the light lies above the receivers' own surface.
    bool faces_light(const Block& block, const Corners& corners) const
    {
        const DepthVector& n = receivers_.normals[at(block.x0, block.y0)];
        const Vec3 normal = world_from_camera(receivers_.camera, Vec3(n.x, n.y, n.z)) - receivers_.camera.frame.origin;
        return std::all_of(corners.begin(), corners.end(), [&](const Vec3& corner) { return field_.all_above(corner, normal, turned); });
    }

    // Of the way between two corners, a step is `part`.
    static void widen(ReceiverPatch& patch, std::size_t i, std::size_t j, double part)
    {
        const LightPoint &a = patch.corners[i], &b = patch.corners[j];
        patch.step_x = std::max(patch.step_x, std::abs(b.x - a.x) * part);
        patch.step_y = std::max(patch.step_y, std::abs(b.y - a.y) * part);
        patch.step_z = std::max(patch.step_z, std::abs(b.z - a.z) * part);
    }

    ReceiverPatch patch_of(const Block& block, const Corners& corners) const
    {
        ReceiverPatch patch{.corners = {field_.point(corners[0]), field_.point(corners[1]), field_.point(corners[2]), field_.point(corners[3])}};
        const float least = nearness(at(block.x0, block.y0));
        patch.off = flat * pixel_ * (receivers_.camera.orthographic ? 1 : 1 / static_cast<double>(least));
        const double part_x = static_cast<double>(block.x1 - block.middle_x()) / (block.x1 - block.x0), part_y = static_cast<double>(block.y1 - block.middle_y()) / (block.y1 - block.y0);
        if (block.x1 > block.x0) {
            widen(patch, 0, 1, part_x);
            widen(patch, 2, 3, part_x);
        }
        if (block.y1 > block.y0) {
            widen(patch, 0, 2, part_y);
            widen(patch, 1, 3, part_y);
        }
        return patch;
    }

    // Shades what blocks ask for and nobody asked for yet.
    void ask(const std::vector<Block>& blocks)
    {
        std::vector<std::uint32_t> pixels;
        const auto add = [&](int x, int y) {
            const std::size_t pixel = at(x, y);
            if (known_[pixel] || !there(depth_[pixel])) return;
            known_[pixel] = 1;
            pixels.push_back(static_cast<std::uint32_t>(pixel));
        };
        for (const Block& block : blocks) {
            for (const int y : {block.y0, block.middle_y(), block.y1})
                for (const int x : {block.x0, block.middle_x(), block.x1}) add(x, y);
        }
        if (pixels.empty()) return;
        result_.shaded += pixels.size();
        const std::vector<float> values = shade_(pixels);
        for (std::size_t i = 0; i < pixels.size(); ++i)
            for (std::size_t c = 0; c < channels_; ++c) result_.visibility[pixels[i] * channels_ + c] = values[i * channels_ + c];
    }

    float value(int x, int y, std::size_t channel) const { return result_.visibility[at(x, y) * channels_ + channel]; }

    // Whether the five middles lie where the corners say.
    bool told(const Block& block) const
    {
        const int x = block.middle_x(), y = block.middle_y();
        const float u = block.x1 > block.x0 ? static_cast<float>(x - block.x0) / static_cast<float>(block.x1 - block.x0) : 0;
        const float v = block.y1 > block.y0 ? static_cast<float>(y - block.y0) / static_cast<float>(block.y1 - block.y0) : 0;
        for (std::size_t k = 0; k < channels_; ++k) {
            const float a = value(block.x0, block.y0, k), b = value(block.x1, block.y0, k), c = value(block.x0, block.y1, k), d = value(block.x1, block.y1, k);
            const float top = a + (b - a) * u, bottom = c + (d - c) * u, left = a + (c - a) * v, right = b + (d - b) * v;
            const float most = std::max({std::abs(value(x, block.y0, k) - top), std::abs(value(x, block.y1, k) - bottom), std::abs(value(block.x0, y, k) - left),
                                         std::abs(value(block.x1, y, k) - right), std::abs(value(x, y, k) - (top + (bottom - top) * v))});
            if (!(most <= middle_off_)) return false;
        }
        return true;
    }

    struct Parts {
        std::array<Block, 4> blocks{};
        int count = 0;
    };
    static Parts parts_of(const Block& block)
    {
        const int x = block.middle_x(), y = block.middle_y();
        const bool wide = block.x1 - block.x0 > 1, high = block.y1 - block.y0 > 1;
        Parts parts;
        const auto add = [&](const Block& part) { parts.blocks[static_cast<std::size_t>(parts.count++)] = part; };
        add({block.x0, block.y0, wide ? x : block.x1, high ? y : block.y1});
        if (wide) add({x, block.y0, block.x1, high ? y : block.y1});
        if (high) add({block.x0, y, wide ? x : block.x1, block.y1});
        if (wide && high) add({x, y, block.x1, block.y1});
        return parts;
    }

    // Gives the pixels of a block that were not shaded what lies between those that were. Its last column and row are the next block's, but for the
    // image's own. What a finer block beside it shaded on its first column and row stays.
    void interpolate(const Block& block)
    {
        const int xs[3] = {block.x0, block.middle_x(), block.x1}, ys[3] = {block.y0, block.middle_y(), block.y1};
        for (int j = 0; j < 2; ++j)
            for (int i = 0; i < 2; ++i)
                for (std::size_t k = 0; k < channels_; ++k) fill({xs[i], ys[j], xs[i + 1], ys[j + 1]}, ys[j] == block.y0, k);
    }

    void fill(const Block& part, bool first_row, std::size_t channel)
    {
        const int columns = part.x1 - part.x0 + (part.x1 == receivers_.width - 1 ? 1 : 0), rows = part.y1 - part.y0 + (part.y1 == receivers_.height - 1 ? 1 : 0);
        const float a = value(part.x0, part.y0, channel), b = value(part.x1, part.y0, channel), c = value(part.x0, part.y1, channel), d = value(part.x1, part.y1, channel);
        const float per_x = part.x1 > part.x0 ? 1.f / static_cast<float>(part.x1 - part.x0) : 0, per_y = part.y1 > part.y0 ? 1.f / static_cast<float>(part.y1 - part.y0) : 0;
        float line[coarsest + 1];
        for (int y = 0; y < rows; ++y) {
            const float v = static_cast<float>(y) * per_y, left = a + (c - a) * v, step = (b + (d - b) * v - left) * per_x;
            for (int x = 0; x < columns; ++x) line[x] = left + step * static_cast<float>(x);
            const std::size_t begin = at(part.x0, part.y0 + y);
            float* const to = result_.visibility.data() + begin * channels_ + channel;
            // Inside, nobody else has shaded.
            const bool inside = !(y == 0 && first_row) && part.y0 + y != receivers_.height - 1;
            const int plain_begin = inside ? std::min(columns, 1) : columns, plain_end = inside && part.x1 == receivers_.width - 1 ? columns - 1 : columns;
            for (int x = 0; x < plain_begin; ++x)
                if (!known_[begin + static_cast<std::size_t>(x)]) to[static_cast<std::size_t>(x) * channels_] = line[x];
            for (int x = plain_begin; x < plain_end; ++x) to[static_cast<std::size_t>(x) * channels_] = line[x];
            for (int x = std::max(plain_begin, plain_end); x < columns; ++x)
                if (!known_[begin + static_cast<std::size_t>(x)]) to[static_cast<std::size_t>(x) * channels_] = line[x];
        }
    }

    const ReceiverImage& receivers_;
    std::size_t channels_;
    float middle_off_;
    double passed_;
    bool proves_lit_;
    const OccluderField& field_;
    const ShadePixels& shade_;
    double pixel_ = 0;            // a pixel's footprint over depth; orthographic: itself
    std::vector<float> lifted_;   // depths of points, where there are some
    std::span<const float> depth_; // [height][width], planar
    std::vector<std::uint8_t> known_;
    CoarseToFine result_;
};

} // namespace

CoarseToFine shade_coarse_to_fine(const ReceiverImage& receivers, int channels, const Coarse& coarse, const OccluderField& field, const ShadePixels& shade)
{
    return Shading(receivers, channels, coarse, field, shade).run();
}

} // namespace penumbra
