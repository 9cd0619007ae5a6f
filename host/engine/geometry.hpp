// What a Geometry holds: objects, and the hierarchies made from them when first asked for.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include <penumbra/engine.hpp>

#include "depth_image/depth_image.hpp"
#include "opencl/context.hpp"
#include "silhouette/silhouette.hpp"
#include "trace/tracer.hpp"

namespace penumbra {

struct Geometry::State {
    State(std::vector<Object> objects_, const Vec3& near_) : owned(std::move(objects_)), objects(&owned), near(near_) {}
    State(const std::vector<Object>* objects_, const Vec3& near_) : objects(objects_), near(near_) {}
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    bool any(bool Object::*role) const;
    std::uint64_t bytes() const;
    // Hierarchies of the objects that cast, or of those that receive; one for both where that is the same. Built once, by whoever asks
    // first.
    std::shared_ptr<const Tracer> casters() const { return tracer(&Object::casts, casters_); }
    std::shared_ptr<const Tracer> receivers() const { return tracer(&Object::receives, receivers_); }

    // Depth images among the objects that cast, or that receive, fitted on `device` (null: one of the environment's
    // choice), which is opened only if there are any. Each is fitted once.
    [[gnu::visibility("hidden")]] std::vector<std::shared_ptr<const DepthImage>> images(bool Object::*role, const std::shared_ptr<const opencl::LateContext>& device) const;
    std::vector<std::pair<std::size_t, DepthQuality>> qualities(bool Object::*role) const; // by object, of those fitted so far
    // The receivers on an object's depth image, where that is the same image: they need no fit of their own. Null: there is none.
    std::shared_ptr<const DepthSurface> surface_of_same(const DepthMap& depth, const Camera& camera) const;
    bool any_seen(bool Object::*role) const; // depth images among them
    bool any_mesh(bool Object::*role) const; // triangles among them

    // How the triangles of the objects that cast hang together.
    std::shared_ptr<const Topology> topology() const;

    const std::vector<Object> owned;
    const std::vector<Object>* const objects;
    const Vec3 near; // hierarchies are kept relative to here

private:
    std::shared_ptr<const Tracer> tracer(bool Object::*role, std::shared_ptr<const Tracer>& slot) const;

    mutable std::mutex building_;
    mutable std::shared_ptr<const Tracer> casters_, receivers_;
    mutable std::shared_ptr<const Topology> topology_;
    mutable std::mutex fitting_;
    mutable std::vector<std::shared_ptr<const DepthSurface>> surfaces_;
    mutable std::vector<std::shared_ptr<const DepthImage>> images_; // of each object; null: not fitted, or a mesh
};

// Where the first light of a scene is.
Vec3 first_origin(const Scene& scene);

// A scene's objects without copying them, near its first light: the scene has to stay.
Geometry view_of(const Scene& scene);

} // namespace penumbra
