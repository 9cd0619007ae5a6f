// Depth images of a Tracer's triangles.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

#include <penumbra/error.hpp>

#include "scene/fine_depth.hpp"
#include "scene/parallel.hpp"
#include "trace/crossings.hpp"
#include "trace/outlines.hpp"

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

// The maps of a request in its order: front, back, layers.
std::vector<DepthMap*> maps_of(TracedViews& views, const ViewRequest& request, int width, int height)
{
    std::vector<DepthMap*> maps;
    if (request.front) maps.push_back(&views.front);
    if (request.back) maps.push_back(&views.back);
    views.layers.resize(static_cast<std::size_t>(request.layers));
    for (DepthMap& layer : views.layers) maps.push_back(&layer);
    for (DepthMap* map : maps) *map = empty_map(width, height);
    return maps;
}

// What map number `map` shows of a ray; null: nothing.
const Crossing* shown(const std::vector<Crossing>& crossings, const ViewRequest& request, std::size_t map)
{
    if (crossings.empty()) return nullptr;
    if (request.front && map-- == 0) return &crossings.front();
    if (request.back && map-- == 0) {
        const auto last = std::find_if(crossings.rbegin(), crossings.rend(), [](const Crossing& c) { return c.leaves; });
        return last == crossings.rend() ? nullptr : &*last;
    }
    const std::size_t surface = map + static_cast<std::size_t>(request.first_layer);
    return surface < crossings.size() ? &crossings[surface] : nullptr;
}

// The pixels in which something begins or ends, of any map.
std::vector<std::size_t> cut_pixels(const std::vector<Outlines>& outlines, int width, int height, double gap)
{
    std::vector<std::vector<std::size_t>> rows(static_cast<std::size_t>(height));
    parallel_for(height, [&](int y) {
        for (int x = 0; x < width; ++x)
            if (!std::ranges::all_of(outlines, [&](const Outlines& one) { return one.is_whole(x, y, gap); }))
                rows[static_cast<std::size_t>(y)].push_back(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    });
    std::vector<std::size_t> pixels;
    for (const auto& row : rows) pixels.insert(pixels.end(), row.begin(), row.end());
    return pixels;
}

// Samples of those pixels for every map.
void add_fine(const Tracer::Impl& scene, const Camera& camera, const ViewRequest& request, const std::vector<DepthMap*>& maps, const std::vector<Outlines>& outlines)
{
    const int width = maps.front()->width, height = maps.front()->height;
    const std::vector<std::size_t> pixels = cut_pixels(outlines, width, height, request.gap);
    if (pixels.empty()) return;
    const double texels = static_cast<double>(maps.front()->depth.size());
    const int side = std::min(request.fine, static_cast<int>(std::sqrt(request.fine_share * texels / static_cast<double>(pixels.size()))));
    if (side < 2) return;

    auto blocks = std::make_shared<std::vector<std::int32_t>>(maps.front()->depth.size(), -1);
    for (std::size_t block = 0; block < pixels.size(); ++block) (*blocks)[pixels[block]] = static_cast<std::int32_t>(block);
    std::vector<std::shared_ptr<FineDepth>> fine;
    for (DepthMap* map : maps) {
        fine.push_back(std::make_shared<FineDepth>(FineDepth{.side = side, .blocks = blocks}));
        fine.back()->depth.assign(pixels.size() * fine.back()->block_size(), nothing_there);
        map->fine = fine.back();
    }
    constexpr std::size_t together = 64; // blocks
    parallel_for(static_cast<int>((pixels.size() + together - 1) / together), [&](int group) {
        std::vector<Crossing> crossings;
        const std::size_t first = static_cast<std::size_t>(group) * together;
        for (std::size_t block = first; block < std::min(first + together, pixels.size()); ++block) {
            const int x = static_cast<int>(pixels[block] % static_cast<std::size_t>(width)) * side, y = static_cast<int>(pixels[block] / static_cast<std::size_t>(width)) * side;
            for (int i = 0; i < side * side; ++i) {
                find_crossings(scene, view_ray(scene, camera, width * side, height * side, x + i % side, y + i / side), crossings);
                for (std::size_t m = 0; m < maps.size(); ++m)
                    if (const Crossing* const crossing = shown(crossings, request, m)) fine[m]->depth[block * fine[m]->block_size() + static_cast<std::size_t>(i)] = world_depth(scene, *crossing);
            }
        }
    });
}

} // namespace

TracedViews Tracer::views(const Camera& camera, int width, int height, const ViewRequest& request) const
{
    if (request.layers < 0) throw Error(ErrorCode::usage, "depth layers: the count is " + std::to_string(request.layers), "expected 0 or more");
    TracedViews result;
    const std::vector<DepthMap*> maps = maps_of(result, request, width, height);
    if (request.normals) result.normals.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), DepthVector{0, 0, 0});
    const bool fine = request.fine > 1;
    std::vector<Outlines> outlines;
    if (fine) outlines.assign(maps.size(), Outlines(camera, width, height));
    for_each_pixel(*impl_, camera, width, height, [&](int x, int y, const std::vector<Crossing>& crossings) {
        const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
        if (request.normals) result.normals[at] = normal_of(*impl_, crossings.front(), camera);
        for (std::size_t i = 0; i < maps.size(); ++i) {
            const Crossing* const crossing = shown(crossings, request, i);
            if (!crossing) continue;
            maps[i]->depth[at] = world_depth(*impl_, *crossing);
            if (fine) outlines[i].set(x, y, maps[i]->depth[at], normal_of(*impl_, *crossing, camera));
        }
    });
    if (fine && !maps.empty()) add_fine(*impl_, camera, request, maps, outlines);
    return result;
}

} // namespace penumbra
