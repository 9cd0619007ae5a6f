// The lights of a scene: one, or a list of them with names and weights; and sequences of emission.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <penumbra/error.hpp>
#include <penumbra/scene.hpp>

namespace penumbra {

// Throws invalid_input, naming the key, for a list that is too long, names that are no names or stand twice, weights that are negative, not
// finite or all 0.
void validate_names(std::span<const SceneLight> lights);

// Throws invalid_input for sequences of different lengths.
void validate_frames(std::span<const SceneLight> lights);

// Throws invalid_input for depth seen from one light that several share.
void validate_occluders(const Scene& scene);

// All that the lights of a scene have to agree in: validate_names, each light by itself, the frames of their sequences, and that what
// several lights share is not seen from one of them. A scene with one light passes when that light does.
void validate_lights(const Scene& scene);

// The error of a light by itself, in the words of a list: the path "light.center" becomes "lights[2].center", "occluders" (of its own)
// "lights[2].occluders"; what is about neither, nor about receivers or objects, has its place in "lights[2]".
Error in_list(const Error& error, std::size_t index, bool own_occluders);

} // namespace penumbra
