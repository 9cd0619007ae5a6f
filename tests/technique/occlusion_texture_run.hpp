// Runs occlusion_texture step by step on the device and reads back all that it built, for comparison with the oracle.
#pragma once

#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include "oracle/occlusion_texture_oracle.hpp"
#include "support/casters.hpp"
#include "support/device_run.hpp"
#include "support/maps.hpp"
#include "technique/occlusion_levels.hpp"
#include "technique/occlusion_texture.hpp"

namespace penumbra::test {

struct SliceCase {
    Light light = rectangle_light(1, 1);
    std::vector<TriangleMesh> casters = {};
    OcclusionTexture settings = {};
    DepthMap receivers = flat(1, 1, 1);
    std::optional<Camera> camera = {};                       // of the receivers; nothing: at the light, tangents of 1
    std::optional<std::pair<DepthMap, DepthMap>> solid = {}; // between front and back, seen by `solid_camera`
    Camera solid_camera = {};
};

struct SliceRun {
    struct Part {
        OcclusionLight light{};
        std::vector<OcclusionPlane> planes;
        std::vector<OcclusionLevel> levels;
        std::vector<unsigned char> data;
    };
    Camera view;
    std::vector<Part> parts;
    std::vector<oracle::Receiver> points;
    std::vector<float> visibility;
    std::vector<std::string> warnings;
};

inline std::vector<const TriangleMesh*> pointers_to(const std::vector<TriangleMesh>& meshes)
{
    std::vector<const TriangleMesh*> pointers;
    for (const TriangleMesh& mesh : meshes) pointers.push_back(&mesh);
    return pointers;
}

inline SliceRun run(const std::shared_ptr<opencl::Context>& context, const SliceCase& c)
{
    opencl::Work work(context);
    std::optional<SolidMaps> solid;
    if (c.solid) solid.emplace(SolidMaps{.front = c.solid->first, .back = c.solid->second, .camera = c.solid_camera});
    const PreparedOcclusionTexture prepared =
        prepare_occlusion_texture(work, c.light, pointers_to(c.casters), solid ? &*solid : nullptr, c.settings);
    const auto depth = work.upload(std::span<const float>(c.receivers.depth), "receivers");
    const ReceiverPoints points =
        receiver_points(work, receiver_view(c.camera.value_or(prepared.view), c.receivers.width, c.receivers.height, prepared.view),
                        depth.memory(), c.receivers.precision, prepared.program);
    const auto visibility = work.buffer<float>(c.receivers.depth.size(), "visibility");
    shade_occlusion_texture(work, prepared, points, visibility.memory(), nullptr);
    SliceRun result{.view = prepared.view, .parts = {}, .points = {}, .visibility = {}, .warnings = prepared.warnings};
    const auto read = [&](const auto& buffer) { return buffer.count() > 0 ? work.read(buffer) : decltype(work.read(buffer)){}; };
    for (const auto& part : prepared.parts) result.parts.push_back({part.light, read(part.planes), read(part.levels), read(part.data)});
    result.points = read_points(work, points);
    result.visibility = work.read(visibility);
    work.finish();
    return result;
}

// The value of a stored texel.
inline double stored(const SliceRun::Part& part, const OcclusionTexture& settings, std::size_t level, std::size_t texture, int x, int y)
{
    const OcclusionLevel& l = part.levels.at(level);
    const std::size_t at = static_cast<std::size_t>(l.offset) * 1024 +
                           (texture * static_cast<std::size_t>(l.rows) + static_cast<std::size_t>(y)) * static_cast<std::size_t>(l.stride) +
                           static_cast<std::size_t>(x);
    if (settings.storage == LevelStorage::normalized16) {
        std::uint16_t value = 0;
        std::memcpy(&value, part.data.data() + 2 * at, 2);
        return value / 65535.0;
    }
    float value = 0;
    std::memcpy(&value, part.data.data() + 4 * at, 4);
    return value;
}

// What the oracle needs of one part of a light: host geometry, and the slices' bits as the device marked them (read from the textures
// themselves, which a run with combine product and no leak fix stores unchanged).
inline oracle::slices::Scene oracle_scene(const std::shared_ptr<opencl::Context>& context, SliceCase c, std::size_t part = 0)
{
    const OcclusionTexture settings = c.settings;
    c.settings.combine = Combine::product;
    c.settings.leak_fix = false;
    c.settings.prefilter = Prefilter::nbuffer;
    c.settings.storage = LevelStorage::binary32;
    c.receivers = flat(1, 1, 1);
    c.camera = {};
    const SliceRun bits = run(context, c);

    LightFrame frame = light_frame(c.light);
    frame.origin = bits.view.frame.origin;
    // A square has the variance of a disc of radius r, r^2 / 4 along each axis, where half its side, a, has a^2 / 3 = r^2 / 4.
    const bool square = frame.shape == LightShape::disc && !(frame.directional && settings.prefilter == Prefilter::nbuffer);
    for (double* half : {&frame.half_u, &frame.half_v}) *half *= square ? std::sqrt(0.75) : 1;
    const SliceCasters casters = slice_casters(frame, pointers_to(c.casters));
    const SliceRange range = slice_range(casters, frame.directional);
    const int splits = settings.light_splits, i = static_cast<int>(part) % splits, j = static_cast<int>(part) / splits;
    const SlicePart own{.centre_x = (2 * i + 1 - splits) * frame.half_u / splits,
                        .centre_y = (2 * j + 1 - splits) * frame.half_v / splits,
                        .half_u = frame.half_u / splits,
                        .half_v = frame.half_v / splits};
    oracle::slices::Scene scene{.view = slice_view(casters, range, own, settings, frame.directional),
                                .depths = slice_depths(casters, range, settings.slices, settings.placement, frame.directional),
                                .bits = {},
                                .settings = settings,
                                .centre_x = own.centre_x,
                                .centre_y = own.centre_y,
                                .half_u = own.half_u,
                                .half_v = own.half_v};
    const int side = settings.resolution;
    scene.bits.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    const SliceRun::Part& marked = bits.parts.at(part);
    for (std::size_t t = 0; t < marked.planes.size(); ++t)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x)
                if (stored(marked, c.settings, 0, t, x + 1, y + 1) > 0.5)
                    scene.bits[static_cast<std::size_t>(y * side + x)] |= std::uint64_t{1} << marked.planes[t].slice;
    return scene;
}

// Triangles anywhere in a box of light space.
inline TriangleMesh triangles_in(int count, const Vec3& low, const Vec3& high, double size, std::uint32_t seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const auto any = [&] {
        const double x = unit(random), y = unit(random), z = unit(random);
        return Vec3(x, y, z);
    };
    std::vector<Vec3> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (int i = 0; i < count; ++i) {
        const Vec3 at = low + any() * (high - low);
        for (int k = 0; k < 3; ++k) points.push_back(at + (any() - Vec3(0.5)) * size);
        const auto n = static_cast<std::uint32_t>(3 * i);
        triangles.push_back({n, n + 1, n + 2});
    }
    return mesh_of(points, triangles);
}

// A parallelogram from `corner` along `a` and `b`, in n x n quads of two triangles.
inline TriangleMesh grid(const Vec3& corner, const Vec3& a, const Vec3& b, int n)
{
    std::vector<Vec3> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) points.push_back(corner + a * (static_cast<double>(i) / n) + b * (static_cast<double>(j) / n));
    const auto at = [n](int i, int j) { return static_cast<std::uint32_t>(j * (n + 1) + i); };
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return mesh_of(points, triangles);
}

} // namespace penumbra::test
