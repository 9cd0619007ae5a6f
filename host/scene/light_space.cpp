#include "scene/light_space.hpp"

#include <cmath>
#include <numbers>

#include <penumbra/error.hpp>

#include "scene/lights.hpp"

namespace penumbra {
namespace {

constexpr double degree = std::numbers::pi / 180;

[[noreturn]] void reject(std::string path, std::string what, std::string expected)
{
    throw Error::at(ErrorCode::invalid_input, std::move(path), std::move(what), std::move(expected));
}

bool finite(const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// Within 8 degrees of the Y axis the default up is -Z (docs/scene_file.md, light).
Vec3 default_up(const Vec3& direction) { return std::abs(direction.y) > std::cos(8 * degree) ? Vec3(0, 0, -1) : Vec3(0, 1, 0); }

void set_axes(LightFrame& frame, const Vec3& direction, const std::optional<Vec3>& up)
{
    frame.direction = direction.normalized();
    frame.u = frame.direction.cross(up ? up->normalized() : default_up(frame.direction)).normalized();
    frame.v = frame.u.cross(frame.direction);
}

// Any direction perpendicular to `axis`, downwards as far as that goes.
Vec3 downwards_from(const Vec3& axis)
{
    const Vec3 down = std::abs(axis.y) > std::cos(8 * degree) ? Vec3(0, 0, -1) : Vec3(0, -1, 0);
    return (down - axis * axis.dot(down)).normalized();
}

LightFrame frame_of(const RectangleLight& light)
{
    LightFrame frame;
    frame.origin = light.center;
    frame.half_u = light.half_u.length();
    frame.half_v = light.half_v.length();

    // An edge of no length leaves its axis open: the light then shines downwards as far as the other edge lets it.
    if (frame.half_u == 0 && frame.half_v == 0) {
        set_axes(frame, Vec3(0, -1, 0), std::nullopt);
    } else if (frame.half_v == 0) {
        frame.u = light.half_u.normalized();
        frame.direction = downwards_from(frame.u);
        frame.v = frame.u.cross(frame.direction);
    } else if (frame.half_u == 0) {
        frame.v = light.half_v.normalized();
        frame.direction = downwards_from(frame.v);
        frame.u = frame.direction.cross(frame.v);
    } else {
        frame.u = light.half_u.normalized();
        frame.direction = light.half_v.cross(light.half_u).normalized();
        frame.v = frame.u.cross(frame.direction);
    }
    return frame;
}

void validate_axes(const Vec3& direction, const std::optional<Vec3>& up, const std::string& at)
{
    if (!finite(direction) || direction.length() == 0)
        reject(at + ".direction", "has no length", "expected a finite vector that is not zero");
    if (!up) return;
    if (!finite(*up) || up->length() == 0) reject(at + ".up", "has no length", "expected a finite vector that is not zero");
    // Below this sine the side axis would be rounding noise: both inputs carry up to 2^-53 relative error.
    if (direction.normalized().cross(up->normalized()).length() < 1e-6)
        reject(at + ".up", "is parallel to " + at + ".direction", "expected a vector that points away from it");
}

void validate_emission(const Image& image, const std::string& key)
{
    if (image.channels != 1 && image.channels != 3)
        reject(key, "has " + std::to_string(image.channels) + " channels", "expected 1 or 3, no alpha");
    bool light_somewhere = false;
    for (const float e : image.pixels) {
        if (!std::isfinite(e) || e < 0) reject(key, "has a pixel of " + std::to_string(e), "expected finite values, 0 or more");
        light_somewhere |= e > 0;
    }
    if (!light_somewhere) reject(key, "is black", "expected at least one pixel above 0");
}

void validate(const RectangleLight& light, const std::string& at)
{
    if (!finite(light.center)) reject(at + ".center", "is not finite", "expected three finite numbers");
    if (!finite(light.half_u)) reject(at + ".half_u", "is not finite", "expected three finite numbers");
    if (!finite(light.half_v)) reject(at + ".half_v", "is not finite", "expected three finite numbers");
    const double lengths = light.half_u.length() * light.half_v.length();
    const double cosine = lengths > 0 ? std::abs(light.half_u.dot(light.half_v)) / lengths : 0;
    if (cosine > 1e-5)
        reject(at + ".half_v", "is not orthogonal to " + at + ".half_u (the cosine between them is " + std::to_string(cosine) + ")",
               "expected half-edges at a right angle, cosine at most 0.00001");
    if (light.emission && !light.frames.empty()) reject(at + ".emission", "is an image and a sequence", "expected one of the two");
    if (!light.emission && light.frames.empty()) return;
    if (light.half_u.length() == 0 || light.half_v.length() == 0)
        reject(at + ".emission", "the rectangle has no area", "expected half_u and half_v that are not zero, or no emission");
    if (light.emission) validate_emission(*light.emission, at + ".emission");
    if (light.frames.size() > max_frames)
        reject(at + ".emission", "has " + std::to_string(light.frames.size()) + " frames",
               "expected at most " + std::to_string(max_frames));
    for (std::size_t i = 0; i < light.frames.size(); ++i) {
        const std::string key = at + ".emission[" + std::to_string(i) + "]";
        validate_emission(light.frames[i], key);
        if (light.frames[i].channels != light.frames[0].channels)
            reject(key, "has " + std::to_string(light.frames[i].channels) + " channels",
                   "expected " + std::to_string(light.frames[0].channels) + ", as the first frame has");
    }
}

void validate(const SphereLight& light, const std::string& at)
{
    if (!finite(light.center)) reject(at + ".center", "is not finite", "expected three finite numbers");
    if (!std::isfinite(light.radius) || light.radius < 0)
        reject(at + ".radius", "is " + std::to_string(light.radius), "expected 0 or more, finite");
    validate_axes(light.direction, light.up, at);
}

void validate(const PointLight& light, const std::string& at)
{
    if (!finite(light.center)) reject(at + ".center", "is not finite", "expected three finite numbers");
    validate_axes(light.direction, light.up, at);
}

void validate(const DirectionalLight& light, const std::string& at)
{
    validate_axes(light.direction, light.up, at);
    if (!std::isfinite(light.angular_diameter_deg) || light.angular_diameter_deg < 0 || light.angular_diameter_deg >= 180)
        reject(at + ".angular_diameter_deg", "is " + std::to_string(light.angular_diameter_deg), "expected 0 or more and below 180");
}

} // namespace

LightFrame light_frame(const Light& light)
{
    if (const auto* rectangle = std::get_if<RectangleLight>(&light)) return frame_of(*rectangle);

    LightFrame frame;
    if (const auto* sphere = std::get_if<SphereLight>(&light)) {
        frame.origin = sphere->center;
        frame.half_u = frame.half_v = sphere->radius;
        frame.shape = LightShape::disc;
        set_axes(frame, sphere->direction, sphere->up);
    } else if (const auto* point = std::get_if<PointLight>(&light)) {
        frame.origin = point->center;
        set_axes(frame, point->direction, point->up);
    } else {
        const auto& sun = std::get<DirectionalLight>(light);
        frame.half_u = frame.half_v = std::tan(sun.angular_diameter_deg / 2 * degree);
        frame.shape = LightShape::disc;
        frame.directional = true;
        set_axes(frame, sun.direction, sun.up);
    }
    return frame;
}

std::string kind_of(const Light& light)
{
    static const char* const kinds[] = {"rectangle", "sphere", "point", "directional"};
    return kinds[light.index()];
}

void validate(const Light& light, std::string_view where)
{
    std::visit([where](const auto& l) { validate(l, std::string(where)); }, light);
}

Vec3 light_from_world(const LightFrame& light, const Vec3& point)
{
    const Vec3 p = point - light.origin;
    return {p.dot(light.u), p.dot(light.v), p.dot(light.direction)};
}

} // namespace penumbra
