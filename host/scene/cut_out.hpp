// What is cut out of a surface by an image (leaves, fences).
#pragma once

#include <penumbra/scene.hpp>

namespace penumbra {

// The image's value at texture coordinates, 0 to 1 for images of that range; between texels as `cut` says.
float alpha_at(const CutOut& cut, const Imath::V2f& at);

// Whether the surface is there: the image shows `cutoff` or more.
inline bool is_there(const CutOut& cut, const Imath::V2f& at) { return alpha_at(cut, at) >= cut.cutoff; }

} // namespace penumbra
