#include "trace/tracer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <penumbra/error.hpp>

#include "scene/parallel.hpp"
#include "scene/stop.hpp"
#include "trace/crossings.hpp"
#include "trace/embree_scene.hpp"
#include "trace/surface.hpp"

namespace penumbra {
namespace {

double largest_coordinate(const Vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

// Whether the mesh's triangle has an area and finite corners. Differences of float32 values and their products are exact enough in double
// that only collinear corners give a cross product of 0.
bool has_area(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle)
{
    const Vec3 a(mesh.positions[triangle[0]]), b(mesh.positions[triangle[1]]), c(mesh.positions[triangle[2]]);
    const Vec3 normal = (b - a).cross(c - a);
    return std::isfinite(normal.x) && std::isfinite(normal.y) && std::isfinite(normal.z) && normal != Vec3(0, 0, 0);
}

void require_corners(const TriangleMesh& mesh, std::size_t mesh_index, std::size_t triangle_index)
{
    for (const std::uint32_t vertex : mesh.triangles[triangle_index])
        if (vertex >= mesh.positions.size())
            throw Error(ErrorCode::invalid_input,
                        "objects[" + std::to_string(mesh_index) + "]: triangle " + std::to_string(triangle_index) + " has vertex " +
                            std::to_string(vertex) + ", the mesh has " + std::to_string(mesh.positions.size()),
                        "expected indices of the mesh's own positions");
}

} // namespace

Tracer::Impl::Impl(std::span<const TriangleMesh* const> meshes, const Vec3& at) : origin(at)
{
    take(meshes);
    try {
        build();
    } catch (...) {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
        throw;
    }
}

Tracer::Impl::~Impl()
{
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
}

void Tracer::Impl::take(std::span<const TriangleMesh* const> meshes)
{
    // Sizes first: all meshes share one vertex buffer with 32-bit indices.
    std::uint64_t vertex_count = 0, triangle_count = 0;
    for (const TriangleMesh* mesh : meshes) {
        vertex_count += mesh->positions.size();
        triangle_count += mesh->triangles.size();
    }
    constexpr std::uint64_t limit = std::numeric_limits<std::uint32_t>::max() - 1;
    if (vertex_count > limit || triangle_count > limit)
        throw Error::at(ErrorCode::too_large, "objects",
                        std::to_string(vertex_count) + " vertices and " + std::to_string(triangle_count) +
                            " triangles are too many to trace",
                        "expected at most " + std::to_string(limit) + " of each");

    // The triangles that can be hit, and how far their corners are from the origin.
    triangles.reserve(triangle_count);
    double furthest = 0;
    std::uint32_t first_vertex = 0;
    std::vector<bool> used(vertex_count, false);
    const bool any_cut = std::ranges::any_of(meshes, [](const TriangleMesh* mesh) { return mesh->cut_outs != nullptr; });
    for (std::size_t m = 0; m < meshes.size(); ++m) {
        const TriangleMesh& mesh = *meshes[m];
        require_cut_outs(mesh, m);
        if (mesh.cut_outs) images_.push_back(mesh.cut_outs);
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            require_corners(mesh, m, t);
            const auto& corners = mesh.triangles[t];
            if (!has_area(mesh, corners)) {
                ++degenerate;
                continue;
            }
            for (const std::uint32_t c : corners) {
                furthest = std::max(furthest, largest_coordinate(Vec3(mesh.positions[c]) - origin));
                used[first_vertex + c] = true;
            }
            triangles.push_back({first_vertex + corners[0], first_vertex + corners[1], first_vertex + corners[2]});
            if (any_cut) cuts.push_back(cut_of(mesh, t));
        }
        first_vertex += static_cast<std::uint32_t>(mesh.positions.size());
    }
    if (furthest > 0) scale = std::ldexp(1.0, -(std::ilogb(furthest) + 1));

    // To traced space. Vertices of no triangle may be anything: they become 0.
    vertices.assign(vertex_count + 1, Imath::V3f(0, 0, 0));
    std::size_t v = 0;
    for (const TriangleMesh* mesh : meshes)
        for (const Imath::V3f& position : mesh->positions) {
            if (used[v]) {
                vertices[v] = Imath::V3f(traced_from_world(Vec3(position)));
                box.extendBy(Vec3(vertices[v]));
            }
            ++v;
        }

