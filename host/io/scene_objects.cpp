#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>

#include "io/image_io.hpp"
#include "io/mesh_io.hpp"
#include "io/scene_check.hpp"
#include "io/scene_parts.hpp"
#include "scene/camera.hpp"
#include "scene/object_placement.hpp"

namespace penumbra {

namespace {

// Counter-clockwise seen from the side that cross(half_u, half_v) points to.
TriangleMesh read_quad(const JsonValue& value)
{
    const JsonObject section = checked(value, scene_file::quad());
    const Vec3 center = section.need("center").vec3(), u = section.need("half_u").vec3(), v = section.need("half_v").vec3();
    // Positions become float32: half-edges closer to parallel than its 24 bits can tell have no area for certain.
    if (!(u.normalized().cross(v.normalized()).length() > 0x1p-20))
        throw value.error("has no area: half_u and half_v are zero or parallel");

    TriangleMesh mesh;
    for (const Vec3& corner : {center - u - v, center + u - v, center + u + v, center - u + v}) mesh.positions.emplace_back(corner);
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

// The error of a reader that is not ours, which tells files by the paths that it was given, with the names that the scene has for them.
Error with_names(const Error& error, const std::string& path, const std::string& name)
{
    std::string message = error.message();
    const std::string folder = path.ends_with(name) ? path.substr(0, path.size() - name.size()) : std::string();
    for (std::size_t at = 0; folder.size() > 1 && (at = message.find(folder, at)) != std::string::npos;) message.erase(at, folder.size());
    return {error.code(), std::move(message), error.hint()};
}

SeenSurface read_depth_surface(const JsonObject& section, const Light& light, const Resources& resources,
                                std::vector<std::string>& warnings)
{
    const JsonValue name = checked_choice(section, scene_file::object().forms[scene_file::depth_form]);
    const auto given = section.find("encoding");
    SeenDepth seen = load_whole_depth({name, section.has("position")}, given ? parse_encoding(*given) : MapEncoding{}, section.need("camera"), light, resources,
                                      warnings);
    const auto thickness = section.find("thickness");
    const bool given_thickness = thickness && thickness->json().is_number();
    return {.depth = std::move(seen.map), .camera = seen.camera, .thickness = given_thickness ? thickness->number() : 0};
}

ObjectPlacement placement_of(const JsonObject& section)
{
    const auto scale = section.find("scale"), rotate = section.find("rotate_deg"), translate = section.find("translate");
    const Vec3 r = rotate ? rotate->vec3() * (std::numbers::pi / 180) : Vec3(0, 0, 0);
    return {.scale = scale ? scale->number() : 1,
            .cosine = {std::cos(r.x), std::cos(r.y), std::cos(r.z)},
            .sine = {std::sin(r.x), std::sin(r.y), std::sin(r.z)},
            .translation = translate ? translate->vec3() : Vec3(0, 0, 0)};
}

// A file that the mesh names: where `files` says that it lies, else beside the mesh, or among the parts of the request.
std::string place_of(const std::string& named, const std::string& mesh, const std::optional<JsonValue>& files)
{
    if (!files) return (std::filesystem::path(mesh).parent_path() / named).string();
    if (const auto file = JsonObject(*files).find(named)) return file->text();
    throw Error(ErrorCode::not_found, "`files` of the mesh has no such name");
}

TriangleMesh read_mesh_file(const JsonObject& section, const Resources& resources, std::vector<std::string>& warnings)
{
    const JsonValue name = section.need("mesh");
    const std::string file = name.text();
    const auto weld = section.find("weld"), files = section.find("files");
    MeshOptions options{.placement = placement_of(section), .weld = weld ? weld->number() : 0, .companion = {}};
    options.max_samples = resources.max_samples();
    options.warnings = &warnings;
    options.companion = [&](const std::string& other) {
        const std::string path = resources.path(place_of(other, file, files));
        return Bytes(read_file(path, path));
    };
    return under(name, [&] {
        const std::string path = resources.path(file);
        try {
            return read_mesh(path, file, options);
        } catch (const Error& error) {
            throw with_names(error, path, file);
        }
    });
}

bool within_largest(float length) { return std::abs(length) <= static_cast<float>(scene_file::largest); } // false: NaN

void place(TriangleMesh& mesh, const JsonObject& section)
{
    const ObjectPlacement placement = placement_of(section);
    for (Imath::V3f& position : mesh.positions) {
        position = Imath::V3f(placement.placed(Vec3(position)));
        if (!within_largest(position.x) || !within_largest(position.y) || !within_largest(position.z))
            throw section.value().error("has positions beyond 1e12", "scale and translate are too large, or its file's unit is very small");
    }
}

// The camera moves with its surfaces and its depth grows with the scale; `thickness` is a length in the scene already.
void place(SeenSurface& seen, const JsonObject& section)
{
    const ObjectPlacement placement = placement_of(section);
    Frame& frame = seen.camera.frame;
    frame = {.origin = placement.placed(frame.origin), .x = placement.turned(frame.x), .y = placement.turned(frame.y), .z = placement.turned(frame.z)};
    if (placement.scale == 1) return;
    const auto scale = static_cast<float>(placement.scale);
    // As the corners of a mesh do, depths end in one point when they are too small for float32.
    for (float& depth : seen.depth.depth) {
        if (std::isfinite(depth) && !within_largest(depth * scale))
            throw section.value().error("has depths beyond 1e12", "scale is too large");
        depth = std::max(depth * scale, std::numeric_limits<float>::min());
    }
    if (seen.camera.orthographic) {
        seen.camera.half_extent *= placement.scale;
        seen.camera.off_axis *= placement.scale;
    }
    seen.depth.step.depth *= placement.scale;
    seen.depth.step.disparity /= placement.scale;
    seen.depth.step.unit *= placement.scale;
}

} // namespace

penumbra::Object parse_object(const JsonValue& value, const Light& light, const Resources& resources, std::vector<std::string>& warnings)
{
    using namespace scene_file;
    const JsonObject given(value);
    const int kinds = given.has("mesh") + given.has("quad") + given.has("depth") + given.has("position");
    if (kinds != 1) throw value.error("has " + std::to_string(kinds) + " of mesh, quad, depth and position, expected exactly one");
    const ObjectForm form = given.has("mesh") ? mesh_form : given.has("quad") ? quad_form : depth_form;
    const JsonObject section = checked(value, scene_file::object().forms[form]);

    penumbra::Object object;
    if (const auto casts = section.find("casts")) object.casts = casts->flag();
    if (const auto receives = section.find("receives")) object.receives = receives->flag();
    if (form == depth_form) {
        object.name = section.need(section.has("depth") ? "depth" : "position").text();
        object.seen = read_depth_surface(section, light, resources, warnings);
        place(*object.seen, section);
    } else {
        object.name = section.has("mesh") ? section.need("mesh").text() : "quad";
        if (section.has("mesh")) {
            object.mesh = read_mesh_file(section, resources, warnings);
        } else {
            object.mesh = read_quad(section.need("quad"));
            place(object.mesh, section);
        }
    }
    return object;
}

} // namespace penumbra
