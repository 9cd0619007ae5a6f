// Depth images of a Tracer's triangles.
#include <algorithm>
#include <cmath>
#include <iterator>

#include <penumbra/error.hpp>

#include "scene/parallel.hpp"
#include "trace/crossings.hpp"

namespace penumbra {
namespace {

DepthMap empty_map(int width, int height)
{
    if (width < 1 || height < 1)
        throw Error(ErrorCode::usage, "depth map: the size is " + std::to_string(width) + " x " + std::to_string(height),
                    "expected at least 1 x 1");
    DepthMap map{.width = width, .height = height, .depth = {}};
    map.depth.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), nothing_there);
    return map;
}

// Calls visit(x, y, crossings) for every pixel that sees something.
template <class Visit> void for_each_pixel(const Tracer::Impl& scene, const Camera& camera, int width, int height, const Visit& visit)
{
    parallel_for(height, [&](int y) {
        std::vector<Crossing> crossings;
        for (int x = 0; x < width; ++x) {
            find_crossings(scene, view_ray(scene, camera, width, height, x, y), crossings);
            if (!crossings.empty()) visit(x, y, crossings);
        }
    });
}

float world_depth(const Tracer::Impl& scene, const Crossing& crossing) { return static_cast<float>(crossing.depth / scene.scale); }

// Of the crossing's triangle, towards the camera and in its coordinates.
DepthVector normal_of(const Tracer::Impl& scene, const Crossing& crossing, const Camera& camera)
{
    const Vec3 a = scene.corner(crossing.triangle, 0);
    const Vec3 outward = (scene.corner(crossing.triangle, 1) - a).cross(scene.corner(crossing.triangle, 2) - a).normalized();
    const Vec3 normal = crossing.leaves ? -outward : outward;
    return {static_cast<float>(normal.dot(camera.frame.x)), static_cast<float>(normal.dot(camera.frame.y)), static_cast<float>(-normal.dot(camera.frame.z))};
}

} // namespace

DepthMap Tracer::front(const Camera& camera, int width, int height, std::vector<DepthVector>* normals) const
{
    DepthMap map = empty_map(width, height);
    if (normals) normals->assign(map.depth.size(), DepthVector{0, 0, 0});
    for_each_pixel(*impl_, camera, width, height, [&](int x, int y, const std::vector<Crossing>& crossings) {
        map.at(x, y) = world_depth(*impl_, crossings.front());
        if (normals) (*normals)[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] = normal_of(*impl_, crossings.front(), camera);
    });
    return map;
}

DepthMap Tracer::back(const Camera& camera, int width, int height) const
{
    DepthMap map = empty_map(width, height);
    for_each_pixel(*impl_, camera, width, height, [&](int x, int y, const std::vector<Crossing>& crossings) {
        const auto last = std::find_if(crossings.rbegin(), crossings.rend(), [](const Crossing& c) { return c.leaves; });
        if (last != crossings.rend()) map.at(x, y) = world_depth(*impl_, *last);
    });
    return map;
}

std::vector<DepthMap> Tracer::layers(const Camera& camera, int width, int height, int count) const
{
    if (count < 0) throw Error(ErrorCode::usage, "depth layers: the count is " + std::to_string(count), "expected 0 or more");
    std::vector<DepthMap> maps(static_cast<std::size_t>(count), empty_map(width, height));
    for_each_pixel(*impl_, camera, width, height, [&](int x, int y, const std::vector<Crossing>& crossings) {
        for (std::size_t i = 0; i < std::min(maps.size(), crossings.size()); ++i) maps[i].at(x, y) = world_depth(*impl_, crossings[i]);
    });
    return maps;
}

} // namespace penumbra
