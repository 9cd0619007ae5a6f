#include "scene/position_depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <penumbra/error.hpp>

#include "scene/camera.hpp"
#include "scene/stored_depth.hpp"

namespace penumbra {
namespace {

void check(const PositionImage& positions, const DepthEncoding& encoding, const std::string& where, std::vector<std::string>& warnings)
{
    if (encoding.kind != EncodingKind::planar)
        throw Error(ErrorCode::invalid_input, where + " holds positions, and the encoding's kind is one of depth",
                    "expected an encoding without kind; scale, empty, channel and part count");
    if (is_integer(positions.type))
        throw Error(ErrorCode::invalid_input, where + " holds integers; positions need floats", "use EXR float32");
    if (positions.type == SampleType::float16)
        warnings.push_back(where +
                           " is half-float: positions are right to 1 part in 2048 of their distance to the origin; float32 is better");
}

// How far apart neighbouring stored numbers of this size are.
double step_at(double size, SampleType type) { return size * (type == SampleType::float16 ? 0x1p-10 : 0x1p-23); }

struct Seen {
    std::size_t there = 0, behind = 0, elsewhere = 0;
    double largest = 0;        // coordinate
    double nearest = HUGE_VAL; // depth
};

void warn(const Seen& seen, const std::string& where, std::vector<std::string>& warnings)
{
    if (seen.behind > 0)
        warnings.push_back(where + ": " + std::to_string(seen.behind) + " of " + std::to_string(seen.there) +
                           " positions lie behind the camera and count as nothing there");
    if (2 * seen.elsewhere <= seen.there) return;
    warnings.push_back(where + ": the camera sees " + std::to_string(seen.elsewhere) + " of " + std::to_string(seen.there) +
                       " positions more than 2 pixels beside their own pixel; the camera or encoding.scale is another, or the positions "
                       "are not the world's");
}

} // namespace

DepthMap depth_of_positions(const PositionImage& positions, const DepthEncoding& encoding, const Camera& camera, const std::string& where,
                            std::vector<std::string>& warnings)
{
    check(positions, encoding, where, warnings);
    DepthMap map{
        .width = positions.width, .height = positions.height, .depth = {}, .from_image = true, .noise = encoding.precision.value_or(0)};
    const auto empty = static_cast<float>(encoding.empty.value_or(0));
    const std::size_t count = static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height);
    map.depth.assign(count, nothing_there);
    Seen seen;
    for (std::size_t i = 0; i < count; ++i) {
        const float* const p = &positions.samples[3 * i];
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) continue;
        if (p[0] == empty && p[1] == empty && p[2] == empty) continue;
        const float far = far_end(positions.type);
        if (std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])}) >= far) continue;
        ++seen.there;
        const Vec3 world = Vec3(p[0], p[1], p[2]) * encoding.scale;
        const Projected at = project(camera, map.width, map.height, world);
        if (!(at.depth > 0)) {
            ++seen.behind;
            continue;
        }
        const double x = static_cast<double>(i % static_cast<std::size_t>(map.width)) + 0.5,
                     y = static_cast<double>(i / static_cast<std::size_t>(map.width)) + 0.5;
        seen.elsewhere += !(std::max(std::abs(at.x_px - x), std::abs(at.y_px - y)) <= 2);
        seen.largest = std::max({seen.largest, std::abs(world.x), std::abs(world.y), std::abs(world.z)});
        seen.nearest = std::min(seen.nearest, at.depth);
        map.depth[i] = static_cast<float>(at.depth);
    }
    warn(seen, where, warnings);
    if (seen.largest == 0) return map;

    // Depth is a difference of coordinates, which are stored in steps of their own size.
    const double step = step_at(seen.largest, positions.type);
    map.precision = std::max(0x1p-24, step / 2 / seen.nearest);
    map.step.depth = step;
    return map;
}

} // namespace penumbra
