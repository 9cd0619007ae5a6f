#include <cfloat>
#include <cmath>
#include <numbers>

#include "io/scene_check.hpp"
#include "io/scene_parts.hpp"
#include "scene/camera.hpp"

namespace penumbra {

namespace {

bool is_finite(const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

CameraSpec read_light_camera(const JsonObject& section, bool directional)
{
    LightCamera camera;
    if (directional) {
        if (const auto half = section.find("half_extent")) camera.half_extent = half->positive_pair();
        if (const auto center = section.find("center")) camera.center = center->vec3();
        return camera;
    }
    if (const auto tangents = section.find("tan_half_fov")) camera.tan_half_fov = tangents->positive_pair();
    return camera;
}

// Gram-Schmidt, so that a matrix with few digits becomes a rotation. What is one up to a few roundings of its nine products stays as it is,
// bit for bit: written scenes read back equal.
void orthonormalize(Frame& frame)
{
    const double off = std::max({std::abs(frame.x.dot(frame.x) - 1), std::abs(frame.y.dot(frame.y) - 1), std::abs(frame.z.dot(frame.z) - 1),
                                 std::abs(frame.x.dot(frame.y)), std::abs(frame.y.dot(frame.z)), std::abs(frame.z.dot(frame.x))});
    if (off <= 16 * DBL_EPSILON) return;
    frame.z = frame.z.normalized();
    frame.x = (frame.x - frame.z * frame.x.dot(frame.z)).normalized();
    frame.y = frame.z.cross(frame.x);
}

// The angles' rest: a lens in their place, and how the image is shifted.
void read_lens(const JsonObject& section, PinholeCamera& camera)
{
    if (const auto lens = section.find("intrinsics")) {
        const JsonObject k = checked(*lens, scene_file::intrinsics());
        camera.intrinsics = {k.need("fx").number(), k.need("fy").number(), k.need("cx").number(), k.need("cy").number()};
    }
    if (const auto shift = section.find("shift")) {
        const std::vector<double> by = shift->numbers(2);
        camera.shift = {by[0], by[1]};
    }
}

PinholeCamera read_matrix(const JsonObject& section)
{
    const JsonValue matrix = section.need("world_from_camera");
    const std::vector<double> m = matrix.numbers(16);
    if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
        throw matrix.error("ends in the row " + nlohmann::json({m[12], m[13], m[14], m[15]}).dump() + ", expected [0, 0, 0, 1]",
                           "row-major, for column vectors: the translation is in elements 3, 7 and 11");
    PinholeCamera camera{{{m[3], m[7], m[11]}, {m[0], m[4], m[8]}, {m[1], m[5], m[9]}, {m[2], m[6], m[10]}},
                         {1, 1}};
    const JsonValue angles = checked_choice(section, scene_file::camera().forms[scene_file::matrix_camera_form]);
    if (section.has("tan_half_fov")) camera.tan_half_fov = angles.positive_pair();
    read_lens(section, camera);
    validate(Camera{camera.frame, false, camera.tan_half_fov}, section.value().key());
    orthonormalize(camera.frame);
    return camera;
}

PinholeCamera read_look_at(const JsonObject& section)
{
    const Vec3 eye = section.need("eye").vec3();
    const JsonValue target = section.need("target");
    const Vec3 away = eye - target.vec3();
    if (away == Vec3(0, 0, 0)) throw target.error("is where eye is, expected another point");
    const auto given_up = section.find("up");
    const Vec3 up = given_up ? given_up->vec3() : Vec3(0, 1, 0);
    if (up == Vec3(0, 0, 0)) throw given_up->error("has no length");

    PinholeCamera camera;
    camera.frame.origin = eye;
    camera.frame.z = away.normalized();
    const Vec3 right = up.normalized().cross(camera.frame.z);
    // Within 2^-20 of parallel the image's roll would hang on the last few of the 24 bits of a float32 direction.
    if (!(right.length() > 0x1p-20))
        throw(given_up ? *given_up : section.value())
            .error("up and the line from eye to target are parallel", "give an up across the view, such as [0, 0, -1]");
    camera.frame.x = right.normalized();
    camera.frame.y = camera.frame.z.cross(camera.frame.x);
    if (!is_finite(camera.frame.x) || !is_finite(camera.frame.y) || !is_finite(camera.frame.z))
        throw section.value().error("eye, target and up are too far apart for the view to be computed");

    read_lens(section, camera);
    const JsonValue fov = checked_choice(section, scene_file::camera().forms[scene_file::looking_camera_form]);
    if (camera.intrinsics) return camera;
    const double degrees = fov.number();
    camera.tan_half_fov = {0, std::tan(degrees * std::numbers::pi / 360)}; // x: from the image's aspect ratio
    if (!(camera.tan_half_fov.y > 0)) throw fov.expected("an angle that is not all but 0");
    return camera;
}

} // namespace

CameraSpec parse_camera(const JsonValue& value, const Light& light)
{
    using namespace scene_file;
    const std::vector<Form>& forms = camera().forms;
    const JsonObject section(value);
    if (kind_index(value, camera()) == 0) {
        const bool sun = std::holds_alternative<DirectionalLight>(light);
        return read_light_camera(checked(value, forms[sun ? sun_camera_form : light_camera_form]), sun);
    }
    if (section.has("world_from_camera")) return read_matrix(checked(value, forms[matrix_camera_form]));
    if (!section.has("eye"))
        throw value.error("is a pinhole without eye or world_from_camera",
                          "eye, target, up and vertical_fov_deg; or world_from_camera and tan_half_fov");
    return read_look_at(checked(value, forms[looking_camera_form]));
}

} // namespace penumbra
