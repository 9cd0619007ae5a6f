#include "engine/geometry.hpp"

#include <algorithm>

#include "scene/light_space.hpp"

namespace penumbra {

namespace {

std::uint64_t bytes_of(const std::shared_ptr<const CutOuts>& cuts)
{
    if (!cuts) return 0;
    std::uint64_t total = cuts->texture.size() * (sizeof(cuts->texture[0]) + sizeof(cuts->image[0]));
    for (const CutOut& cut : cuts->images) total += cut.alpha.pixels.size() * sizeof(float);
    return total;
}

} // namespace

Geometry::Geometry(std::vector<Object> objects, const Vec3& near) : state_(std::make_shared<const State>(std::move(objects), near)) {}

const std::vector<Object>& Geometry::objects() const { return *state_->objects; }

std::uint64_t Geometry::bytes() const { return state_->bytes(); }

Vec3 first_origin(const Scene& scene)
{
    return light_frame(scene.lights.empty() ? scene.light : scene.lights.front().light).origin;
}

Geometry view_of(const Scene& scene)
{
    return Geometry(std::make_shared<const Geometry::State>(&scene.objects, first_origin(scene)));
}

bool Geometry::State::any(bool Object::*role) const
{
    return std::any_of(objects->begin(), objects->end(), [role](const Object& object) { return object.*role; });
}

bool Geometry::State::any_seen(bool Object::*role) const
{
    return std::any_of(objects->begin(), objects->end(), [role](const Object& object) { return object.*role && object.seen; });
}

bool Geometry::State::any_mesh(bool Object::*role) const
{
    return std::any_of(objects->begin(), objects->end(), [role](const Object& object) { return object.*role && !object.seen; });
}

std::vector<std::shared_ptr<const DepthImage>> Geometry::State::images(bool Object::*role,
                                                                       const std::shared_ptr<const opencl::LateContext>& device) const
{
    const std::lock_guard lock(fitting_);
    images_.resize(objects->size());
    surfaces_.resize(objects->size());
    std::vector<std::shared_ptr<const DepthImage>> result;
    for (std::size_t i = 0; i < objects->size(); ++i) {
        const Object& object = (*objects)[i];
        if (!(object.*role) || !object.seen) continue;
        if (!images_[i]) {
            const SeenSurface& seen = *object.seen;
            opencl::Work work(device ? device : std::make_shared<const opencl::LateContext>(""));
            const DepthFit fit = fit_depth(work, seen.depth, seen.camera);
            images_[i] = std::make_shared<const DepthImage>(depth_image(fit, seen.camera, seen.thickness));
            surfaces_[i] = std::make_shared<const DepthSurface>(depth_surface(fit, seen.camera));
        }
        result.push_back(images_[i]);
    }
    return result;
}

std::shared_ptr<const DepthSurface> Geometry::State::surface_of_same(const DepthMap& depth, const Camera& camera) const
{
    const std::lock_guard lock(fitting_);
    const auto same_frame = [](const Frame& a, const Frame& b) { return a.origin == b.origin && a.x == b.x && a.y == b.y && a.z == b.z; };
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
        if (!surfaces_[i]) continue;
        const SeenSurface& seen = *(*objects)[i].seen;
        const DepthMap& own = seen.depth;
        const bool same_camera = same_frame(seen.camera.frame, camera.frame) && seen.camera.half_extent == camera.half_extent && seen.camera.off_axis == camera.off_axis && seen.camera.orthographic == camera.orthographic;
        if (same_camera && own.width == depth.width && own.height == depth.height && own.noise == depth.noise && own.depth == depth.depth) return surfaces_[i];
    }
    return nullptr;
}

std::vector<std::pair<std::size_t, DepthQuality>> Geometry::State::qualities(bool Object::*role) const
{
    const std::lock_guard lock(fitting_);
    std::vector<std::pair<std::size_t, DepthQuality>> result;
    for (std::size_t i = 0; i < images_.size(); ++i)
        if (images_[i] && (*objects)[i].*role) result.emplace_back(i, images_[i]->quality);
    return result;
}

std::uint64_t Geometry::State::bytes() const
{
    std::uint64_t total = 0;
    for (const Object& object : *objects)
        total += bytes_of(object.mesh.cut_outs) + (object.seen ? object.seen->depth.depth.size() * sizeof(float) : 0) + object.mesh.positions.size() * sizeof(Imath::V3f) + object.mesh.triangles.size() * sizeof(std::array<std::uint32_t, 3>);
    const std::lock_guard lock(building_);
    if (casters_) total += casters_->bytes();
    if (receivers_ && receivers_ != casters_) total += receivers_->bytes();
    if (topology_) total += topology_->bytes();
    const std::lock_guard fitting(fitting_);
    for (const auto& image : images_)
        if (image) total += image->bytes();
    for (const auto& surface : surfaces_)
        if (surface) total += surface->points.size() * (2 * sizeof(DepthVector) + sizeof(float));
    return total;
}

std::shared_ptr<const Topology> Geometry::State::topology() const
{
    const std::lock_guard lock(building_);
    if (topology_) return topology_;
    std::vector<const TriangleMesh*> meshes;
    for (const Object& object : *objects)
        if (object.casts) meshes.push_back(&object.mesh);
    return topology_ = std::make_shared<const Topology>(meshes);
}

std::shared_ptr<const Tracer> Geometry::State::tracer(bool Object::*role, std::shared_ptr<const Tracer>& slot) const
{
    const std::lock_guard lock(building_);
    if (slot) return slot;
    const bool same = std::all_of(objects->begin(), objects->end(), [](const Object& object) { return object.casts == object.receives; });
    if (same && casters_) return slot = casters_;
    if (same && receivers_) return slot = receivers_;

    std::vector<const TriangleMesh*> meshes;
    for (const Object& object : *objects)
        if (object.*role) meshes.push_back(&object.mesh);
    return slot = std::make_shared<const Tracer>(meshes, near);
}

} // namespace penumbra
