"""Made by `penumbra_describe_scene --python` from the description of the scene file."""

# Where a scene names files; [] is each element of a list, {} each member of a table.
FILE_PLACES = (
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
)
