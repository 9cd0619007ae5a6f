#include <array>

#include "io/image_io.hpp"
#include "io/scene_parts.hpp"
#include "scene/light_space.hpp"
#include "scene/lights.hpp"

namespace penumbra {

namespace {

// The keys of a light of one kind; of one in a list, those of its place there as well.
std::vector<std::string_view> keys(std::initializer_list<std::string_view> own, bool listed)
{
    std::vector<std::string_view> known(own);
    if (listed) known.insert(known.end(), {"name", "weight", "occluders"});
    return known;
}

template <class AxisLight> void read_axes(const JsonObject& section, AxisLight& light)
{
    if (const auto direction = section.find("direction")) light.direction = direction->vec3();
    if (const auto up = section.find("up")) light.up = up->vec3();
}

Image read_emission(const JsonValue& name, const Resources& resources)
{
    return decode_image(load_bytes(name, resources), name.key() + ": " + name.text(), resources.max_samples());
}

// The images of a sequence, which together may be as large as one image.
std::vector<Image> read_frames(const JsonValue& list, const Resources& resources)
{
    const std::vector<JsonValue> names = list.elements();
    if (names.empty() || names.size() > max_frames)
        throw list.error("has " + std::to_string(names.size()) + " images", "expected 1 to " + std::to_string(max_frames));
    std::vector<Image> frames;
    std::uint64_t samples = 0;
    for (const JsonValue& name : names) {
        frames.push_back(read_emission(name, resources));
        samples += frames.back().pixels.size();
        if (samples > resources.max_samples())
            throw Error(ErrorCode::too_large,
                        list.key() + ": has " + std::to_string(samples) + " samples in its first " + std::to_string(frames.size()) +
                            " images",
                        "the limit is " + std::to_string(resources.max_samples()) + " in all");
    }
    return frames;
}

Light read_rectangle(const JsonObject& section, const Resources& resources, bool listed)
{
    section.allow_only(keys({"kind", "center", "half_u", "half_v", "emission"}, listed), "of a rectangle");
    RectangleLight light{section.need("center").vec3(), section.need("half_u").vec3(), section.need("half_v").vec3(), {}};
    // What the geometry has to say comes before an image is decoded.
    validate(Light(light));
    const auto emission = section.find("emission");
    if (emission && emission->json().is_array())
        light.frames = read_frames(*emission, resources);
    else if (emission)
        light.emission = read_emission(*emission, resources);
    return light;
}

Light read_sphere(const JsonObject& section, bool listed)
{
    section.allow_only(keys({"kind", "center", "radius", "direction", "up"}, listed), "of a sphere");
    SphereLight light;
    light.center = section.need("center").vec3();
    light.radius = section.need("radius").number();
    read_axes(section, light);
    return light;
}

Light read_point(const JsonObject& section, bool listed)
{
    section.allow_only(keys({"kind", "center", "direction", "up"}, listed), "of a point");
    PointLight light;
    light.center = section.need("center").vec3();
    read_axes(section, light);
    return light;
}

Light read_directional(const JsonObject& section, bool listed)
{
    section.allow_only(keys({"kind", "direction", "up", "angular_diameter_deg"}, listed), "of a directional light");
    DirectionalLight light;
    light.angular_diameter_deg = section.need("angular_diameter_deg").number();
    read_axes(section, light);
    return light;
}

} // namespace

Light parse_light(const JsonValue& value, const Resources& resources, bool listed)
{
    constexpr std::array<std::string_view, 4> kinds{"rectangle", "sphere", "point", "directional"};
    const JsonObject section(value);
    const auto read = [&]() -> Light {
        switch (section.need("kind").choice(kinds)) {
        case 0:
            return read_rectangle(section, resources, listed);
        case 1:
            return read_sphere(section, listed);
        case 2:
            return read_point(section, listed);
        default:
            return read_directional(section, listed);
        }
    };
    try {
        Light light = read();
        validate(light);
        return light;
    } catch (const Error& error) {
        // validate() says "light"; the readers know the key.
        if (!error.message().starts_with("light.")) throw;
        throw Error(error.code(), value.key() + error.message().substr(std::string_view("light").size()), error.hint());
    }
}

} // namespace penumbra
