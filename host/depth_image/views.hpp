// What a camera sees of depth images.
#pragma once

#include "depth_image/depth_image.hpp"

namespace penumbra {

// How points of one camera's coordinates come into another's: 3 rows of 4.
void set_transform(float (&to_from)[12], const Camera& to, const Camera& from);

// Adds to maps of the camera's view, of one size, what it sees of the image: each pixel's first surface where that is nearer than `front` has,
// and where that body ends where that is further than `back` has.
void add_view(opencl::Work& work, const DepthImage& image, const Camera& camera, DepthMap& front, DepthMap& back);

// The program of depth_trace.cl, on a device of so many lanes.
opencl::Specialisation depth_trace_program(int lanes);

} // namespace penumbra
