// Made by `penumbra_describe_scene --cpp` from the description of the scene file.
#pragma once

#include <array>
#include <string_view>

namespace penumbra::client::detail {

// Where a scene names files; [] is each element of a list, {} each member of a table.
inline constexpr std::array<std::string_view, 16> file_places{
    "light.emission",
    "light.emission[]",
    "lights[].emission",
    "lights[].emission[]",
    "lights[].occluders.depth.front",
    "lights[].occluders.depth.back",
    "lights[].occluders.depth.layers[]",
    "objects[].mesh",
    "objects[].files{}",
    "objects[].depth",
    "objects[].position",
    "occluders.depth.front",
    "occluders.depth.back",
    "occluders.depth.layers[]",
    "receivers.depth",
    "receivers.position",
};

} // namespace penumbra::client::detail
