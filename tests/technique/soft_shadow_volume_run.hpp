// Runs soft_shadow_volume step by step on the device and reads back all that it saw, for comparison with the oracle; casters by hand.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "oracle/soft_shadow_volume_oracle.hpp"
#include "support/casters.hpp"
#include "support/device_run.hpp"
#include "support/maps.hpp"
#include "technique/soft_shadow_volume.hpp"

namespace penumbra::test {

// Triangles anywhere in the box, each a mesh of its own.
inline std::vector<TriangleMesh> soup(int count, const Vec3& low, const Vec3& high, std::uint32_t seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(0, 1);
    const auto point = [&] {
        const double x = any(random), y = any(random), z = any(random);
        return low + Vec3(x, y, z) * (high - low);
    };
    std::vector<TriangleMesh> meshes;
    for (int i = 0; i < count; ++i) {
        const Vec3 a = point(), b = point(), c = point();
        meshes.push_back(mesh_of({a, b, c}, {{0, 1, 2}}));
    }
    return meshes;
}

// A part of a ball, from one pole on, that shows both its sides where it is seen from beside: `rings` of `whole` rings of quads around
// `axis`.
inline TriangleMesh shell(const Vec3& center, double radius, const Vec3& axis, int rings, int whole)
{
    constexpr int around = 16;
    const Vec3 z = axis.normalized(), x = z.cross(std::abs(z.x) < 0.5 ? Vec3(1, 0, 0) : Vec3(0, 1, 0)).normalized(), y = z.cross(x);
    std::vector<Vec3> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (int i = 0; i <= rings; ++i)
        for (int j = 0; j < around; ++j) {
            const double u = std::numbers::pi * i / whole, v = 2 * std::numbers::pi * j / around, r = i == 0 ? 0 : std::sin(u);
            points.push_back(center + (x * (r * std::cos(v)) + y * (r * std::sin(v)) + z * std::cos(u)) * radius);
            if (i == rings) continue;
            const auto at = [&](int ring, int place) { return static_cast<std::uint32_t>(ring * around + place % around); };
            triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
            triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
        }
    return mesh_of(points, triangles);
}

struct WedgeCase {
    Light light = rectangle_light(1, 1);
    std::vector<TriangleMesh> casters = {};
    SoftShadowVolume settings = {};
    DepthMap receivers = {};
    std::optional<Camera> camera = {}; // of the receivers; nothing: at the light, tangents of 1
};

struct WedgeRun {
    std::vector<oracle::Receiver> points; // tangents and disparity; d = NO_RECEIVER where there is none
    std::vector<float> visibility;
    ShadeCounts counts;
};

inline Topology topology_of(const std::vector<TriangleMesh>& meshes)
{
    std::vector<const TriangleMesh*> pointers;
    for (const TriangleMesh& mesh : meshes) pointers.push_back(&mesh);
    return Topology(pointers);
}

inline WedgeRun run(const std::shared_ptr<opencl::Context>& context, const WedgeCase& c)
{
    opencl::Work work(context);
    const Topology topology = topology_of(c.casters);
    const PreparedSoftShadowVolume prepared = prepare_soft_shadow_volume(work, c.light, {.topology = topology}, c.settings);
    const auto depth = work.upload(std::span<const float>(c.receivers.depth), "receivers");
    const Camera view = wedge_view(c.light);
    const ReceiverPoints points = receiver_points(work, receiver_view(c.camera.value_or(view), c.receivers.width, c.receivers.height, view),
                                                  depth.memory(), c.receivers.precision, prepared.program);
    const auto visibility = work.buffer<float>(c.receivers.depth.size(), "visibility");
    WedgeRun result;
    shade_soft_shadow_volume(work, prepared, points, visibility.memory(), &result.counts);
    result.points = read_points(work, points);
    result.visibility = work.read(visibility);
    work.finish();
    return result;
}

// What the oracle says, for every receiver.
class WedgeExpectation {
public:
    explicit WedgeExpectation(const WedgeCase& c) : settings_(c.settings)
    {
        const LightFrame frame = light_frame(c.light);
        shape_ = frame.shape == LightShape::disc ? oracle::wedge::Shape::disc : oracle::wedge::Shape::square;
        origin_ = frame.origin;
        const Topology topology = topology_of(c.casters);
        for (const LightPart& part : light_parts(frame, c.settings.light_splits)) {
            const Silhouette silhouette = silhouette_of(topology, part.centre);
            Part own{.part = part, .sheets = std::vector<oracle::wedge::Sheet>(silhouette.sheets())};
            for (std::size_t s = 0; s < silhouette.sheets(); ++s) {
                own.sheets[s].surface = silhouette.sides[s].component;
                own.sheets[s].turned = silhouette.sides[s].turned;
                for (std::size_t i = silhouette.facing_begin[s]; i < silhouette.facing_begin[s + 1]; ++i) {
                    oracle::wedge::Triangle triangle;
                    for (std::size_t k = 0; k < 3; ++k) {
                        const Vec3 from = Vec3(topology.vertices()[silhouette.facing[i][k]]) - part.centre;
                        triangle[k] = Vec3(from.dot(frame.u), from.dot(frame.v), from.dot(frame.direction)) / part.half;
                    }
                    own.sheets[s].triangles.push_back(triangle);
                }
            }
            parts_.push_back(std::move(own));
        }
    }

    oracle::wedge::Bounded at(const oracle::Receiver& p) const
    {
        oracle::wedge::Bounded seen{1, 0x1p-24};
        for (const Part& part : parts_) {
            const Vec3 place = Vec3(p.xi / p.d, p.eta / p.d, 1 / p.d) / part.part.half - Vec3(part.part.centre_x, part.part.centre_y, 0);
            const auto one = oracle::wedge::occlusion(shape_, {place}, part.sheets, static_cast<oracle::wedge::Joined>(settings_.overlap));
            seen.value -= part.part.share * one.value;
            seen.bound += part.part.share * one.bound;
        }
        return seen;
    }

    void forget_a_triangle() { parts_.front().sheets.front().triangles.pop_back(); }

private:
    struct Part {
        LightPart part;
        std::vector<oracle::wedge::Sheet> sheets;
    };
    SoftShadowVolume settings_;
    oracle::wedge::Shape shape_;
    Vec3 origin_;
    std::vector<Part> parts_;
};

} // namespace penumbra::test