    drop_degenerate();
    for (std::uint32_t t = 0; t < triangles.size(); ++t) surface_reach = std::max(surface_reach, reach(triangle_surface(*this, t)));
}

// Near a far origin, corners that the mesh holds apart may round to one line.
void Tracer::Impl::drop_degenerate()
{
    std::size_t kept = 0;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto& t = triangles[i];
        const Vec3 a(vertices[t[0]]), b(vertices[t[1]]), c(vertices[t[2]]);
        if ((b - a).cross(c - a) == Vec3(0, 0, 0)) continue;
        triangles[kept] = t;
        if (!cuts.empty()) cuts[kept] = cuts[i];
        ++kept;
    }
    degenerate += triangles.size() - kept;
    triangles.resize(kept);
    if (!cuts.empty()) cuts.resize(kept);
}

void Tracer::Impl::build()
{
    // A cache of tessellated surfaces, of which there are none here, is 128 MiB by default; where they are not to be had, Embree 3.13 hangs in the
    // next device.
    const std::string config = "tessellation_cache_size=0,threads=" + std::to_string(thread_count());
    device = rtcNewDevice(config.c_str());
    if (!device) {
        const RTCError why = rtcGetDeviceError(nullptr);
        throw Error(why == RTC_ERROR_OUT_OF_MEMORY ? ErrorCode::too_large : ErrorCode::internal,
                    "Embree: rtcNewDevice failed with error " + std::to_string(why));
    }
    rtcSetDeviceErrorFunction(
        device,
        [](void* self, RTCError code, const char* text) {
            auto* impl = static_cast<Impl*>(self);
            const std::lock_guard lock(impl->error_guard);
            if (impl->error != RTC_ERROR_NONE) return;
            impl->error = code;
            impl->error_text = text ? text : "";
        },
        this);
    rtcSetDeviceMemoryMonitorFunction(
        device,
        [](void* self, ssize_t change, bool) {
            static_cast<Impl*>(self)->bytes += change;
            return true;
        },
        this);

    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM); // high splits triangles over several leaves: a hit would be reported twice
    if (!triangles.empty()) {
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices.data(), 0, sizeof(Imath::V3f),
                                   vertices.size() - 1);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles.data(), 0, sizeof(triangles[0]),
                                   triangles.size());
        rtcSetGeometryIntersectFilterFunction(geometry, collect_crossing);
        if (!cuts.empty()) {
            rtcSetGeometryUserData(geometry, &cuts);
            rtcSetGeometryOccludedFilterFunction(geometry, pass_cut_outs);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
    }
    // Embree leaves off building where it is told to.
    const std::shared_ptr<StopWord>& stop = current_stop();
    if (stop)
        rtcSetSceneProgressMonitorFunction(scene, [](void* word, double) { return static_cast<const StopWord*>(word)->asked == 0; }, stop.get());
    rtcCommitScene(scene);
    rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
    check_stop(stop.get());
    check("rtcCommitScene");
}

void Tracer::Impl::check(const char* call) const
{
    const std::lock_guard lock(error_guard);
    if (error == RTC_ERROR_NONE) return;
    const std::string what = "Embree: " + std::string(call) + " failed with error " + std::to_string(error) + " for " +
                             std::to_string(triangles.size()) + " triangles: " + error_text;
    if (error == RTC_ERROR_OUT_OF_MEMORY) throw Error(ErrorCode::too_large, what, "expected objects whose hierarchy fits into memory");
    throw Error(ErrorCode::internal, what);
}

Tracer::Tracer(std::span<const TriangleMesh* const> meshes, const Vec3& origin) : impl_(std::make_unique<Impl>(meshes, origin)) {}
Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;

std::uint64_t Tracer::triangle_count() const { return impl_->triangles.size(); }
std::uint64_t Tracer::degenerate_count() const { return impl_->degenerate; }
std::uint64_t Tracer::bytes() const { return static_cast<std::uint64_t>(std::max<std::int64_t>(impl_->bytes.load(), 0)); }

} // namespace penumbra
