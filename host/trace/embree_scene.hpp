// The inside of a Tracer: Embree's scene, and the triangles that it was made from.
//
// Traced space: (world - origin) * scale, in float32. `scale` is the power of two that brings the largest coordinate to between 0.5 and 1,
// so that a scene's unit of length changes no bit of what Embree computes and no product of lengths leaves float32's range.
#pragma once

#include <cmath>
#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include <embree3/rtcore.h>

#include <Imath/ImathBox.h>

#include "trace/cut_filter.hpp"
#include "trace/tracer.hpp"

namespace penumbra {

// Half a unit in the last place of a float32 in [1, 2): the largest relative error of rounding to nearest.
constexpr double float_rounding = 0x1p-24;

// The root of three: from a bound for each coordinate to a bound for the length of a vector.
constexpr double root3 = 1.7320508075688772;

struct Tracer::Impl {
    Impl(std::span<const TriangleMesh* const> meshes, const Vec3& at);
    ~Impl();
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    Vec3 corner(std::uint32_t triangle, int i) const { return Vec3(vertices[triangles[triangle][static_cast<std::size_t>(i)]]); }
    Vec3 traced_from_world(const Vec3& world) const { return (world - origin) * scale; }

    // Throws what Embree's error callback has recorded: too_large when memory ran out, else internal.
    void check(const char* call) const;

    Vec3 origin{0, 0, 0};
    double scale = 1;
    std::vector<Imath::V3f> vertices; // one more than is used: Embree reads 16 bytes from each vertex
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<TracedCut> cuts; // of each triangle; empty when nothing is cut out
    std::uint64_t degenerate = 0;

    Imath::Box3d box;         // of the vertices that triangles use, traced space
    double surface_reach = 0; // how far from a triangle a point may have to be moved (surface.hpp), the largest of all triangles

    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    std::atomic<std::int64_t> bytes{0};
    mutable std::mutex error_guard;
    RTCError error = RTC_ERROR_NONE;
    std::string error_text;

private:
    void take(std::span<const TriangleMesh* const> meshes);
    void drop_degenerate();
    void build();

    std::vector<std::shared_ptr<const CutOuts>> images_; // that `cuts` points into
};

// Whether Embree takes a ray with this origin or direction. For others it ends the process (Debian builds it with its assertions); its own limit is
// 1.8e18.
inline bool castable(const Imath::V3f& v)
{
    constexpr float most = 1e18F;
    return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most; // false: NaN
}

} // namespace penumbra
