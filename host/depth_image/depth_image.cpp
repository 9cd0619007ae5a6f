#include "depth_image/depth_image.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "depth_image/thickness.hpp"
#include "scene/parallel.hpp"

namespace penumbra {
namespace {

DepthView view_of(const Camera& camera, int width, int height)
{
    DepthView view{};
    view.width = width;
    view.height = height;
    view.pixel_x = static_cast<float>(2 * camera.half_extent.x / width);
    view.pixel_y = static_cast<float>(2 * camera.half_extent.y / height);
    view.middle_x = static_cast<float>((1 - camera.off_axis.x / camera.half_extent.x) * width / 2);
    view.middle_y = static_cast<float>((1 + camera.off_axis.y / camera.half_extent.y) * height / 2);
    view.orthographic = camera.orthographic;
    int offset = 0;
    for (int level = 0; level < DEPTH_LEVELS; ++level) {
        const int side = DEPTH_BLOCK(level), columns = (width + side - 1) / side, rows = (height + side - 1) / side;
        view.level_width[level] = columns;
        view.level_offset[level] = offset;
        offset += columns * rows;
    }
    view.blocks = offset;
    return view;
}

// The greatest and the least value that a line can meet in each block of each level.
void build_pyramid(DepthImage& image)
{
    const DepthView& view = image.view;
    const auto blocks = static_cast<std::size_t>(view.blocks);
    image.nearest.assign(2 * blocks, 0.f);
    std::fill(image.nearest.begin() + view.blocks, image.nearest.end(), std::numeric_limits<float>::max());
    const auto block = [&](int level, int x, int y) {
        const int side = DEPTH_BLOCK(level);
        return static_cast<std::size_t>(view.level_offset[level]) +
               static_cast<std::size_t>(y / side) * static_cast<std::size_t>(view.level_width[level]) + static_cast<std::size_t>(x / side);
    };
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            const DepthPixel& pixel = image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x)];
            if (!(pixel.value > 0)) continue;
            // The front's highest corner; more by what float32 may lose.
            const float half = .5f * (std::abs(pixel.slope_x) + std::abs(pixel.slope_y));
            const float highest = (pixel.value + half) * (1 + 0x1p-20f);
            // The back's lowest corner; what it may be off counts, too.
            const float lowest = pixel.value - half - pixel.back - 2 * pixel.slack - 0x1p-20f * pixel.value;
            for (int level = 0; level < DEPTH_LEVELS; ++level) {
                float& nearest = image.nearest[block(level, x, y)];
                float& furthest = image.nearest[blocks + block(level, x, y)];
                nearest = std::max(nearest, highest);
                furthest = std::min(furthest, lowest);
            }
        }
    image.view.nearest = *std::max_element(image.nearest.begin(), image.nearest.begin() + view.blocks);
}

// How far behind a surface its back lies, in value.
float back_of(const DepthView& view, float value, float thickness)
{
    return view.orthographic ? thickness : value - 1 / (1 / value + thickness);
}

} // namespace

DepthImage depth_image(const DepthFit& fit, const Camera& camera, double thickness, const DepthMap* back)
{
    DepthImage image{.camera = camera, .view = view_of(camera, fit.width, fit.height), .pixels = {}, .nearest = {}, .quality = fit.quality};
    image.view.far = static_cast<float>(fit.far);
    image.pixels.resize(fit.value.size());
    const std::vector<float> guessed = thickness > 0 ? std::vector<float>{} : thickness_of(fit);
    parallel_for(fit.height, [&](int y) {
        for (int x = 0; x < fit.width; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!fit.there[i] || fit.mixed[i]) continue;
            const float value = fit.value[i];
            float thick = thickness > 0 ? static_cast<float>(thickness) : guessed[i];
            if (back && std::isfinite(back->depth[i]) && back->depth[i] > fit.depth(i)) thick = back->depth[i] - fit.depth(i);
            image.pixels[i] = {.value = value,
                               .slope_x = fit.slope_x[i],
                               .slope_y = fit.slope_y[i],
                               .back = back_of(image.view, value, thick),
                               .slack = fit.error(i) + 1e-6f * value,
                               .joint = 2.5f * (std::abs(fit.slope_x[i]) + std::abs(fit.slope_y[i])) + 4e-3f * value,
                               .unused_0 = 0,
                               .unused_1 = 0};
        }
    });
    build_pyramid(image);
    return image;
}

