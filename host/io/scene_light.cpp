#include <array>

#include "io/image_io.hpp"
#include "io/scene_parts.hpp"
#include "scene/light_space.hpp"

namespace penumbra {

namespace {

template <class AxisLight> void read_axes(const JsonObject& section, AxisLight& light)
{
    if (const auto direction = section.find("direction")) light.direction = direction->vec3();
    if (const auto up = section.find("up")) light.up = up->vec3();
}

Light read_rectangle(const JsonObject& section, const Resources& resources)
{
    section.allow_only({"kind", "center", "half_u", "half_v", "emission"}, "of a rectangle");
    RectangleLight light{section.need("center").vec3(), section.need("half_u").vec3(), section.need("half_v").vec3(), {}};
    // What the geometry has to say comes before an image is decoded.
    validate(Light(light));
    if (const auto emission = section.find("emission"))
        light.emission = decode_image(load_bytes(*emission, resources), emission->key() + ": " + emission->text(), resources.max_samples());
    return light;
}

Light read_sphere(const JsonObject& section)
{
    section.allow_only({"kind", "center", "radius", "direction", "up"}, "of a sphere");
    SphereLight light;
    light.center = section.need("center").vec3();
    light.radius = section.need("radius").number();
    read_axes(section, light);
    return light;
}

Light read_point(const JsonObject& section)
{
    section.allow_only({"kind", "center", "direction", "up"}, "of a point");
    PointLight light;
    light.center = section.need("center").vec3();
    read_axes(section, light);
    return light;
}

Light read_directional(const JsonObject& section)
{
    section.allow_only({"kind", "direction", "up", "angular_diameter_deg"}, "of a directional light");
    DirectionalLight light;
    light.angular_diameter_deg = section.need("angular_diameter_deg").number();
    read_axes(section, light);
    return light;
}

} // namespace

Light parse_light(const JsonValue& value, const Resources& resources)
{
    constexpr std::array<std::string_view, 4> kinds{"rectangle", "sphere", "point", "directional"};
    const JsonObject section(value);
    Light light;
    switch (section.need("kind").choice(kinds)) {
    case 0:
        light = read_rectangle(section, resources);
        break;
    case 1:
        light = read_sphere(section);
        break;
    case 2:
        light = read_point(section);
        break;
    default:
        light = read_directional(section);
        break;
    }
    validate(light);
    return light;
}

} // namespace penumbra
