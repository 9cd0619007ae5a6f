// What a Geometry holds: objects, and the hierarchies made from them when first asked for.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include <penumbra/engine.hpp>

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
};

// Where the first light of a scene is.
Vec3 first_origin(const Scene& scene);

// A scene's objects without copying them, near its first light: the scene has to stay.
Geometry view_of(const Scene& scene);

} // namespace penumbra
