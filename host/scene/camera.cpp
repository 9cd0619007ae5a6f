#include "scene/camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <penumbra/error.hpp>

namespace penumbra {
namespace {

// The box of what casts or receives, as the light sees it.
struct LightBox {
    Imath::Box3d box;    // in light space
    Vec2 tangent{0, 0};  // largest |x / z| and |y / z| of what lies before the light
    bool crosses = false; // a triangle reaches through the light's plane
};

struct Weighted {
    double tangent, weight;
};

// What a view is fitted to, of the tangents of an image's pixels: all but the outermost half a per cent by weight, where stray pixels lie.
double most_of(std::vector<Weighted>& tangents)
{
    std::sort(tangents.begin(), tangents.end(), [](const Weighted& a, const Weighted& b) { return a.tangent < b.tangent; });
    double left = 0;
    for (const Weighted& one : tangents) left += one.weight;
    left *= .995;
    for (const Weighted& one : tangents) {
        left -= one.weight;
        if (left <= 0) return one.tangent;
    }
    return tangents.back().tangent;
}

// From this tangent on (63 degrees) a fitted view is kept to what casts: surfaces that run into the light's plane would take all its texels.
constexpr double wide_view = 2;

// The tangents that hold what casts on seen points, from the points alone: a shadow map of coarse bins of equal angles, in which a point lies in
// shadow when it is further than all that the nine bins around it show first. Points weigh what the light would send them: the cosine at the light
// over the square of the distance, so that a background far away or beside the light counts for little. Widened by the penumbra. 0: nothing casts.
Vec2 casting_tangents(const std::vector<Vec3>& points, const LightFrame& light)
{
    constexpr int bins = 128;
    constexpr double behind = 1.02;
    const auto bin_of = [](double tangent) {
        return std::clamp(static_cast<int>((std::atan(tangent) / std::numbers::pi + .5) * bins), 0, bins - 1);
    };
    const auto at = [](int x, int y) { return static_cast<std::size_t>(y) * bins + static_cast<std::size_t>(x); };
    std::vector<double> first(std::size_t{bins} * bins, 0); // 0: empty
    for (const Vec3& p : points) {
        double& z = first[at(bin_of(p.x / p.z), bin_of(p.y / p.z))];
        z = z == 0 ? p.z : std::min(z, p.z);
    }
    std::vector<Weighted> tangents_x, tangents_y;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& p : points) {
        const int x = bin_of(p.x / p.z), y = bin_of(p.y / p.z);
        double furthest = 0;
        for (int j = std::max(y - 1, 0); j <= std::min(y + 1, bins - 1); ++j)
            for (int i = std::max(x - 1, 0); i <= std::min(x + 1, bins - 1); ++i) furthest = std::max(furthest, first[at(i, j)]);
        if (!(p.z > behind * furthest)) continue;
        nearest = std::min(nearest, first[at(x, y)]);
        const double distance = p.length(), weight = p.z / (distance * distance * distance);
        tangents_x.push_back({std::abs(p.x / p.z), weight});
        tangents_y.push_back({std::abs(p.y / p.z), weight});
    }
    if (tangents_x.empty()) return {0, 0};
    const double bin = std::numbers::pi / bins;
    const auto widened = [&](double t, double half) { return std::tan(std::min(std::atan(t) + 2 * bin, 1.4)) + half / nearest; };
    return {widened(most_of(tangents_x), light.half_u), widened(most_of(tangents_y), light.half_v)};
}

// The same of a depth image's pixels. What lies behind the light's plane or all but in it is left out: what is not on the map casts no shadow,
// and shading counts who sees past its border.
void add_seen(LightBox& result, const LightFrame& light, const SeenSurface& seen)
{
    std::vector<Weighted> x, y;
    std::vector<Vec3> points;
    for (int row = 0; row < seen.depth.height; ++row)
        for (int column = 0; column < seen.depth.width; ++column) {
            const double depth = seen.depth.at(column, row);
            if (!std::isfinite(depth) || !(depth > 0)) continue;
            const Vec3 p = light_from_world(light, world_point(seen.camera, seen.depth.width, seen.depth.height, column + .5, row + .5, depth));
            result.box.extendBy(p);
            if (!(p.z > 0)) continue;
            x.push_back({std::abs(p.x / p.z), 1});
            y.push_back({std::abs(p.y / p.z), 1});
            points.push_back(p);
        }
    if (x.empty()) return;
    Vec2 tangent(most_of(x), most_of(y));
    if (std::max(tangent.x, tangent.y) > wide_view) {
        const Vec2 casting = casting_tangents(points, light);
        const Vec2 most = casting.x > 0 || casting.y > 0 ? casting : Vec2(wide_view, wide_view);
        tangent = {std::min(tangent.x, most.x), std::min(tangent.y, most.y)};
    }
    result.tangent = {std::max(result.tangent.x, tangent.x), std::max(result.tangent.y, tangent.y)};
}

// What reaches through the light's plane spans any field of view: its tangents count up to this.
constexpr double widest = 8;

void add_mesh(LightBox& result, const LightFrame& light, const Object& object, const std::vector<Ground>& grounds)
{
    for (const auto& triangle : object.mesh.triangles) {
        if (in_ground(grounds, object.mesh, triangle)) continue;
        Vec3 corner[3];
        int before = 0;
        for (int i = 0; i < 3; ++i) {
            corner[i] = light_from_world(light, Vec3(object.mesh.positions[triangle[static_cast<std::size_t>(i)]]));
            before += corner[i].z > 0;
            result.box.extendBy(corner[i]);
        }
        // What lies wholly behind the light matters to nobody.
        if (before == 0) continue;
        if (before < 3) {
            result.crosses = true;
            result.tangent = {std::max(result.tangent.x, widest), std::max(result.tangent.y, widest)};
            continue;
        }
        for (const Vec3& c : corner)
            result.tangent = {std::max(result.tangent.x, std::abs(c.x / c.z)), std::max(result.tangent.y, std::abs(c.y / c.z))};
    }
}

LightBox light_box(const LightFrame& light, const std::vector<Object>& objects, const LeftOut& left_out)
{
    LightBox result;
    for (const Object& object : objects) {
        if ((!object.casts && !object.receives) || left_out.holds(object)) continue;
        if (object.seen) add_seen(result, light, *object.seen);
        add_mesh(result, light, object, left_out.grounds);
    }
    return result;
}

bool is_empty(const LightBox& fit) { return fit.tangent.x == 0 && fit.tangent.y == 0; }

// One texel wider on every side, so that what lies on the border is inside; never flat.
Vec2 with_margin(const Vec2& half, int width, int height)
{
    const double larger = std::max(half.x, half.y);
    const Vec2 wide(std::max(half.x, larger * 1e-3), std::max(half.y, larger * 1e-3));
    return {wide.x * (1 + 2.0 / width), wide.y * (1 + 2.0 / height)};
}

Camera fit_sun(const LightCamera& spec, const LightFrame& light, const std::vector<Object>& objects, const LeftOut& left_out,
               int width, int height, std::string_view where)
{
    const LightBox whole = light_box(light, objects, {}), part = light_box(light, objects, left_out);
    LightBox fit = part.box.isEmpty() ? whole : part;
    // Depths count from before everything, on the map or not.
    fit.box.min.z = whole.box.min.z;
    fit.box.max.z = whole.box.max.z;
    if (!spec.half_extent && fit.box.isEmpty())
        throw Error::at(ErrorCode::invalid_input, std::string(where) + ".half_extent", "is missing and there are no objects to fit it to",
                        "expected two positive lengths");

    Vec3 center = spec.center.value_or(Vec3(0, 0, 0));
    if (!spec.center && !fit.box.isEmpty()) {
        // Before everything, by a thousandth of the box's depth, so that every depth is positive.
        const Vec3 middle = fit.box.center();
        const double depth = fit.box.max.z - fit.box.min.z;
        const double step = std::max({depth, fit.box.max.x - fit.box.min.x, fit.box.max.y - fit.box.min.y}) * 1e-3;
        center = light.u * middle.x + light.v * middle.y + light.direction * (fit.box.min.z - step);
    }
    Vec2 half = spec.half_extent.value_or(Vec2(0, 0));
    if (!spec.half_extent) {
        const Vec3 c = light_from_world(light, center);
        const Vec2 reach(std::max(fit.box.max.x - c.x, c.x - fit.box.min.x), std::max(fit.box.max.y - c.y, c.y - fit.box.min.y));
        half = with_margin(reach, width, height);
    }
    return light_camera(light, half, center);
}

Camera fit_light(const LightCamera& spec, const LightFrame& light, const std::vector<Object>& objects, const LeftOut& left_out,
                 int width, int height, std::string_view where)
{
    if (spec.tan_half_fov) return light_camera(light, *spec.tan_half_fov, light.origin);

    const std::string key = std::string(where) + ".tan_half_fov";
    LightBox fit = light_box(light, objects, left_out);
    if (is_empty(fit)) fit = light_box(light, objects, {});
    if (fit.crosses) {
        const LightBox less = light_box(light, objects, {.receivers = true, .grounds = grounds_of(light, objects)});
        if (!is_empty(less)) fit = less;
    }
    if (is_empty(fit))
        throw Error::at(ErrorCode::invalid_input, key, "is missing and there is nothing before the light to fit it to",
                        "expected two positive tangents");
    return light_camera(light, with_margin(fit.tangent, width, height), light.origin);
}

} // namespace

