// Small scenes to build others from.
#pragma once

#include <cmath>

#include "io/support.hpp"

namespace penumbra::test {

inline const std::string rectangle =
    R"("light": {"kind": "rectangle", "center": [0, 6, 0], "half_u": [0.5, 0, 0], "half_v": [0, 0, -0.5]})";
inline const std::string point = R"("light": {"kind": "point", "center": [0, 6, 0]})";
inline const std::string sun = R"("light": {"kind": "directional", "angular_diameter_deg": 0.53})";
inline const std::string quad = R"("objects": [{"quad": {"center": [0, 0, 0], "half_u": [4, 0, 0], "half_v": [0, 0, -4]}}])";

inline std::string scene_of(const std::string& members) { return "{\"penumbra\": 1, " + members + "}"; }

// depth.exr 4 x 3 float32, all 2; wide.exr 5 x 3; byte.png and short.png 4 x 3 grey; light.exr RGB; alpha.exr RGBA; black.exr; half.exr.
inline MemoryResources parts()
{
    MemoryResources resources;
    resources.parts["depth.exr"] = encode_image(constant(4, 3, 2), {"exr", 32});
    resources.parts["wide.exr"] = encode_image(constant(5, 3, 2), {"exr", 32});
    resources.parts["half.exr"] = encode_image(constant(4, 3, 2), {"exr", 16});
    resources.parts["empty.exr"] = encode_image(constant(4, 3, INFINITY), {"exr", 32});
    resources.parts["byte.png"] = encode_image(constant(4, 3, 0.5f), {"png", 8});
    resources.parts["short.png"] = encode_image(constant(4, 3, 0.5f), {"png", 16});
    resources.parts["light.exr"] = encode_image(ramp(2, 2, 3), {"exr", 32});
    resources.parts["alpha.exr"] = encode_image(ramp(2, 2, 4), {"exr", 32});
    resources.parts["black.exr"] = encode_image(constant(2, 2, 0), {"exr", 32});
    resources.parts["negative.exr"] = encode_image(constant(2, 2, -1), {"exr", 32});
    resources.parts["broken.exr"] = bytes_of("not an image");
    return resources;
}

inline Scene parse(const std::string& json)
{
    static const MemoryResources resources = parts();
    return parse_scene(json, resources);
}

// A scene with these members in its light, and so on.
inline std::string with_light(const std::string& light) { return "\"light\": " + light + ", " + quad; }
inline std::string with_object(const std::string& object) { return rectangle + ", \"objects\": [" + object + "]"; }
inline std::string with_occluders(const std::string& members) { return rectangle + ", \"occluders\": {" + members + "}"; }
inline std::string with_receivers(const std::string& members) { return rectangle + ", \"receivers\": {" + members + "}"; }
inline std::string with_camera(const std::string& camera) { return with_receivers("\"depth\": \"depth.exr\", \"camera\": " + camera); }

} // namespace penumbra::test
