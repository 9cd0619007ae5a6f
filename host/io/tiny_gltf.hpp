// tinygltf as it is used here: the structure of glTF files. No images, no files of its own; JSON by the nlohmann-json that everything here
// uses.
//
// N.B. Compiled in (tiny_gltf.cpp, hidden symbols) and not linked: Assimp brings libdraco, which exports another version's tinygltf, and of
// two such libraries in one process one gets the other's functions.
#pragma once

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#define TINYGLTF_NO_INCLUDE_JSON
#include <tiny_gltf.h>
