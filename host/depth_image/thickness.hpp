// How thick the bodies of a depth image may be, guessed from their silhouettes.
#pragma once

#include <cstdint>
#include <vector>

#include "depth_image/fit.hpp"

namespace penumbra {

// For each pixel the distance in pixels from its centre to that of the nearest pixel that is marked; infinity when there is none
// (Felzenszwalb and Huttenlocher 2012, Distance Transforms of Sampled Functions, exact).
std::vector<float> distance_to(const std::vector<std::uint8_t>& marked, int width, int height);

// The radius of the largest disc that lies inside the silhouette and covers the pixel (local thickness: Hildebrand and Ruegsegger 1997), in
// pixels. `distance`: to the nearest silhouette pixel. Radii grow by 6 % and half a pixel at least, to 160.
std::vector<float> local_thickness(const std::vector<float>& distance, int width, int height);

// The values of a membrane that spans the silhouette's values and is free elsewhere: Laplace's equation over pixels that are joined to their
// neighbours. A plane stays a plane. To 1e-4 of the thickness it gives.
std::vector<float> membrane(const DepthFit& fit, const std::vector<std::uint8_t>& silhouette);

// Thickness in scene units: the larger of .2 round and the smaller of round and 2 mirrored, and half a pixel. 0 for pixels that cast nothing.
//   round     a body of revolution: footprint x 2 sqrt(distance (2 radius - distance))
//   mirrored  twice the depth from the pixel to the membrane: a ball closes as it opened, a plate gets none
std::vector<float> thickness_of(const DepthFit& fit);

} // namespace penumbra