Vec3 world_from_camera(const Camera& camera, const Vec3& p)
{
    return camera.frame.origin + camera.frame.x * p.x + camera.frame.y * p.y - camera.frame.z * p.z;
}

Vec3 direction_from_world(const Camera& camera, const Vec3& d)
{
    return {d.dot(camera.frame.x), d.dot(camera.frame.y), -d.dot(camera.frame.z)};
}

Vec3 camera_from_world(const Camera& camera, const Vec3& point) { return direction_from_world(camera, point - camera.frame.origin); }

// Whether one camera's pixels are the other's receivers, all but for the rounding of how its place was written.
bool same_place(const Camera& a, const Camera& b)
{
    const Frame &p = a.frame, &q = b.frame;
    return (p.origin - q.origin).length() <= 1e-6 * (1 + p.origin.length()) && (p.z - q.z).length() < 1e-6 && (p.y - q.y).length() < 1e-6;
}

namespace {

// By how much of a pixel's footprint (times the sine of the angle of view) receivers are lifted: planes over larger windows lose larger folds, and
// those that stand in for ramps lose what five pixels' windows do. Measured: less lets noisy surfaces sink into the true meshes, more loses contact.
double lift_of(const DepthFit& fit) { return .3 * std::max(fit.quality.reach, fit.quality.smeared ? 5 : 0); }

} // namespace

DepthSurface depth_surface(const DepthFit& fit, const Camera& camera)
{
    DepthSurface surface{.width = fit.width, .height = fit.height, .camera = camera, .points = {}, .normals = {}, .depth = {}, .quality = fit.quality};
    surface.points.resize(fit.value.size());
    surface.normals.resize(fit.value.size());
    surface.depth.assign(fit.value.size(), nothing_there);
    const double px = fit.pixel_x, py = fit.pixel_y, lift = lift_of(fit);
    parallel_for(fit.height, [&](int y) {
        for (int x = 0; x < fit.width; ++x) {
            const std::size_t i = fit.index(x, y);
            if (!fit.shaded[i]) continue;
            // The pixel's ray: tangents, or lengths of an orthographic camera.
            const double tx = (x + .5 - fit.width / 2.) * px + camera.off_axis.x, ty = (fit.height / 2. - y - .5) * py + camera.off_axis.y, value = fit.value[i];
            // value = a + b tx + c ty on the plane.
            const double b = fit.slope_x[i] / px, c = -fit.slope_y[i] / py, z = fit.depth(i);
            Vec3 normal, ray, point;
            if (fit.orthographic) {
                normal = Vec3(-b, -c, -1).normalized(); // z + b x + c y = constant
                ray = {0, 0, 1};
                point = {tx, ty, z};
            } else {
                normal = (-Vec3(b, c, value - b * tx - c * ty)).normalized();
                ray = Vec3(tx, ty, 1).normalized();
                point = Vec3(tx, ty, 1) * z;
            }
            const double cosine = std::min(std::abs(normal.dot(ray)), 1.), sine = std::sqrt(std::max(0., 1 - cosine * cosine));
            const double footprint = fit.orthographic ? py : z * py;
            const double error = fit.error(i) * (fit.orthographic ? 1 : z * z);
            point += normal * (lift * footprint * sine + error * cosine + 1e-5 * z);
            surface.points[i] = {static_cast<float>(point.x), static_cast<float>(point.y), static_cast<float>(point.z)};
            surface.normals[i] = {static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z)};
            surface.depth[i] = static_cast<float>(point.z);
        }
    });
    return surface;
}

} // namespace penumbra
