// Rays through a scene's objects (Embree, robust mode). Geometry is kept relative to an origin of the caller's choice (the light) so that
// float32 keeps its digits where they matter.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <penumbra/scene.hpp>

#include "depth_image/depth_image.hpp"
#include "scene/camera.hpp"
#include "scene/light_space.hpp"

namespace penumbra {

// What a camera is to see.
struct ViewRequest {
    bool front = false, back = false;
    int layers = 0, first_layer = 0; // surfaces first_layer, first_layer + 1, ... in order of depth
    bool normals = false;
    // Samples along one side of the texels in which something begins or ends, at the most: fewer where they would be more than `fine_share` a
    // texel of the map. 0: none. Perspective cameras alone.
    int fine = 0;
    double fine_share = 4;
    double gap = 0; // steps of 1 / depth, of orthographic views of depth, up to which neighbouring texels show one surface, whatever lies between
};

// Of each pixel the nearest surface (front), the furthest back-facing one, whose normal points along the ray (back), and those in order of
// depth (layers; 0 is the front). The same hit reported by two triangles that share an edge counts once.
struct TracedViews {
    DepthMap front, back;
    std::vector<DepthMap> layers;
    std::vector<DepthVector> normals; // of the front's triangle, towards the camera and in its coordinates; 0 where nothing is seen
};

class Tracer {
public:
    // Builds a hierarchy of the objects' triangles. Triangles of no area or with coordinates that are not finite are left out and counted.
    Tracer(std::span<const TriangleMesh* const> meshes, const Vec3& origin);
    ~Tracer();
    Tracer(Tracer&&) noexcept;

    std::uint64_t triangle_count() const;
    std::uint64_t degenerate_count() const;
    std::uint64_t bytes() const; // of the hierarchy, as Embree's memory monitor counts

    // Depth of what the camera sees through each pixel's centre.
    DepthMap front(const Camera& camera, int width, int height) const { return views(camera, width, height, {.front = true}).front; }
    DepthMap back(const Camera& camera, int width, int height) const { return views(camera, width, height, {.back = true}).back; }
    std::vector<DepthMap> layers(const Camera& camera, int width, int height, int count) const { return views(camera, width, height, {.layers = count}).layers; }

    // All of that from one ray a pixel. Throws usage for a size below 1 and a count below 0.
    TracedViews views(const Camera& camera, int width, int height, const ViewRequest& request) const;

    struct Impl;
    const Impl& impl() const { return *impl_; }

private:
    std::unique_ptr<Impl> impl_;
};

struct VisibilityOptions {
    int samples = 256; // rays a receiver, one in each stratum; a light without extent needs and gets one
    // First `first_samples` rays everywhere, then all `samples` but for tiles of 4 x 4 pixels whose first rays, and those of the tiles next
    // to them, were all free or all blocked.
    bool adaptive = false;
    int first_samples = 16;
    std::uint64_t seed = 1;
};

// What shadow rays meet beside the tracer's triangles, and where they start.
struct SeenScene {
    std::span<const std::shared_ptr<const DepthImage>> images; // walked with the same samples
    const DepthSurface* surface = nullptr;                     // receivers of somebody else's depth: lifted, the light clipped at their planes
    bool bounds = false;                                       // VisibilityResult::bound is wanted
    std::span<const std::uint32_t> pixels = {};                // y width + x: these alone, without `adaptive` and bounds; the result is a row of them
};

struct VisibilityResult {
    Image visibility;       // 1 channel, or 3 for a textured light
    Image bound;            // two channels: the lowest and the highest that visibility can be, where depth images cast
    std::uint64_t rays = 0; // shadow rays cast
    std::uint64_t followed = 0, behind = 0, left = 0; // of the samples followed to their end: all, never through a front, out of the image
};

// Ray-traced visibility of the light at each pixel of a receiver depth map; 1 where nothing is there or behind the light's plane.
// Deterministic for a seed, whatever the thread count. A receiver that lies on one of the tracer's triangles is on the camera's side of it
// (surface.hpp). A textured light shines evenly within each texel. Throws usage for sample counts below 1 and maps whose size does not fit.
VisibilityResult trace_visibility(const Tracer& tracer, const Light& light, const DepthMap& receivers, const Camera& camera,
                                  const VisibilityOptions& options, const SeenScene& seen = {});

} // namespace penumbra
