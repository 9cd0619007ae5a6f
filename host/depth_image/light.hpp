// A light as a depth image's camera sees it, for kernels.
#pragma once

#include <penumbra/scene.hpp>

#include "common/depth_walk.h"
#include "opencl/work.hpp"
#include "depth_image/depth_image.hpp"

namespace penumbra {

// The light's place in the coordinates of `image`, and how receivers come there from those of `receivers`. The caller sets the rest.
DepthLight depth_light(const Light& light, const Camera& image, const Camera& receivers);

// Clips the visibility of receivers on fitted surfaces at their own planes. `visibility`: [height][width][channels] on the device.
void clip_at_horizon(opencl::Work& work, const Light& light, const DepthSurface& surface, int channels, const cl::Buffer& visibility);

// The program of horizon.cl.
opencl::Specialisation horizon_program();

} // namespace penumbra