Camera light_camera(const LightFrame& light, const Vec2& half_extent, const Vec3& center)
{
    return {.frame = {.origin = center, .x = light.u, .y = light.v, .z = -light.direction},
            .orthographic = light.directional,
            .half_extent = half_extent};
}

Camera pinhole_view(const PinholeCamera& pinhole, int width, int height)
{
    Camera camera{.frame = pinhole.frame, .orthographic = false, .half_extent = pinhole.tan_half_fov, .off_axis = {0, 0}};
    if (const auto& k = pinhole.intrinsics) {
        camera.half_extent = {width / (2 * k->fx), height / (2 * k->fy)};
        camera.off_axis = {(width / 2. - k->cx) / k->fx, (k->cy - height / 2.) / k->fy};
    } else if (camera.half_extent.x == 0) {
        camera.half_extent.x = camera.half_extent.y * pinhole.pixel_aspect * width / height;
    }
    camera.off_axis += camera.half_extent * pinhole.shift * 2.;
    return camera;
}

Camera part_of_view(const Camera& camera, int of_width, int of_height, int x, int y, int width, int height)
{
    const Vec3 middle = camera_point(camera, of_width, of_height, x + width / 2., y + height / 2., 1);
    Camera part = camera;
    part.half_extent = {camera.half_extent.x * width / of_width, camera.half_extent.y * height / of_height};
    part.off_axis = {middle.x, middle.y};
    return part;
}

