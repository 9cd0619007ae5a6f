#include "io/image_io.hpp"
#include "io/scene_check.hpp"
#include "io/scene_parts.hpp"
#include "scene/light_space.hpp"

namespace penumbra {

namespace {

template <class AxisLight> void read_axes(const JsonObject& section, AxisLight& light)
{
    if (const auto direction = section.find("direction")) light.direction = direction->vec3();
    if (const auto up = section.find("up")) light.up = up->vec3();
}

Image read_emission(const JsonValue& name, const Resources& resources)
{
    const Bytes bytes = load_bytes(name, resources);
    return under(name, [&] { return decode_image(bytes, name.text(), resources.max_samples()); });
}

// The images of a sequence, which together may be as large as one image.
std::vector<Image> read_frames(const JsonValue& list, const Resources& resources)
{
    const std::vector<JsonValue> names = list.elements();
    std::vector<Image> frames;
    std::uint64_t samples = 0;
    for (const JsonValue& name : names) {
        frames.push_back(read_emission(name, resources));
        samples += frames.back().pixels.size();
        if (samples > resources.max_samples())
            throw Error::at(ErrorCode::too_large, list.key(),
                            "has " + std::to_string(samples) + " samples in its first " + std::to_string(frames.size()) + " images",
                            "the limit is " + std::to_string(resources.max_samples()) + " in all");
    }
    return frames;
}

Light read_rectangle(const JsonObject& section, const Resources& resources)
{
    RectangleLight light{section.need("center").vec3(), section.need("half_u").vec3(), section.need("half_v").vec3(), {}};
    // What the geometry has to say comes before an image is decoded.
    validate(Light(light), section.value().key());
    const auto emission = section.find("emission");
    if (emission && emission->json().is_array())
        light.frames = read_frames(*emission, resources);
    else if (emission)
        light.emission = read_emission(*emission, resources);
    return light;
}

Light read_sphere(const JsonObject& section)
{
    SphereLight light;
    light.center = section.need("center").vec3();
    light.radius = section.need("radius").number();
    read_axes(section, light);
    return light;
}

Light read_point(const JsonObject& section)
{
    PointLight light;
    light.center = section.need("center").vec3();
    read_axes(section, light);
    return light;
}

Light read_directional(const JsonObject& section)
{
    DirectionalLight light;
    light.angular_diameter_deg = section.need("angular_diameter_deg").number();
    read_axes(section, light);
    return light;
}

} // namespace

Light parse_light(const JsonValue& value, const Resources& resources, bool listed)
{
    const scene_file::Object& description = listed ? scene_file::listed_light() : scene_file::light();
    const std::size_t kind = kind_index(value, description);
    const JsonObject section = checked(value, description.forms[kind]);
    const auto read = [&]() -> Light {
        switch (kind) {
        case 0:
            return read_rectangle(section, resources);
        case 1:
            return read_sphere(section);
        case 2:
            return read_point(section);
        default:
            return read_directional(section);
        }
    };
    Light light = read();
    validate(light, value.key());
    return light;
}

} // namespace penumbra
