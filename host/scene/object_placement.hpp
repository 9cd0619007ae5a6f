// Where an object stands: scale, then rotations about X, Y and Z, then translation.
#pragma once

#include <penumbra/scene.hpp>

namespace penumbra {

struct ObjectPlacement {
    double scale = 1;
    Vec3 cosine{1, 1, 1}, sine{0, 0, 0}; // of the angle about each axis
    Vec3 translation{0, 0, 0};

    Vec3 turned(Vec3 p) const
    {
        p = {p.x, cosine.x * p.y - sine.x * p.z, sine.x * p.y + cosine.x * p.z};
        p = {cosine.y * p.x + sine.y * p.z, p.y, cosine.y * p.z - sine.y * p.x};
        return {cosine.z * p.x - sine.z * p.y, sine.z * p.x + cosine.z * p.y, p.z};
    }
    Vec3 placed(const Vec3& p) const { return turned(p * scale) + translation; }
};

} // namespace penumbra