Camera resolve_camera(const CameraSpec& spec, const Light& light, const std::vector<Object>& objects, int width, int height,
                      std::string_view where, const LeftOut& left_out)
{
    Camera camera;
    if (const auto* pinhole = std::get_if<PinholeCamera>(&spec)) {
        camera = pinhole_view(*pinhole, width, height);
    } else {
        const LightFrame frame = light_frame(light);
        const auto& of_light = std::get<LightCamera>(spec);
        camera = frame.directional ? fit_sun(of_light, frame, objects, left_out, width, height, where)
                                   : fit_light(of_light, frame, objects, left_out, width, height, where);
    }
    validate(camera, where);
    return camera;
}

void validate(const Camera& camera, std::string_view where)
{
    const Frame& f = camera.frame;
    // Matrices arrive as decimal text or float32: 1e-4 is well above both, and bends an image by less than a pixel in 8192.
    const double tolerance = 1e-4;
    const double lengths = std::max({std::abs(f.x.length() - 1), std::abs(f.y.length() - 1), std::abs(f.z.length() - 1)});
    const double angles = std::max({std::abs(f.x.dot(f.y)), std::abs(f.y.dot(f.z)), std::abs(f.z.dot(f.x))});
    const double handed = (f.x.cross(f.y) - f.z).length();
    if (!(lengths < tolerance && angles < tolerance && handed < 4 * tolerance))
        throw Error::at(ErrorCode::invalid_input, std::string(where) + ".world_from_camera", "is not a rigid right-handed frame",
                        "expected orthogonal axes of length 1, no scale, no mirroring");
    if (!std::isfinite(f.origin.x) || !std::isfinite(f.origin.y) || !std::isfinite(f.origin.z))
        throw Error::at(ErrorCode::invalid_input, std::string(where), "the camera's position is not finite", "expected finite numbers");
    for (const double half : {camera.half_extent.x, camera.half_extent.y})
        // A tangent of 1e4 is 89.99 degrees; nearer to 90 a point's depth is lost in its distance.
        if (!(half > 0) || !(half <= (camera.orthographic ? std::numeric_limits<double>::max() : 1e4)))
            throw Error::at(ErrorCode::invalid_input, std::string(where) + (camera.orthographic ? ".half_extent" : ".tan_half_fov"),
                            "is " + std::to_string(half),
                            camera.orthographic ? "expected positive finite numbers: a camera needs a field of view"
                                                : "expected numbers above 0 and up to 10000: a camera needs a field of view of less than 180 degrees");
    if (!std::isfinite(camera.off_axis.x) || !std::isfinite(camera.off_axis.y))
        throw Error::at(ErrorCode::invalid_input, std::string(where), "the image's middle is not at a finite angle", "expected finite numbers");
}

Vec3 camera_point(const Camera& camera, int width, int height, double x_px, double y_px, double depth)
{
    const double spread = camera.orthographic ? 1 : depth;
    const double x = ((2 * x_px / width - 1) * camera.half_extent.x + camera.off_axis.x) * spread;
    const double y = ((1 - 2 * y_px / height) * camera.half_extent.y + camera.off_axis.y) * spread;
    return {x, y, depth};
}

Vec3 world_point(const Camera& camera, int width, int height, double x_px, double y_px, double depth)
{
    const Vec3 p = camera_point(camera, width, height, x_px, y_px, depth);
    return camera.frame.origin + camera.frame.x * p.x + camera.frame.y * p.y - camera.frame.z * p.z;
}

Projected project(const Camera& camera, int width, int height, const Vec3& world)
{
    const Vec3 p = world - camera.frame.origin;
    const double depth = -p.dot(camera.frame.z);
    const double spread = camera.orthographic ? 1 : depth;
    const double x = p.dot(camera.frame.x) / spread - camera.off_axis.x, y = p.dot(camera.frame.y) / spread - camera.off_axis.y;
    return {.x_px = (x / camera.half_extent.x + 1) / 2 * width,
            .y_px = (1 - y / camera.half_extent.y) / 2 * height,
            .depth = depth};
}

Imath::Box3d bounds(const TriangleMesh& mesh)
{
    Imath::Box3d box;
    for (const auto& p : mesh.positions) box.extendBy(Vec3(p));
    return box;
}

} // namespace penumbra
