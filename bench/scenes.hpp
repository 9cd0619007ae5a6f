// The scenes that are measured. The light shines down from (0, 8, 0) onto the plane y = 0, eight units below.
#pragma once

#include <cstdint>
#include <string>

#include <penumbra/penumbra.hpp>

namespace penumbra::bench {

struct SceneOptions {
    double light_side = 1;         // width and height of the square light
    double height = 3;             // of the occluder's centre above the plane; the light is at 8
    double sideways = 0;           // of the occluder's centre from under the light's centre, along x
    int occluder_resolution = 128; // texels along a side of the occluder map
    int receiver_resolution = 512;
};

enum class Occluder { square, bunny, horse };
const char* name(Occluder occluder);

// The Soft Shadow Maps paper's set-up: one occluder over a plane, both maps from the light (tan of its half angle 0.5). The square is
// parallel to the light with sides of 2; bunny and horse (package glmark2-data) are scaled to fit a cube of side 2.
Scene paper_scene(Occluder occluder, const SceneOptions& options);

// The same with another mesh, and a mesh of a file scaled to fit.
Scene paper_scene(const std::string& name, TriangleMesh mesh, const SceneOptions& options);
TriangleMesh fitted_mesh(const std::string& path);

// A closed ball of radius 0.9 to 1.1 with eight bumps each way: 4 rings (rings - 1) triangles.
TriangleMesh bumpy_ball(std::uint32_t rings);

} // namespace penumbra::bench
