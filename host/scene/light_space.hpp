// Light space: origin at the light's centre, x along u, y along v, z along the direction of shining (left-handed, since u x v points
// against the light). A pinhole at the centre with half-angle tangents (tx, ty) sees (x, y, z) at (xi, eta) = (x / (z tx), y / (z ty))
// and at disparity d = 1 / z.
#pragma once

#include <string>
#include <string_view>

#include <penumbra/scene.hpp>

namespace penumbra {

enum class LightShape { rectangle, disc };

// A light reduced to what shadow geometry needs. A point light has zero extent; a directional light has extents in tangents of angles.
struct LightFrame {
    Vec3 origin{0, 0, 0};
    Vec3 u{1, 0, 0}, v{0, 0, -1}, direction{0, -1, 0}; // orthonormal
    double half_u = 0, half_v = 0;                     // half the width and height; the radius, twice, for a disc
    LightShape shape = LightShape::rectangle;
    bool directional = false;
};

LightFrame light_frame(const Light& light);

std::string kind_of(const Light& light); // "rectangle", "sphere", "point", "directional"

// Throws invalid_input with the path of the key, that of the light being `where`: extents that are not finite, half-edges not orthogonal
// (their cosine beyond 1e-5), negative radius, no direction, up along direction, angular diameter outside [0, 180), emission of the wrong
// kind.
void validate(const Light& light, std::string_view where = "light");

Vec3 light_from_world(const LightFrame& light, const Vec3& point);

} // namespace penumbra
