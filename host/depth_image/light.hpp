// A light as a depth image's camera sees it, for kernels.
#pragma once

#include <penumbra/scene.hpp>

#include "common/depth_walk.h"
#include "opencl/work.hpp"
#include "depth_image/depth_image.hpp"

namespace penumbra {

// The light's place in the coordinates of `image`, and how receivers come there from those of `receivers`. The caller sets the rest.
DepthLight depth_light(const Light& light, const Camera& image, const Camera& receivers);

// Clips the visibility of receivers at their own planes. Of a textured light nothing but what lies wholly below.
//
//   points      [height][width] in the camera's coordinates, as DepthSurface has them; or `depth`, planar, in their place
//   normals     [height][width] towards the camera; 0: not clipped
//   visibility  [height][width][channels], or [listed_count][channels] of the pixels that are listed
struct Horizon {
    const Light& light;
    Camera camera;
    int width, height;
    cl::Buffer points, depth, normals;
    cl::Buffer listed = {}; // uint y width + x; none: all pixels
    std::size_t listed_count = 0;
};
// `program`: any that has horizon.cl, as every technique's on the device does.
void clip_at_horizon(opencl::Work& work, const opencl::Specialisation& program, const Horizon& horizon, int channels, const cl::Buffer& visibility);

} // namespace penumbra
